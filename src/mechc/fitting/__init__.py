"""Parameters and starts identified from recorded motions."""
