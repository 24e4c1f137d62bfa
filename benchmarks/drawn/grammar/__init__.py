"""What users write, by subject: each module adds lines to a scene's text."""
