"""Derivation of a mechanism's equations of motion by Kane's method."""
