"""Models of the literature, written as people write them, and SymPy's own numbers of them."""
