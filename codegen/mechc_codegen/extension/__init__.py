"""What a scene's extension is made of: its texts, the compiler flags, and the name of a binary."""
