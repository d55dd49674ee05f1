"""A channel has a high-pass that nobody entered: AC coupling, a charge amplifier's time constant."""
