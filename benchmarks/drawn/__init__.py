"""Scenes drawn at random from a grammar of what users write, each judged by every method and door.

A scene is the text of a program, as a user would write it: so a failure can be read, run by itself
and kept.
"""
