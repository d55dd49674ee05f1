"""Measured natural frequencies of a structure as evidence: tables sorted by state, and the moduli that they give.

Always identified are E' and G' of every joint at every preload that was measured; of a structure without joints Young's
modulus of each of its materials.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings import FrequencyTable
from recordings.errors import InputError
from twin.arrays import Array
from twin.identify.forward.predict import blank_data
from twin.identify.limits import LIMITS
from twin.identify.linear.changed_model import changed_structure
from twin.identify.linear.linear_model import LinearParameters
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.rigs import Rig, moduli_at, preload_names, with_moduli
from twin.rigs.structure_rig import StructureRig
from twin.structure import Structure

KINDS = ("normal_modulus", "shear_modulus")


@dataclass(frozen=True)
class StateFrequencies:
    """Natural frequencies of one state, such as a preload."""

    path: str
    state: str
    number: NDArray[np.int64]
    """Modes, from 1, see :class:`twin.identify.residuals.frequency_model.FrequencyModel`, (m,)."""
    frequency_Hz: Array
    std: Array
    """The standard deviation is relative, and zero where the table gives none, (m,)."""
    model_std: float
    """Relative error of the model, and of measurements whose own is not known."""

    @property
    def stated(self) -> bool:
        """Whether the table gives the standard deviations."""
        return bool(np.all(self.std > 0))

    def select(self, keep: NDArray[np.bool_]) -> StateFrequencies:
        """The frequencies where `keep` is true."""
        kept = {name: getattr(self, name)[keep] for name in ("number", "frequency_Hz", "std")}
        return replace(self, **kept)


@dataclass(frozen=True, kw_only=True)
class MeasuredFrequencies(MeasuredData):
    """Tables of natural frequencies, and the nominal rig that they are held against."""

    tables: tuple[StateFrequencies, ...]
    """One for each state."""
    states: tuple[str, ...]
    """Whose moduli are identified, in the order of their parameters."""
    log_std: float
    """Of the moduli's logarithms beforehand."""

    @property
    def count(self) -> int:
        """Number of frequencies."""
        return sum(len(table.number) for table in self.tables)

    @property
    def frequency_Hz(self) -> Array:
        """All of them, (n,)."""
        return np.concatenate([table.frequency_Hz for table in self.tables])

    @property
    def stated(self) -> bool:
        """Whether all standard deviations are given."""
        return all(table.stated for table in self.tables)

    @property
    def model_std(self) -> float:
        """Largest relative error that is assumed."""
        return max(table.model_std for table in self.tables)

    def without(self, index: int) -> MeasuredFrequencies:
        """All but one frequency, counted through all states."""
        kept, first = [], 0
        for table in self.tables:
            keep = np.arange(first, first + len(table.number)) != index
            first += len(table.number)
            kept += [table.select(keep)] if keep.any() else []
        return replace(self, tables=tuple(kept))

    def against(self, rig: Rig) -> MeasuredFrequencies:
        """The same tables held against another rig of the same joints."""
        own = _nothing_of(rig, self.states[0])
        return replace(self, **own | {"effects": self.effects})

    @cached_property
    def materials(self) -> tuple[tuple[str, ...], ...]:
        """Of a structure without joints: its beams, those of the same Young's modulus together."""
        alike: dict[float, list[str]] = {}
        for beam in () if self.rig.joints else self.rig.layout().beams:
            alike.setdefault(beam.youngs_modulus, []).append(beam.name)
        return tuple(map(tuple, alike.values()))

    @cached_property
    def nominal(self) -> LinearParameters:
        """The moduli as the rig file has them, state by state; without joints E is Young's, and G nothing."""
        if self.rig.joints:
            moduli = [own for state in self.states for own in moduli_at(self.rig, state)]
            E, G = (np.array([getattr(own, kind) for own in moduli]) for kind in KINDS)
        else:
            E = np.array([self.rig.layout().beam(beams[0]).youngs_modulus for beams in self.materials])
            G = np.ones(len(E))
        none = np.zeros(len(E))
        return LinearParameters(E, G, none, none, np.full(LIMITS.damped_modes, 0.01), np.zeros(LIMITS.damped_modes))

    @cached_property
    def where(self) -> dict[str, int]:
        """Place of each modulus' logarithm in the base parameters' vector."""
        blocks = self.nominal.blocks(self.nominal.joints)
        E, G = (range(blocks[name].start, blocks[name].stop) for name in ("log_E", "log_G"))
        if not self.rig.joints:
            labels = [f"[{', '.join(beams)}]" if len(self.materials) > 1 else "" for beams in self.materials]
            return {f"youngs_modulus{label}": place for label, place in zip(labels, E, strict=True)}
        several = len(self.rig.joints) > 1
        labels = [
            f"[{joint.name}, {state}]" if several else f"[{state}]"
            for state in self.states for joint in self.rig.joints
        ]  # fmt: skip
        rows = zip(labels, E, G, strict=True)
        return {kind + label: place for label, *both in rows for kind, place in zip(KINDS, both, strict=True)}

    def moduli(self, base: LinearParameters) -> dict[str, float]:
        """N/m2, by name."""
        return {name: float(np.exp(base.vector[place])) for name, place in self.where.items()}

    def with_moduli(self, found: LinearParameters) -> Rig:
        """The rig file with other moduli."""
        rig = self.rig
        for number, state in enumerate(self.states if rig.joints else ()):
            own = slice(number * len(rig.joints), (number + 1) * len(rig.joints))
            pairs = zip(found.E[own], found.G[own], strict=True)
            moduli = [
                joint.preload[state].model_copy(update=dict(zip(KINDS, map(float, pair), strict=True)))
                for joint, pair in zip(rig.joints, pairs, strict=True)
            ]
            rig = with_moduli(rig, state, moduli)
        if not isinstance(rig, StructureRig):
            return rig
        young = {name: float(E) for beams, E in zip(self.materials, found.E, strict=False) for name in beams}
        parts = [p.model_copy(update={"youngs_modulus": young[p.name]}) if p.name in young else p for p in rig.part]
        return rig.model_copy(update={"part": parts})

    def stiffness_terms(self, modification: ModelModification, structure: Structure) -> list[Array]:
        """What E multiplies in the stiffness, one for every joint or material."""
        if self.rig.joints:
            return [joint.KE for joint in structure.joints]
        terms = []
        for beams, E in zip(self.materials, self.nominal.E, strict=True):
            twice = {name: 2 * modification.beam_modulus.get(name, 1.0) for name in beams}
            stiffer = replace(modification, beam_modulus={**modification.beam_modulus, **twice})
            terms.append((changed_structure(self.rig, stiffer).K0 - structure.K0) / E)
        return terms


def states_of(rig: Rig) -> tuple[str, ...]:
    """States that frequencies may be measured in: the preloads; without a joint there is one."""
    return preload_names(rig) or (("clamped" if rig.layout().supports else "free"),)


def measured_frequencies(
    tables: Sequence[FrequencyTable],
    rig: Rig,
    *,
    preloads: Sequence[str] = (),
    source: str = "rig",
    log_std: float | None = None,
) -> MeasuredFrequencies:
    """Gather tables.

    Parameters
    ----------
    preloads
        Of tables that do not say it themselves: one for all, or one each; the rig's first by default.
    source
        Names the rig in errors.

    Raises
    ------
    InputError
        If a state is not the rig's, is given twice, or contradicts the table's own column.
    """
    if preloads and not rig.joints:
        raise InputError("--preload", "", f"{source} has no joint and so has no preloads", "leave it out")
    found = sort_by_state(tables, states_of(rig), preloads=preloads, source=source)
    return MeasuredFrequencies(
        **_nothing_of(rig, found[0].state),
        tables=found,
        states=tuple(table.state for table in found),
        log_std=log_std or (LIMITS.joint_std if rig.joints else LIMITS.beam_std),
    )


def _nothing_of(rig: Rig, state: str) -> dict[str, Any]:
    """The fields of evidence without a recording."""
    return dict(vars(blank_data(rig, state if rig.joints else None)))


def sort_by_state(
    tables: Sequence[FrequencyTable], states: Sequence[str], *, preloads: Sequence[str] = (), source: str
) -> tuple[StateFrequencies, ...]:
    """The tables' frequencies state by state; see :func:`measured_frequencies`."""
    if len(preloads) not in (0, 1, len(tables)):
        reason = f"is given {len(preloads)} times for {len(tables)} tables"
        raise InputError("--preload", "", reason, "give it once, or once for each table")
    found: dict[str, StateFrequencies] = {}
    for i, table in enumerate(tables):
        given = preloads[0] if len(preloads) == 1 else preloads[i] if preloads else None
        own = np.array([state or given or states[0] for state in table.preload])
        if given is not None and (wrong := next((state for state in own if state != given), None)):
            raise InputError("--preload", "", f"is {given}, {table.path} holds {wrong}", "leave the option out")
        for state in dict.fromkeys(own.tolist()):
            rows = own == state
            if state not in states:
                place = f"line {table.line[rows][0]}, column preload" if any(table.preload) else ""
                where = table.path if any(table.preload) else "--preload"
                raise InputError(where, place, f"{source} has no preload {state}", f"it has {', '.join(states)}")
            if state in found:
                reason = f"{state} is in {found[state].path} already"
                raise InputError(table.path, "", reason, "name the preloads, --preload once a table")
            found[state] = _measured(table, state, rows)
    return tuple(found.values())


def _measured(table: FrequencyTable, state: str, rows: NDArray[np.bool_]) -> StateFrequencies:
    order = np.flatnonzero(rows)[np.argsort(table.mode[rows])]
    f, std, line = table.frequency_Hz[order], table.std_Hz[order], table.line[order]
    if np.any(std == 0):
        place = f"line {line[np.argmax(std == 0)]}, column std_Hz"
        raise InputError(table.path, place, "is zero", "leave the column out if it is not known")
    if np.any(np.diff(f) <= 0):
        place = f"line {line[1 + np.argmax(np.diff(f) <= 0)]}, column frequency_Hz"
        raise InputError(table.path, place, "does not rise with the number of the mode")
    stated = bool(np.all(np.isfinite(std)))
    return StateFrequencies(
        table.path, state, table.mode[order], f, std / f if stated else np.zeros(len(f)),
        LIMITS.model_std if stated else LIMITS.assumed_std,
    )  # fmt: skip
