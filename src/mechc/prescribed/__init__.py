"""Prescribed motions: a path, the positions, speeds and accelerations that follow, the efforts."""
