"""A channel is sampled late: a filter, a multiplexer, a second device not in step."""
