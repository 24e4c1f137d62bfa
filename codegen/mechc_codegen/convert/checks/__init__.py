"""Checks of what a user set by hand: velocities, accelerations and gradients against positions."""
