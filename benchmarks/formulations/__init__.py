"""The problems as other tools are told of them: equations, and rigid bodies on joints."""
