"""The description of a scene: mechanism, joints, constraints, terms, and requested outputs."""
