"""What a scene is: mechanisms, joints, constraints, terms, and what is requested of them."""
