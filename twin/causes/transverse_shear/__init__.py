"""A beam so thick or so soft in shear that Euler and Bernoulli do not hold."""
