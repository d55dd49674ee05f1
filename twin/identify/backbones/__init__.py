"""A mode's frequency and damping over amplitude: read off tables of sweeps, and what such a mode answers."""
