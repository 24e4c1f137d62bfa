"""The mechanisms of the library: names, options, default values, compiled variants."""
