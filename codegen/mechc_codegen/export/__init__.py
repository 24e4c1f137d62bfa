"""Export of scenes as files that other programs can use without mechc."""
