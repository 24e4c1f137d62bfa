"""Speed and accuracy of mechc, compared with other tools: docs/benchmarks.md."""
