"""Young's modulus of one beam is not what the data sheet says."""
