"""Constants of the C runtime that decide something: what they are, and what half and twice do."""
