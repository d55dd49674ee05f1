"""Reports: one page each, its tables and its pictures."""
