"""A number with its uncertainty."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Estimate:
    """A value with its standard deviation."""

    value: float
    std: float

    def scaled(self, factor: float) -> "Estimate":
        """In another unit."""
        return Estimate(factor * self.value, factor * self.std)

    def __format__(self, spec: str) -> str:
        """As :meth:`__str__`, as wide as `spec` says for texts; a ``+`` before that shows a positive value's sign."""
        of_text = spec.removeprefix("+")
        return format(("+" if spec != of_text and self.value >= 0 else "") + str(self), of_text)

    def __str__(self) -> str:
        """The value to the digits that its deviation supports: one of that, or two where it begins with a 1."""
        if not np.isfinite(self.std) or self.std <= 0:
            return f"{self.value:.4g}"
        leading, _, exponent = f"{self.std:.1e}".partition("e")
        decimals = (1 if leading[0] == "1" else 0) - int(exponent)
        if -4 <= decimals <= 8 and abs(self.value) < 1e6:
            return " ± ".join(f"{round(x, decimals):.{max(decimals, 0)}f}" for x in (self.value, self.std))
        digits = decimals + int(np.floor(np.log10(max(abs(self.value), self.std)))) + 1
        return f"{self.value:.{min(max(digits, 1), 8) - 1}e} ± {self.std:.{int(leading[0] == '1')}e}"
