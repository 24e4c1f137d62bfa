"""What is to be known of a mechanism before it moves: :func:`mechc.judge`."""
