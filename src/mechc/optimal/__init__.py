"""Motions for a cost: inputs, parameters and starts by multiple shooting."""
