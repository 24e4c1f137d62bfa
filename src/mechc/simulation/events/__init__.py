"""Events: found, with their resets and stops, in Python and in compiled code."""
