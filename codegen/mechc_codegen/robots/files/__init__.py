"""Robots in files: URDF and its loops."""
