"""Random linkages: as plain data, as mechanisms and SymPy objects, and by textbook formulas."""
