"""The reference problems as mechanisms: each file reads like the problem's derivation."""
