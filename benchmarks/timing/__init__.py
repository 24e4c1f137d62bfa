"""Cases and their times, processes, files of figures, and the machine."""
