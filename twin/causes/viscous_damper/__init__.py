"""Something that rubs viscously against the surroundings: a cable in a tight guide, grease, a foam rest."""
