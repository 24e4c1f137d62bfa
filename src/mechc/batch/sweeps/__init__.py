"""Plans of sweeps, their summaries and maps."""
