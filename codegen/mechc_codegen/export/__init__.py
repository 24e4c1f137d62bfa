"""Scenes handed on to other programs, as files that need nothing of mechc."""
