"""A part of one channel leaks into another."""
