"""What stands on the bench: two beams, a bolted joint between them, masses, and whatever else touches them."""

from __future__ import annotations

from dataclasses import dataclass

from tests.second_bench.mechanics.beams import Beam, WeakStretch
from tests.second_bench.mechanics.laws import Kind


@dataclass(frozen=True, kw_only=True)
class Layer:
    """The joint: a thin layer of springs and friction, at points of its own.

    Attributes
    ----------
    begin, end
        Of the overlap, m along the structure.
    width, height
        m; the height from neutral axis to neutral axis.
    normal_modulus, shear_modulus
        Of the layer at rest, N/m2.
    points
        Gauss points along the overlap, each with an opening and a slip.
    softening, opening_m, early
        Share of the normal modulus that is lost where the layer opens far, the opening at which it goes, and the part
        of it that goes early, see :func:`laws.saturating`.
    friction, slip_m, travel_m
        Friction of asperities that ride up as far as they lately slipped, s: friction s^2 / (slip + s) for each area
        over height, N/m2 at large slip; it turns its sign within `travel_m`.
    gap_m, slap_factor
        Opening beyond which a point has kept `slap_factor` of its stiffness.
    sliders
        (point, stiffness in N/m, slip force in N) of Coulomb friction on a point's slip.
    """

    begin: float
    end: float
    width: float
    height: float
    normal_modulus: float
    shear_modulus: float
    points: int
    softening: float
    opening_m: float
    early: float
    friction: float
    slip_m: float
    travel_m: float
    gap_m: float = float("inf")
    slap_factor: float = 1.0
    sliders: tuple[tuple[int, float, float], ...] = ()


@dataclass(frozen=True)
class GroundElement:
    """Something between the structure, at `position` m along it, and the ground; `parameters` as its kind has them."""

    kind: Kind
    position: float
    parameters: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """A structure as it truly is.

    Attributes
    ----------
    lower, upper
        The clamped beam and the one bolted onto it.
    elements
        Of the two beams.
    drive_position
        m along the structure.
    sensors
        Channel to its place, m.
    masses
        (position in m, kg) of points, those of sensors among them.
    modal_ratio
        Damping ratios; the last one holds for all higher modes.
    weak
        Stretches that lost stiffness.
    ground
        What touches the structure.
    preload_rate, moduli_rate
        What the layer's normal modulus, and all moduli, lose with each recorded second, 1/s.
    """

    lower: Beam
    upper: Beam
    elements: tuple[int, int]
    layer: Layer
    drive_position: float
    sensors: dict[str, float]
    masses: tuple[tuple[float, float], ...]
    modal_ratio: tuple[float, ...]
    weak: tuple[WeakStretch, ...] = ()
    ground: tuple[GroundElement, ...] = ()
    preload_rate: float = 0.0
    moduli_rate: float = 0.0

    @property
    def length(self) -> float:
        """From the clamp to the tip, m."""
        return self.upper.start + self.upper.length
