"""Emission of a program as C."""
