"""The papers' law: polynomials of one sensor's amplitude, beside the joint's own."""
