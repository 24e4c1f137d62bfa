"""What the product itself costs, and how that grows."""
