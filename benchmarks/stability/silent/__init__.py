"""Runs that once ended wrong without a word."""
