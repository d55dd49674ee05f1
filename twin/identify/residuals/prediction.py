"""What a model leaves of the data, and how that changes with its parameters."""

from dataclasses import dataclass

from twin.arrays import Array


@dataclass(frozen=True)
class Prediction:
    """Whitened residual and sensitivities.

    Attributes
    ----------
    residual : ndarray, (r,)
        Measured minus predicted in units of its standard deviation; real and imaginary parts.
    jacobian : ndarray, (r, u)
        d(predicted) / d(unknowns), whitened alike.
    blocks : tuple of (name, slice)
        Parts of the residual: each broadband run, the steps' fundamentals, their harmonics.
    """

    residual: Array
    jacobian: Array
    blocks: tuple[tuple[str, slice], ...]

    @property
    def chi2(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)
