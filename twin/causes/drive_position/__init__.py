"""The shaker drives the beam at another place than was written down."""
