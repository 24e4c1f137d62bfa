"""Parameters of linkages from what they have to do: points, angles, poses."""
