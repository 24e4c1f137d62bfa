"""A mechanism's derivation as a page for reading."""
