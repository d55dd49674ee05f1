"""Residuals of natural frequencies against an extended model, whitened, with sensitivities to the moduli.

A residual is ln f measured minus ln f of the model; with mass-normalised shapes d(omega^2)/dp = phi' (dK/dp) phi.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np

from recordings.errors import InputError
from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.frequency_shifts import SHIFT
from twin.identify.limits import LIMITS
from twin.identify.linear.changed_model import changed_structure
from twin.identify.linear.linear_fit import base_prior
from twin.identify.linear.linear_model import LinearParameters
from twin.identify.model_modification import Attachment, ModelModification
from twin.identify.residuals.error_model import SOUND, ErrorModel, ErrorSources
from twin.identify.residuals.linearisation import Linearisation
from twin.identify.residuals.natural_frequencies import MeasuredFrequencies, StateFrequencies
from twin.identify.residuals.prediction import Prediction
from twin.identify.residuals.whitening import CovarianceTerms
from twin.structure import Structure
from twin.structure.modes import counted_modes

PROBE = 2 * np.pi * np.array([0.0, 50.0, 100.0])
"""Three frequencies that tell a mass and a spring from any other attachment, rad/s."""
SHEAR_GRID, NORMAL_FACTORS = np.geomspace(1e6, 3e9, 40), np.geomspace(0.4, 2.5, 12)
"""N/m2, from layers that hardly hold to those that frequencies cannot tell from rigid ones; and of E' as assumed."""


class FrequencyModel:
    """Evaluates natural frequencies of `evidence` for an extension of the nominal rig.

    Modes count from 1: bending modes where beams lie in one row, else all that strain something.
    """

    laws = 0
    """Frequencies of small motion say nothing of a joint's law."""

    def __init__(
        self,
        evidence: MeasuredFrequencies,
        modification: ModelModification | None = None,
        *,
        errors: ErrorModel = SOUND,
        held: Linearisation | None = None,
    ) -> None:
        self.evidence, self.errors, self._held = evidence, errors, held
        self.modification = evidence.known.merged(modification) if modification else evidence.known

    def prior(self, baseline: BaselineParameters) -> tuple[Array, Array]:
        """Mean and precision (u, u) of the unknowns."""
        return base_prior(self.evidence.nominal, moduli_std=self.evidence.log_std)

    def inferred_precision(self, baseline: BaselineParameters, errors: ErrorModel) -> Array:
        """Nothing, (u, u)."""
        return np.zeros((len(baseline.blocks),) * 2)

    def linearisation(self, baseline: BaselineParameters, *, sensitivities: bool = True) -> Linearisation:
        """What a fit that begins at these unknowns may hold: the variances."""
        made_of = self.error_sources()
        return Linearisation((), made_of.of_steps(self.errors.steps), None, None, baseline, None, made_of)

    def error_sources(self) -> ErrorSources:
        """What the residuals' variances (n, 1) are made of: each errs by half of what its mode's stiffness does."""
        tables = self.evidence.tables
        std = np.concatenate([table.std for table in tables])
        share = np.concatenate([np.full(len(table.number), table.model_std) for table in tables])
        state = np.repeat([self.evidence.states.index(t.state) for t in tables], [len(t.number) for t in tables])
        given, by_stiffness = (each[:, None, None] ** 2 for each in (std, share / self.evidence.model_std / 2))
        shifts = SHIFT * np.eye(int(state.max()) + 1)[state][:, None, :]
        return ErrorSources((), CovarianceTerms(given, (by_stiffness, np.zeros_like(given))), (), ((), shifts))

    def evaluate(self, baseline: BaselineParameters, *, sensitivities: bool = True) -> Prediction:
        """Residual of all tables, with its sensitivities to the moduli; NaN where there is no such structure."""
        std = (self._held or self.linearisation(baseline)).steps.factor[:, 0, 0]
        J = np.zeros((len(std), len(baseline.vector)))
        try:
            found = [self.modes(table, baseline.base) for table in self.evidence.tables]
        except (np.linalg.LinAlgError, ValueError):
            return Prediction(np.full(len(std), np.nan), J, (("steps", slice(0, len(std))),))
        rows = [np.log(t.frequency_Hz / f) for t, (f, _) in zip(self.evidence.tables, found, strict=True)]
        first = 0
        for table, (f, Phi) in zip(self.evidence.tables, found, strict=True) if sensitivities else ():
            own, moduli = slice(first, first + len(f)), self._moduli(table.state, baseline.base)
            for terms, values, block in zip(self._matrices[2], moduli, ("log_E", "log_G"), strict=True):
                for k, (term, value) in enumerate(zip(terms, values, strict=True), self._first(table.state)):
                    by_stiffness = np.einsum("im,im->m", Phi, value * term @ Phi) / (2 * (2 * np.pi * f) ** 2)
                    J[own, baseline.blocks[block].start + k] = by_stiffness
            first = own.stop
        return Prediction(np.concatenate(rows) / std, J / std[:, None], (("steps", slice(0, len(std))),))

    def modes(self, table: StateFrequencies, base: LinearParameters) -> tuple[Array, Array]:
        """Natural frequencies (m,) in Hz and mass-normalised shapes (n, m) of a table's modes.

        ValueError if the structure has too few modes.
        """
        M, K0, terms = self._matrices
        K = K0.copy()
        for own, values in zip(terms, self._moduli(table.state, base), strict=True):
            K += sum((value * term for term, value in zip(own, values, strict=True)), np.zeros_like(K))
        shift = (LIMITS.shifted_by * 2 * np.pi * float(np.min(table.frequency_Hz))) ** 2
        found = counted_modes(M, K, self.structure.counted, least=int(table.number.max()), shift=shift)
        chosen = table.number - 1
        return found.omega[chosen] / (2 * np.pi), found.Phi[:, chosen]

    def frequencies(self, table: StateFrequencies, base: LinearParameters) -> Array:
        """Natural frequencies (m,) of a table's modes, Hz."""
        return self.modes(table, base)[0]

    def _first(self, state: str) -> int:
        return self.evidence.states.index(state) * len(self.evidence.rig.joints)

    def _moduli(self, state: str, base: LinearParameters) -> tuple[Array, Array]:
        """E and G of the joints in a state, or of the materials, with what the extension makes of them."""
        if not self.evidence.rig.joints:
            return base.E, np.zeros(0)
        first, joints = self._first(state), [joint.name for joint in self.structure.joints]
        own = slice(first, first + len(joints))
        factors = np.array([self.modification.moduli_factor.get(name, LIMITS.unchanged_moduli) for name in joints])
        return base.E[own] * factors[:, 0], base.G[own] * factors[:, 1]

    @cached_property
    def structure(self) -> Structure:
        """With the extension's beams, supports and layers."""
        if not self.modification.changes_structure:
            return self.evidence.model.structure
        return changed_structure(self.evidence.rig, self.modification)

    @cached_property
    def _matrices(self) -> tuple[Array, Array, tuple[list[Array], list[Array]]]:
        """Mass, stiffness without the moduli's, and what E and what G multiply in it."""
        evidence, M, K = self.evidence, self.structure.M.copy(), self.structure.K0.copy()
        by_E = evidence.stiffness_terms(self.modification, self.structure)
        for term, E in zip(by_E, evidence.nominal.E, strict=True) if evidence.materials else ():
            K -= E * term
        for attachment in self.modification.attachments:
            if attachment.drive:
                continue  # of another drive than the first
            found = mass_and_spring(attachment, self.structure)
            if found is not None:
                M += found[0]
                material = next((k for k, beams in enumerate(evidence.materials) if attachment.beam in beams), None)
                if material is None:
                    K += found[1]
                else:  # a section goes with its beam's modulus
                    by_E[material] = by_E[material] + found[1] / evidence.nominal.E[material]
        return M, K, (by_E, [joint.KG for joint in self.structure.joints])


def mass_and_spring(attachment: Attachment, structure: Structure) -> tuple[Array, Array] | None:
    """What an attachment adds to M and K, (n, n) each; None if it is more than a mass and a spring."""
    rows = np.atleast_2d(attachment.rows(structure))
    D = np.asarray(attachment.stiffness(PROBE), complex)
    spring, mass = D[0], (D[0] - D[1]) / PROBE[1] ** 2
    size = np.abs(D).max()
    if np.abs(D.imag).max() > 1e-9 * size or np.abs(D[2] - (spring - mass * PROBE[2] ** 2)).max() > 1e-9 * size:
        return None
    M, K = (np.diag(part.real) if part.ndim == 1 else part.real for part in (mass, spring))
    return rows.T @ M @ rows, rows.T @ K @ rows


def sound_errors(evidence: MeasuredFrequencies) -> ErrorModel:
    """What is assumed of the frequencies' own errors."""
    return replace(SOUND, steps=replace(SOUND.steps, stiffness=2 * evidence.model_std))


def check_modes(evidence: MeasuredFrequencies) -> None:
    """Refuse modes that the mesh does not have.

    InputError that names the mode.
    """
    structure = evidence.model.structure
    reduced = sum(part.size for part in structure.reductions)
    elements = (len(structure.M) - reduced) // 6 + reduced // 2
    for table in evidence.tables:
        if table.number[-1] > elements:
            reason = f"mode {table.number[-1]} is beyond the {elements} that this rig's mesh can show"
            raise InputError(table.path, "column mode", reason, "give it more elements, or leave the mode out")


def starting_moduli(evidence: MeasuredFrequencies) -> list[LinearParameters]:
    """The nominal moduli, and those where the misfit of the best E' along a grid of G' has minima, joint by joint.

    Another mode veers through the measured ones as a joint's modulus grows, and every crossing makes a narrow minimum.
    """
    nominal, model = evidence.nominal, FrequencyModel(evidence)
    joints, most = len(evidence.rig.joints), LIMITS.as_probable * evidence.log_std
    best = [nominal] * LIMITS.frequency_model_followed
    for table in evidence.tables if joints else ():
        begun, first = [nominal], evidence.states.index(table.state) * joints

        def misfit(base: LinearParameters, table: StateFrequencies = table) -> float:
            try:
                return float(np.sum(np.log(model.frequencies(table, base) / table.frequency_Hz) ** 2))
            except (np.linalg.LinAlgError, ValueError):
                return np.inf

        for k in range(first, first + joints):
            own, found = np.arange(len(nominal.E)) == k, list[tuple[float, LinearParameters]]()
            for base in begun:
                tried = [
                    [
                        replace(base, E=np.where(own, E, base.E), G=np.where(own, G, base.G))
                        for E in nominal.E[k] * NORMAL_FACTORS
                    ]
                    for G in _within(SHEAR_GRID, nominal.G[k], most)
                ]
                best_E = [min(((misfit(one), n, one) for n, one in enumerate(row))) for row in tried]
                least = [np.inf, *(value for value, _, _ in best_E), np.inf]
                found += [
                    (value, one)
                    for number, (value, _, one) in enumerate(best_E, 1)
                    if value <= min(least[number - 1], least[number + 1])
                ]
            begun = [one for _, one in sorted(found, key=lambda pair: pair[0])[: LIMITS.frequency_model_followed]]
        places = np.arange(len(nominal.E))
        own = (places >= first) & (places < first + joints)
        for number, so_far in enumerate(best):
            one = begun[min(number, len(begun) - 1)]
            best[number] = replace(so_far, E=np.where(own, one.E, so_far.E), G=np.where(own, one.G, so_far.G))
    return [nominal, *best] if joints else [nominal]


def _within(grid: Array, nominal: float, log_width: float) -> Array:
    """Those of a grid that are near enough to the nominal value, with it."""
    return np.sort(np.append(grid[np.abs(np.log(grid / nominal)) <= log_width], nominal))
