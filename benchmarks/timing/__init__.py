"""Cases and their times, processes, files of figures, and what they were measured on."""
