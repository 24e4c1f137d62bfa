"""How fast and how right mechc is, measured beside other tools: docs/benchmarks.md."""
