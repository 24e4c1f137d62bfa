"""Cycles of forced, free and hybrid motions, by shooting."""
