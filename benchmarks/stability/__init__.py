"""What becomes of a mechanism under stress: right, refused, or ended with a status."""
