"""What a mechanism looks like: its links, found from its points, and where they are."""
