"""Many trajectories of one model."""
