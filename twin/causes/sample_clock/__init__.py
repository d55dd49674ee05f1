"""The converter's clock is off, so that every frequency is."""
