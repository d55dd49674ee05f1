"""The structure and its motion: elements, laws of forces, modes and the march through time."""
