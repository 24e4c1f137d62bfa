"""The picture of a mechanism: links inferred from its points, and where they are."""
