"""The Taylor coefficients of a motion."""
