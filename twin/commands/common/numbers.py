"""Numbers on the command line."""

import math

import click


class FiniteRange(click.FloatRange):
    """A range of numbers; what is no number (nan), which is neither below nor above a bound, is refused."""

    def convert(self, value: float, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """As click does, and finite."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a finite number", param, ctx)
        return number
