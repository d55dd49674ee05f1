"""The linear rig: receptances between its ports, and its moduli and damping fitted to broadband runs."""
