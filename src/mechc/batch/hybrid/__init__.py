"""Batches whose members jump: events, contact, and controllers called at their instants."""
