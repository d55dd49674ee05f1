"""What a model leaves of the data, and how that changes with its parameters."""

from dataclasses import dataclass

from twin.arrays import Array


@dataclass(frozen=True)
class Prediction:
    """Whitened residual and sensitivities."""

    residual: Array
    """Measured minus predicted in units of its standard deviation; real and imaginary parts, (r,)."""
    jacobian: Array
    """d(predicted) / d(unknowns), whitened alike, (r, u)."""
    blocks: tuple[tuple[str, slice], ...]
    """Parts of the residual: each broadband run, the steps' fundamentals, their harmonics."""

    @property
    def chi2(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)
