"""Near misses: critical configurations whose gap is small but not zero."""
