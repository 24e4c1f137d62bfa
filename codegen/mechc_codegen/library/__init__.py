"""The mechanisms that mechc knows by name."""
