"""Nonlinear forces, the law of the joints first of all: at ports, by their own motion, balanced in harmonics."""
