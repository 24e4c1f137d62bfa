"""A motion in space: one page with its solids, camera and plots, and pictures made from it."""
