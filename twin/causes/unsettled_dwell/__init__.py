"""A sweep whose steps were measured before the response had settled: a mistake of the procedure, not of the rig."""
