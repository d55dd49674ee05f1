"""Hum of the mains on a channel."""
