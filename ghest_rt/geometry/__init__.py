"""Rotations and rigid transforms as plain NumPy arrays; `a_from_b` maps coordinates in frame b to frame a."""
