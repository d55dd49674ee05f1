"""Runs on disk: channels, sample blocks, steps and events in MCAP.  No physics, no hardware."""
