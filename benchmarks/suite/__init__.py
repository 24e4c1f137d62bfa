"""The commands, what runs them, and the comparison of tools on the problems."""
