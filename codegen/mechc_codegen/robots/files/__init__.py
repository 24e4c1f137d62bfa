"""Robots in files: SDFormat, and URDF with its loops."""
