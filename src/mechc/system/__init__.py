"""Data, parameters and compiled functions of a scene."""
