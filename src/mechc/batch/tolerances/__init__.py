"""What tolerances of parts do to results of a motion: exact first-order shares, and drawn parts."""
