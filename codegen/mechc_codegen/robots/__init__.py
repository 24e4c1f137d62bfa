"""Robots in URDF, the XML format of ROS, as mechanisms."""
