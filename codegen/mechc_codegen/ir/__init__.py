"""The intermediate form: a straight-line program, and the passes over it."""
