"""Ways of drawing a hidden cause's parameters."""

from dataclasses import dataclass

import numpy as np

from twin.rigs import MatricesPart, Rig
from twin.rigs.matrix_files import part_matrices

Parameters = dict[str, float | str]


@dataclass(frozen=True)
class Dice:
    """Ways of drawing a parameter."""

    rng: np.random.Generator
    rig: Rig
    strength: float

    def size(self, low: float, high: float) -> float:
        """Log-uniform, times the strength."""
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high)))) * self.strength

    def plain(self, low: float, high: float) -> float:
        """Uniform, whatever the strength."""
        return float(self.rng.uniform(low, high))

    def signed(self, low: float, high: float) -> float:
        """A size of either sign."""
        return self.size(low, high) * float(self.rng.choice([-1.0, 1.0]))

    def lost(self, low: float, high: float) -> float:
        """A factor below one, from the share that is lost."""
        return 1.0 - min(self.size(low, high), 0.95)

    def beam(self) -> str:
        """One of the rig's; ValueError without any."""
        names = [beam.name for beam in self.rig.layout().beams]
        if not names:
            raise ValueError(f"rig {self.rig.name!r} has no beam")
        return str(self.rng.choice(names))

    def response(self) -> str:
        """A response channel."""
        return str(self.rng.choice([s.channel for s in self.rig.response_sensors]))

    def joint(self) -> Parameters:
        """One of several joints; nothing to say of a single one, and ValueError without any."""
        names = [joint.name for joint in self.rig.joints]
        if not names:
            raise ValueError(f"rig {self.rig.name!r} has no joint")
        return {"joint": str(self.rng.choice(names))} if len(names) > 1 else {}

    def along(self, low: float, high: float) -> Parameters:
        """A place, as shares of the length: of the whole structure where it is one line of beams, else of a beam.

        On a rig without beams it is one of the nodes.
        """
        layout = self.rig.layout()
        if layout.passable:
            return {"position_m": self.plain(low, high) * layout.length}
        if not layout.beams:
            parts = [part for part in layout.parts if isinstance(part, MatricesPart)]
            part = parts[int(self.rng.integers(len(parts)))]
            return {"part": part.name, "node": float(self.rng.choice(part_matrices(layout, part).nodes))}
        beam = layout.beam(self.beam())
        return {"part": beam.name, "position_m": self.plain(low, high) * beam.length}
