"""The problems for other tools: equations, and rigid bodies with joints."""
