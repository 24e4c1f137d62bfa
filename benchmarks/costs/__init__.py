"""Costs of mechc itself, and how they grow."""
