"""The wait before the first value, and before the first motion."""
