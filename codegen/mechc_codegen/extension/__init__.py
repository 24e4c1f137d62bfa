"""A scene's extension: its texts, the compiler flags, and the name of the binary."""
