"""E' and G' of a lap joint at one or several preloads, from natural frequencies, with shared effects freed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studies.eigensensitivity import (
    FrequencySet,
    FrequencyUpdate,
    Parameter,
    Pencil,
    model_frequencies,
    update_from_starts,
    update_parameters,
)
from twin.rigs import Rig
from twin.structure import Structure, assemble, with_mass_at

__all__ = ["SharedEffect", "lap_joint_problem", "point_mass_effect", "update_moduli"]

Matrix = NDArray[np.float64]
MODULUS_BOUNDS = (1e3, 1e13)
"""N/m2; beyond them frequencies no longer depend on the layer."""

SHEAR_GRID = np.geomspace(1e6, 3e9, 40)


@dataclass(frozen=True)
class SharedEffect:
    """A positive parameter common to all preloads.

    `contribution` maps its value to what it adds to M and K, and to their derivatives by it: (M, K, dM, dK).
    """

    parameter: Parameter
    contribution: Callable[[float], tuple[Matrix, Matrix, Matrix, Matrix]]


def point_mass_effect(structure: Structure, position_m: float, *, name: str, start_kg: float) -> SharedEffect:
    """A mass fixed at `position_m`, its value free."""
    unit = with_mass_at(structure, structure.layout.place(position_m), 1.0).M - structure.M
    zero = np.zeros_like(unit)
    return SharedEffect(Parameter(name, start_kg, lower=1e-6, upper=10.0), lambda mass: (mass * unit, zero, unit, zero))


def lap_joint_problem(
    rig: Rig,
    measured: Mapping[str, Sequence[float] | Matrix],
    *,
    relative_std: float,
    structure: Structure | None = None,
    effects: Sequence[SharedEffect] = (),
    std_Hz: Mapping[str, Sequence[float] | Matrix] | None = None,
    numbers: Mapping[str, NDArray[np.int64]] | None = None,
) -> tuple[list[FrequencySet], list[Parameter]]:
    """Frequency sets and free parameters of a rig: E' and G' of every measured preload, and the shared effects.

    Parameters are named ``normal_modulus[<preload>]`` and ``shear_modulus[<preload>]``.
    """
    structure = structure or assemble(rig)
    transverse, known = structure.counted, rig.joints[0].preload
    KE, KG = structure.joints[0].KE, structure.joints[0].KG
    sets, parameters = [], []

    def pencil_of(normal: str, shear: str) -> Callable[[Mapping[str, float]], Pencil]:
        def pencil(values: Mapping[str, float]) -> Pencil:
            M, K = structure.M.copy(), structure.K0 + values[normal] * KE + values[shear] * KG
            dM, dK = {}, {normal: KE, shear: KG}
            for effect in effects:
                name = effect.parameter.name
                M_add, K_add, dM[name], dK[name] = effect.contribution(values[name])
                M += M_add
                K += K_add
            return Pencil(M, K, transverse, dM, dK)

        return pencil

    for preload, frequencies in measured.items():
        f = np.asarray(frequencies, float)
        normal, shear = f"normal_modulus[{preload}]", f"shear_modulus[{preload}]"
        moduli = known.get(preload) or next(iter(known.values()))
        for name, start in ((normal, moduli.normal_modulus), (shear, moduli.shear_modulus)):
            parameters.append(Parameter(name, start, lower=MODULUS_BOUNDS[0], upper=MODULUS_BOUNDS[1]))
        std = relative_std * f if std_Hz is None else np.asarray(std_Hz[preload], float)
        number = None if numbers is None else np.asarray(numbers[preload])
        sets.append(FrequencySet(preload, f, std, pencil_of(normal, shear), number=number))
    return sets, parameters + [effect.parameter for effect in effects]


def update_moduli(
    rig: Rig,
    measured: Mapping[str, Sequence[float] | Matrix],
    *,
    relative_std: float = 1e-3,
    std_Hz: Mapping[str, Sequence[float] | Matrix] | None = None,
    numbers: Mapping[str, NDArray[np.int64]] | None = None,
    structure: Structure | None = None,
    effects: Sequence[SharedEffect] = (),
    rescans: int = 2,
) -> FrequencyUpdate:
    """E' and G' at every preload of `measured`, with `effects` shared between them.

    Parameters
    ----------
    rig
        What is assumed; its moduli are where the search starts (the first preload's for one that it lacks).
    measured
        Natural frequencies of bending modes in Hz, by preload.
    relative_std
        Standard deviation of each frequency as a fraction of it, where `std_Hz` does not say.
    std_Hz, numbers
        Standard deviations, and which bending mode each frequency is (from 1), by preload.
    structure
        Other than ``assemble(rig)``.
    effects
        Parameters beside the moduli, such as :func:`point_mass_effect`.
    rescans
        How often to look for better minima on a grid of moduli after the search, about a second each.

    Returns
    -------
    FrequencyUpdate
        With `update.values["normal_modulus[120N]"]` and so on.
    """
    sets, parameters = lap_joint_problem(
        rig, measured, relative_std=relative_std, structure=structure, effects=effects, std_Hz=std_Hz, numbers=numbers
    )
    factors = {p.name: (0.5, 5.0) for p in parameters if p.name.startswith("shear_modulus")}
    update = update_from_starts(sets, parameters, factors=factors)
    for _ in range(rescans):
        moved = dict(update.values)
        for item in sets:
            moved.update(_rescan(item, parameters, moved))
        again = update_parameters(
            sets, [replace(p, start=moved[p.name]) if np.isinf(p.prior_log_std) else p for p in parameters]
        )
        if again.objective > update.objective * (1 - 1e-4):
            break
        update = replace(again, history=update.history + again.history, before=update.before)
    return update


def _rescan(item: FrequencySet, parameters: Sequence[Parameter], values: Mapping[str, float]) -> dict[str, float]:
    """Better moduli of one preload on a grid over both, all else held; the values themselves if there are none.

    An axial mode veers through the bending modes as G' grows, and each crossing makes a narrow minimum of its own.
    """
    own = [p for p in parameters if p.name.endswith(f"[{item.name}]")]
    normal, shear = own

    def misfit(E: float, G: float) -> float:
        model = model_frequencies([item], {**values, normal.name: E, shear.name: G})[item.name]
        return float(np.sum(((model - item.frequency_Hz) / item.std_Hz) ** 2))

    grid = [
        (misfit(values[normal.name] * e, G), values[normal.name] * e, G) for G in SHEAR_GRID for e in (0.7, 1.0, 1.4)
    ]
    best = (misfit(values[normal.name], values[shear.name]), {p.name: values[p.name] for p in own})
    fixed = replace(item, pencil=lambda free: item.pencil({**values, **free}))
    for _, E, G in sorted(grid)[:3]:
        start = min(E, normal.upper)  # frequencies that no joint has drive E' to its bound
        trial = update_parameters([fixed], [replace(normal, start=start), replace(shear, start=G)], max_iterations=20)
        if trial.chi2 < best[0]:
            best = (trial.chi2, trial.values)
    return best[1]
