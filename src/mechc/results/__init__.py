"""Files, summaries, pictures and animations."""
