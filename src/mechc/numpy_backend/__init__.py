"""Scenes without a C compiler."""
