"""The commands, the processes they run in, and the comparison of tools on the problems."""
