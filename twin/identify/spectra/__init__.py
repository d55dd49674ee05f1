"""Recordings as numbers: spectra and binned responses of broadband runs, harmonics of stepped sines."""
