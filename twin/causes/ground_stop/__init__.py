"""A stop that the structure strikes on one side once it moves far enough."""
