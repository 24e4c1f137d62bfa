"""Chains of any number of links."""
