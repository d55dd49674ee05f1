"""The clamp turns under the beam's root moment."""
