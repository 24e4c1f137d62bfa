"""From what was read to a mechanism: kinematics, potential, constraints told apart."""
