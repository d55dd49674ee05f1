"""A sensor sits at another place than was written down."""
