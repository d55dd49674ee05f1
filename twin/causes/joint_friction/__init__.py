"""Micro-slip in the joint: a slider that sticks until its force is reached, then slips."""
