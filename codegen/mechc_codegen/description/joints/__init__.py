"""Joints of the tree, cuts that close loops, and couplings."""
