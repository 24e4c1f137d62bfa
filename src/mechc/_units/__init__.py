"""Units that run the tapes of all scenes of a kind, compiled while mechc is built."""
