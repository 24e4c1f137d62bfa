"""A motion as a function of unknown numbers: what fits, searches and sliders have in common."""
