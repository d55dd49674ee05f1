"""What a modal test gives: the fit, the responses behind it, shapes, and how they compare with a rig's."""

from dataclasses import dataclass

from twin.arrays import Array
from twin.identify.modes.beside_model import BesideModel
from twin.identify.modes.fit import ModalFit
from twin.identify.modes.shapes import Shape


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredModes:
    """Modes of a recording."""

    run: str
    force: str
    channels: tuple[str, ...]
    places: tuple[str, ...]
    """Of the shapes: the points of an impact test, or the channels."""
    fit: ModalFit
    frequency_Hz: Array
    H: Array
    """The responses that were fitted, (f,) and (f, o), with the names of their `outputs`."""
    outputs: tuple[str, ...]
    shapes: tuple[Shape, ...]
    """Of each mode of the fit."""
    coherence: Array | None = None
    """Of an impact test, (f, o)."""
    rate_per_s: float = 0.0
    """Of the exponential window that the responses were seen through."""
    beside: BesideModel | None = None
    notes: tuple[str, ...] = ()
    """What is wrong, or was set aside."""

    @property
    def sentence(self) -> str:
        """How many modes, and how well they are the model's."""
        modes, beside = self.fit.modes, self.beside
        if not modes:
            return "No mode was found."
        told = f"{len(modes)} modes from {modes[0].frequency_Hz:.5g} to {modes[-1].frequency_Hz:.5g} Hz"
        if beside is not None and beside.pairs:
            Hz = beside.modelled.modes.frequency_Hz
            off = max(abs(modes[r].frequency_Hz / Hz[m] - 1) for r, m in beside.pairs.items())
            told += f"; {len(beside.pairs)} are the model's within {100 * off:.2g} %"
            if len(beside.places) > 1:
                told += f" and with a MAC of at least {min(beside.mac[pair] for pair in beside.pairs.items()):.3f}"
        return f"{told}."
