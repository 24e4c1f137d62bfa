"""Models of other people's suites, described as users of mechc describe theirs."""
