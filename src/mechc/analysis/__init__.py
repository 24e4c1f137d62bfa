"""Linear models, equilibria, inverse dynamics, Jacobians, rank of the constraints."""
