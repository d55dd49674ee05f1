"""The bolt loses preload while the test runs."""
