"""The clamp's foundation moves with the drive force."""
