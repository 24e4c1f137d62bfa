"""Batches in a folder: what is in it, and how it is written and resumed."""
