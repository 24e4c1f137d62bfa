"""The stress suite: hard cases must be right, refused, or ended with a status."""
