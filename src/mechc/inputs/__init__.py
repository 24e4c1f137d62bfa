"""Inputs that are given with a run."""
