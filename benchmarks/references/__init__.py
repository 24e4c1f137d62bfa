"""Exact motions, and forms of the four-bar that are regular where its equations are not."""
