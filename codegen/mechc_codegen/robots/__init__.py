"""Robots as mechanisms: the links and joints that URDF, SDFormat and MJCF describe."""
