"""Derivatives of a run by parameters, inputs and its start: forward sensitivities."""
