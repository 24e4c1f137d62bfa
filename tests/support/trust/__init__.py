"""What fuzzers, fault injection and sanitizers share."""
