"""Contact that lasts, and dry friction: the motion in modes of contact, and their changes."""
