"""One uniform beam's natural frequencies, hung free or clamped, under the causes that such a specimen may have."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from recordings.errors import InputError
from twin.diagnose.cause import Parameter
from twin.diagnose.models import CAUSES
from twin.diagnose.result import Estimate
from twin.diagnose.tables.limits import LIMITS
from twin.diagnose.tables.model import Active, BaseParameter, Change, Matrices
from twin.rigs import Effect
from twin.rigs.beam import BeamRig
from twin.structure.beam import curvature_shape
from twin.structure.free_beam import FreeBeam, free_beam

Matrix = NDArray[np.float64]
MODULUS = "youngs_modulus"


@dataclass(frozen=True)
class SingleBeamFrequencies:
    """The model of a beam; `source` names its rig file in errors."""

    rig: BeamRig
    source: str = "rig"

    @property
    def base(self) -> tuple[BaseParameter, ...]:
        """Young's modulus."""
        return (BaseParameter(MODULUS, self.rig.beam.youngs_modulus, LIMITS.modulus_std),)

    @property
    def conditions(self) -> Mapping[str, Mapping[str, str]]:
        """The support is the only one."""
        return {self.rig.support: {MODULUS: MODULUS}}

    @cached_property
    def changes(self) -> tuple[Change, ...]:
        """A mass, a weak section, shear, and a clamp that turns where there is one."""
        beam = self.rig.beam
        own = beam.density * beam.area * beam.length
        ends = beam.length if self.rig.support == "clamped" else beam.length / 2  # a free beam looks alike from both
        places = tuple(float(x) for x in np.linspace(0.02 * ends, ends, 15)[::-1])
        mass = Parameter(
            name="mass_kg", scale=0.1 * own, lower=-0.2 * own, upper=3 * own, null=0.0, starts=(0.03 * own,)
        )
        weak = Parameter(name="factor", scale=0.4, lower=0.02, upper=1.0, null=1.0, starts=(0.8,))
        position = Parameter(name="position_m", scale=ends, lower=0.0, upper=ends, starts=places)
        unit = beam.length / (beam.youngs_modulus * beam.second_moment)
        table: list[tuple[str, dict[str, str], tuple[Parameter, ...]]] = [
            ("added-mass", {}, (mass, position)),
            ("stiffness-loss", {}, (weak, position)),
        ]
        if beam.shear_ratio == 0:
            ratio = Parameter(name="modulus_ratio", scale=30.0, lower=1e-3, upper=500.0, null=1e-3, starts=(10.0,))
            table.append(("transverse-shear", {"beam": self.rig.name}, (ratio,)))
        if self.rig.support == "clamped":
            turn = Parameter(
                name="rotational_rad_per_Nm", scale=0.02 * unit, lower=1e-6 * unit, upper=unit, null=1e-6 * unit,
                starts=(0.005 * unit,),
            )  # fmt: skip
            table.append(("clamp-compliance", {}, (turn,)))
        return tuple(Change(name, CAUSES[name].summary, label, parameters) for name, label, parameters in table)

    @property
    def silent(self) -> tuple[str, ...]:
        """All other causes; the modulus is identified in any case."""
        named = {change.cause for change in self.changes} | {"beam-modulus"}
        return tuple(name for name in CAUSES if name not in named)

    def matrices(self, active: Active) -> Matrices:
        """The beam with the rig file's own effects and `active`, its stiffness per unit of the modulus."""
        acting = [(change.cause, values) for change, values in active] + self._nominal
        ratio = self.rig.beam.shear_ratio + sum(v["modulus_ratio"] for name, v in acting if name == "transverse-shear")
        mesh = _mesh(self.rig, ratio)
        M, K = mesh.M.copy(), mesh.K.copy()
        spring = np.inf
        for name, values in acting:
            if name == "added-mass":
                row = mesh.row(values["position_m"])
                M += values["mass_kg"] * np.outer(row, row)
            elif name == "stiffness-loss":
                K -= (1 - values["factor"]) * self._section(mesh, values["position_m"])
            elif name == "clamp-compliance":
                spring = 1 / (1 / spring + values["rotational_rad_per_Nm"])
        K0 = np.zeros_like(K)
        held = 0
        if self.rig.support == "clamped":
            held = 1 if np.isfinite(spring) else 2
            if held == 1:
                K0[1, 1] = spring
        free = slice(held, None)
        return Matrices(M[free, free], K0[free, free], {MODULUS: K[free, free]}, mesh.transverse[free])

    def extended(self, moduli: Mapping[str, Estimate], active: Active, std: Sequence[Mapping[str, float]]) -> BeamRig:
        """The beam with its identified modulus, and the changes as effects."""
        beam = self.rig.beam.model_copy(update={MODULUS: moduli[MODULUS].value})
        effects = [
            Effect(cause=change.cause, parameters={**change.label, **values}, std=dict(errors))
            for (change, values), errors in zip(active, std, strict=True)
        ]
        return self.rig.model_copy(update={"beam": beam, "effect": [*self.rig.effect, *effects]})

    @cached_property
    def _nominal(self) -> list[tuple[str, Mapping[str, float]]]:
        """The file's own effects, checked against what this model knows."""
        known = {change.cause: change for change in self.changes}
        found: list[tuple[str, Mapping[str, float]]] = []
        for number, effect in enumerate(self.rig.effect):
            place = f"effect.{number} ({effect.cause})"
            if effect.cause not in known:
                raise InputError(
                    self.source, place, "is none that a single beam can have", f"it takes {', '.join(known)}"
                )
            values = {name: value for name, value in effect.parameters.items() if not isinstance(value, str)}
            for parameter in known[effect.cause].parameters:
                value = values.get(parameter.name)
                if value is None or not parameter.lower <= value <= parameter.upper:
                    limits = f"from {parameter.lower:g} to {parameter.upper:g}"
                    raise InputError(self.source, place, f"{parameter.name} is {value}", f"give a number {limits}")
            found.append((effect.cause, values))
        return found

    def _section(self, mesh: FreeBeam, position_m: float) -> Matrix:
        """Bending stiffness of a short section per unit of the modulus.

        Many points, because the curvature jumps between elements, and a section moves along them.
        """
        beam, length = self.rig.beam, LIMITS.weak_section * self.rig.beam.length
        places, weights = np.polynomial.legendre.leggauss(8)
        points = np.clip(position_m + length / 2 * places, 0.0, beam.length)
        rows = np.array([mesh.row(float(point), curvature_shape) for point in points])
        return np.asarray(beam.second_moment * length / 2 * (rows.T * weights) @ rows)


def _mesh(rig: BeamRig, shear_ratio: float) -> FreeBeam:
    """The free beam with a modulus of one."""
    beam = rig.beam
    size = (beam.length, beam.width, beam.thickness, beam.density)
    return _meshed(*size, shear_ratio, rig.elements)


@lru_cache(maxsize=8)
def _meshed(
    length: float, width: float, thickness: float, density: float, shear_ratio: float, elements: int
) -> FreeBeam:
    """Rotary inertia belongs with shear: both are what the slender beam leaves out."""
    return free_beam(
        length=length, width=width, thickness=thickness, youngs_modulus=1.0, density=density, shear_ratio=shear_ratio,
        rotary=shear_ratio > 0, elements=elements,
    )  # fmt: skip
