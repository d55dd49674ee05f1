"""A stiffening spring to ground: a taut wire, a membrane, a geometric effect of the suspension."""
