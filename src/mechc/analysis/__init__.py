"""Linear models, equilibria, inverse dynamics, rank of the constraints."""
