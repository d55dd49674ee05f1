"""A channel is wired or mounted the wrong way round."""
