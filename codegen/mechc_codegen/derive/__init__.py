"""From a mechanism to its equations of motion, by Kane's method."""
