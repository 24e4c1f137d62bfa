"""Conversion of SymPy objects to mechanisms: kinematics, potential energy, constraints."""
