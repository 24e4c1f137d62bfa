"""Models in MJCF, the XML format of MuJoCo, as mechanisms."""
