"""Finite elements: beams in the plane and in space, and the thin layer between two of them."""
