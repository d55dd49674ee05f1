"""The joint opens on one side of its motion: the layer loses stiffness beyond a gap (micro-slap)."""
