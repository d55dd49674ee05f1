"""A crack or a damaged section: a short length of beam bends more easily."""
