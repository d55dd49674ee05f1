"""The structure warms up while the test runs."""
