"""The aluminium-composite joint at one overlap: a model affine in all of its unknowns but the overlap itself."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.eigensensitivity import FrequencySet, Pencil
from twin.rigs import LapJointRig
from twin.structure import assemble, with_mass_at

Matrix = NDArray[np.float64]
MASSES = ("sensor_mass", "bolt_mass", "drive_mass")


@dataclass(frozen=True)
class HybridModel:
    """Matrices of the joint, (n, n): M = M0 + masses, K = K0 + Ec Kc + E' KE + G' KG.

    `unit_masses` holds the mass matrix of one kilogramme for each of :data:`MASSES`.
    """

    rig: LapJointRig
    M0: Matrix
    K0: Matrix
    Kc: Matrix
    KE: Matrix
    KG: Matrix
    unit_masses: dict[str, Matrix]
    transverse: NDArray[np.bool_]

    def pencil(self, condition: str, fixed: Mapping[str, float]) -> Callable[[Mapping[str, float]], Pencil]:
        """The model in one condition; what is not free is taken from `fixed`."""
        normal, shear = f"normal_modulus[{condition}]", f"shear_modulus[{condition}]"
        dK = {"composite_modulus": self.Kc, normal: self.KE, shear: self.KG}

        def pencil(values: Mapping[str, float]) -> Pencil:
            p = {**fixed, **values}
            M = self.M0 + sum(p[name] * unit for name, unit in self.unit_masses.items())
            K = self.K0 + sum(p[name] * matrix for name, matrix in dK.items())
            return Pencil(M, K, self.transverse, self.unit_masses, dK)

        return pencil

    def sets(
        self, measured: Mapping[str, list[float]], *, relative_std: float, fixed: Mapping[str, float]
    ) -> list[FrequencySet]:
        """Measured frequencies by condition with this model behind them."""
        return [
            FrequencySet(name, np.array(f), relative_std * np.array(f), self.pencil(name, fixed))
            for name, f in measured.items()
        ]


def hybrid_model(rig: LapJointRig, *, overlap_m: float, shear_ratio: float = 0.0) -> HybridModel:
    """The joint of `rig` with another overlap and the composite's shear ratio, on the rig's own mesh.

    The sensor stays at its stated position or, where the overlap shortens the structure below that, at the tip.
    """
    upper = rig.upper.model_copy(update={"youngs_modulus": 1.0, "shear_ratio": shear_ratio})
    joint = rig.joint.model_copy(update={"overlap": overlap_m})
    one = rig.model_copy(update={"upper": upper, "joint": joint})
    two = one.model_copy(update={"upper": upper.model_copy(update={"youngs_modulus": 2.0})})
    a, b = (assemble(r, sensor_masses=False) for r in (one, two))
    Kc = b.K0 - a.K0
    places = {
        "sensor_mass": min(rig.layout().position(rig.place_of(rig.response_sensors[0].channel)) or 0.0, one.length),
        "bolt_mass": one.lower.length - overlap_m / 2,
        "drive_mass": rig.drive.position,
    }
    units = {name: with_mass_at(a, a.layout.place(place), 1.0).M - a.M for name, place in places.items()}
    return HybridModel(one, a.M, a.K0 - Kc, Kc, a.joints[0].KE, a.joints[0].KG, units, a.counted)
