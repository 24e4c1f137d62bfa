"""The mechanisms of the library."""
