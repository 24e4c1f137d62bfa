"""The player that every page with a motion has, and the picture in the plane."""
