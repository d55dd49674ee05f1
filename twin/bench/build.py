"""From a plan to the reduced rig: matrices, local coordinates, condensation, poles at any time of a drift."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from scipy.sparse import csr_array

from recordings.quantities import is_response, quantity
from twin.arrays import Array
from twin.bench.force_factor import ForceFactor
from twin.bench.instruments import InstrumentChannel
from twin.bench.layer import JointLaw, law_by_name, law_from_table, no_law, steel_law
from twin.bench.limits import LIMITS
from twin.bench.linear import Inputs, LinearRig, Poles, ReadOff, linear_rig, to_poles, with_resonance
from twin.bench.marching import Elements
from twin.bench.plan import Element, JointPlan, Matrices, Plan
from twin.bench.reduction import Condensed, ModalModel, condense, with_layers
from twin.bench.shaker import COORDINATES, ShakerModel
from twin.joint import Law, PiecewiseLinearContact, RunningLoss
from twin.rigs import LawOfRig, NamedLaws, Place
from twin.structure import assemble, layer_points, normal_modes, rigid_motions
from twin.structure.law_table import layer_table
from twin.structure.modes import MOST_RIGID
from twin.structure.sparse import handy


@dataclass(frozen=True, eq=False)
class Built:
    """The reduced rig."""

    plan: Plan
    condensed: Condensed
    """Structure in r coordinates."""
    laws: tuple[JointLaw, ...]
    rigid: int
    """Number of motions that only a soft suspension holds."""
    elements_: tuple[Element, ...]
    """Nonlinear elements, the joint's first, on condensed rows."""
    coordinate: Array
    auxiliary: Array
    """Local coordinate of each element, and its auxiliary row or -1."""
    rows: tuple[tuple[Array, bool], ...]
    """Distinct local coordinates of the structure: condensed row, and whether it is a velocity."""
    shaker_laws: tuple[tuple[str, PiecewiseLinearContact | ForceFactor], ...]
    """Coordinate and law of each of the shaker's limits and of its force factor."""
    shaker_rows: tuple[str, ...]
    """Distinct local coordinates of the shaker, numbered after the structure's."""
    auxiliary_rows: tuple[Array, ...]
    """Displacements that velocity laws read."""
    drive_row: Array
    drive_load: Array
    channel_rows: tuple[Array | None, ...]
    shaker: ShakerModel | None

    @property
    def locals(self) -> int:
        """Number of local coordinates."""
        return len(self.rows) + len(self.shaker_rows)

    @property
    def auxiliaries(self) -> int:
        """Number of auxiliary rows."""
        return len(self.auxiliary_rows)

    @property
    def common_size(self) -> int:
        """Length of the state that does not depend on how many modes are kept."""
        return 2 * self.condensed.T.shape[1] + self._others

    def moduli(self, time_s: float) -> tuple[tuple[float, ...], float]:
        """(E' of each joint over its start, all moduli over theirs) after a drift of `time_s`."""
        layers = tuple(max(0.05, 1.0 - joint.rate_per_s * time_s) for joint in self.plan.joints)
        return layers, max(0.05, 1.0 - self.plan.moduli_rate_per_s * time_s)

    def modal(self, time_s: float, internal_rate_Hz: float) -> ModalModel:
        """Kept modes at a time."""
        layers, everything = self.moduli(time_s)
        below = min(LIMITS.modes_below_Hz, LIMITS.build_resolved * internal_rate_Hz)
        E = [left * joint.E for left, joint in zip(layers, self.plan.joints, strict=True)]
        return self.condensed.modes(E, [joint.G for joint in self.plan.joints], below_Hz=below, factor=everything)

    @property
    def differentiable(self) -> Array:
        """Which channels are plain accelerations, that may be had from velocities."""
        instruments = self.plan.instruments.values()
        return np.array([_form(i) == "acceleration" and not i.resonances for i in instruments])

    def rig(self, time_s: float, internal_rate_Hz: float, *, velocities: bool = False) -> LinearRig:
        """Linear rig; outputs are local coordinates, auxiliary rows, channels.

        `velocities` gives these in place of the :attr:`differentiable` channels' accelerations.
        """
        modal = self.modal(time_s, internal_rate_Hz)
        ratios = self.plan.rig.damping.modal_ratio
        elastic = range(len(modal.omega) - self.rigid)
        zeta = np.array([LIMITS.suspension_damping] * self.rigid + [ratios[min(r, len(ratios) - 1)] for r in elastic])
        dampers = modal.Phi.T @ self.condensed.C @ modal.Phi
        outputs = [ReadOff("rate" if velocity else "displacement", row) for row, velocity in self.rows]
        outputs += [ReadOff(name) for name in self.shaker_rows]  # type: ignore[arg-type]
        outputs += [ReadOff("integral", row) for row in self.auxiliary_rows]
        instruments = list(self.plan.instruments.values())
        as_velocity = self.differentiable & velocities
        for i, row, slow in zip(instruments, self.channel_rows, as_velocity, strict=True):
            outputs.append(ReadOff("velocity" if slow else _form(i), row, static=True))  # type: ignore[arg-type]
        rig = linear_rig(
            modal,
            Inputs(self.drive_row, self.drive_load, [row for row, _ in self.rows], self.shaker_rows),
            outputs,
            damping=np.diag(2 * zeta * modal.omega) + dampers,
            shaker=self.shaker,
            cell_mass=self.plan.rig.force_sensor.stinger_side_mass if self.shaker else 0.0,
        )
        for n, instrument in enumerate(instruments):
            for frequency_Hz, ratio in instrument.resonances:
                n_out = self.locals + self.auxiliaries + n
                rig = with_resonance(rig, n_out, frequency_Hz=frequency_Hz, damping_ratio=ratio)
        return rig

    def poles(self, time_s: float, internal_rate_Hz: float, *, velocities: bool = False) -> Poles:
        """The same, diagonal."""
        return to_poles(self.rig(time_s, internal_rate_Hz, velocities=velocities))

    def to_common(self, states: Array, time_s: float, internal_rate_Hz: float) -> Array:
        """States of the rig at a time as condensed coordinates."""
        Phi = self.modal(time_s, internal_rate_Hz).Phi
        m = Phi.shape[1]
        return np.concatenate([Phi @ states[:m], Phi @ states[m : 2 * m], states[2 * m :]])

    def from_common(self, common: Array, time_s: float, internal_rate_Hz: float) -> Array:
        """The other way."""
        Phi = self.modal(time_s, internal_rate_Hz).Phi
        r = len(Phi)
        return np.concatenate([Phi.T @ common[:r], Phi.T @ common[r : 2 * r], common[2 * r :]])

    def scales(self, time_s: float) -> Array:
        """Scale of each element's force at a time."""
        layers, everything = self.moduli(time_s)
        left = {"": 1.0, "all": everything}
        own = [
            element.scale * (layers[element.joint] * everything if element.follows == "E" else left[element.follows])
            for element in self.elements_
        ]
        return np.array(own + [1.0] * len(self.shaker_laws))

    def elements(self) -> Elements:
        """Elements as the kernels want them, at rest."""
        laws = [*(element.law for element in self.elements_), *(law for _, law in self.shaker_laws)]
        numbers = [self._parameters(law) for law in laws]
        depth = max((law.states for law in laws), default=0)
        parameters = np.zeros((len(laws), max(map(len, numbers), default=1)))
        for row, values in zip(parameters, numbers, strict=True):
            row[: len(values)] = values
        return Elements(
            np.array([law.kind for law in laws], np.int64),
            self.coordinate,
            self.auxiliary,
            self.scales(0.0),
            parameters,
            np.zeros((len(laws), max(depth, 1))),
        )

    def _parameters(self, law: Law | ForceFactor) -> Sequence[float] | Array:
        """Numbers of a law for the kernels."""
        if isinstance(law, ForceFactor):
            return law.parameters_at(self._place("stroke"), self._place(law.turns))
        return law.parameters

    def _place(self, name: str) -> int:
        """Number of a shaker's local coordinate."""
        return len(self.rows) + self.shaker_rows.index(name)

    @property
    def _others(self) -> int:
        resonances = sum(len(i.resonances) for i in self.plan.instruments.values())
        followers = sum(velocity for _, velocity in self.rows)
        if self.rows:
            followers += 2 * sum(_form(i) in ("velocity", "acceleration") for i in self.plan.instruments.values())
        return followers + (3 if self.shaker else 0) + 2 * resonances


def _form(instrument: InstrumentChannel) -> str:
    """What the linear rig reads for it: the derivative of its row's motion, or a quantity of the shaker."""
    if not is_response(instrument.reads):
        return instrument.reads
    return ("displacement", "velocity", "acceleration")[quantity(instrument.reads).derivative]


def build(plan: Plan, *, drive: Literal["shaker", "force"]) -> Built:
    """Assemble, condense and place the local coordinates of `plan`."""
    rig = plan.rig
    matrices, rigid = altered_matrices(plan)
    if drive == "shaker" and rig.force_sensor.stinger_side_mass:
        matrices.add_mass(plan.drive_place, rig.force_sensor.stinger_side_mass)
    laws = tuple(_law(plan, number) for number in range(len(plan.joints)))
    elements = [
        element
        for number, (joint, law) in enumerate(zip(plan.joints, laws, strict=True))
        for element in _layer_elements(plan, matrices, number, joint, law)
    ]
    for make in plan.element_makers:
        elements.extend(make(matrices))
    drive_row = matrices.row(plan.drive_place)
    drive_load = drive_row.copy()
    if plan.base_receptance:
        translation = matrices.pad(matrices.structure.rigid_translation(plan.drive_place.direction))
        drive_load = drive_load + plan.base_receptance * (matrices.K0 @ translation)
    responses = {sensor.channel for sensor in rig.response_sensors}
    channel_rows = [
        _seen(matrices, rig.place_of(name), i) if name in responses else None for name, i in plan.instruments.items()
    ]
    loads = [e.row for e in elements] + [drive_row, drive_load] + [row for row in channel_rows if row is not None]
    loads += [matrices.pad(row) for row in matrices.structure.B_C]
    condensed = condense(
        matrices, E=[joint.E for joint in plan.joints], G=[joint.G for joint in plan.joints], loads=loads
    )
    T = condensed.T
    numbered = _Numbered()
    for element in elements:
        numbered.add(element.row @ T, element.velocity)
    shaker = ShakerModel(rig.shaker) if drive == "shaker" else None
    shaker_laws = tuple(shaker.laws()) if shaker else ()
    asked = {name for name, law in shaker_laws} | {law.turns for _, law in shaker_laws if isinstance(law, ForceFactor)}
    shaker_rows = tuple(name for name in COORDINATES if name in asked)
    place = np.array(numbered.auxiliary + [-1] * len(shaker_laws), np.int64)
    return Built(
        plan=plan,
        condensed=condensed,
        laws=laws,
        rigid=rigid,
        elements_=tuple(elements),
        coordinate=np.array(
            numbered.coordinate + [len(numbered.rows) + shaker_rows.index(name) for name, _ in shaker_laws], np.int64
        ),
        auxiliary=np.where(place >= 0, place + len(numbered.rows) + len(shaker_rows), -1),
        rows=tuple(numbered.rows),
        shaker_laws=shaker_laws,
        shaker_rows=shaker_rows,
        auxiliary_rows=tuple(numbered.auxiliary_rows),
        drive_row=drive_row @ T,
        drive_load=drive_load @ T,
        channel_rows=tuple(None if row is None else row @ T for row in channel_rows),
        shaker=shaker,
    )


def altered_matrices(plan: Plan) -> tuple[Matrices, int]:
    """Assemble, let the effects change the matrices, and hang up what nothing holds; number of its rigid motions."""
    structure = assemble(plan.rig, layout=plan.layout)
    for number, joint in enumerate(plan.joints):
        if joint.gradient:
            structure = structure.with_gradient(joint.gradient, joint=number)
    layers, dampers = [joint.sparse for joint in structure.joints], csr_array(structure.B_C)
    matrices = Matrices(
        handy(structure.sparse_M), handy(structure.sparse_K0), [handy(normal) for normal, _ in layers],
        [handy(shear) for _, shear in layers], handy(csr_array(dampers.T @ dampers)), structure,
    )  # fmt: skip
    for change in plan.matrix_changes:
        change(matrices)
    K = with_layers(
        matrices.K0, matrices.K_E, matrices.K_G, [joint.E for joint in plan.joints], [joint.G for joint in plan.joints]
    )
    modes = normal_modes(matrices.M, K, MOST_RIGID + 1 + len(plan.frequency_errors))
    rigid = rigid_motions(modes.omega)
    held = matrices.M @ modes.Phi
    added = np.zeros(len(modes.omega))
    added[:rigid] = (2 * np.pi * LIMITS.build_suspension_Hz) ** 2
    off = modes.omega[rigid:][: len(plan.frequency_errors)]
    added[rigid : rigid + len(off)] = 2 * off**2 * plan.frequency_errors[: len(off)]
    if added.any():
        matrices.K0 = np.asarray(matrices.K0 + held @ (added[:, None] * held.T))
    return matrices, rigid


def _layer_elements(plan: Plan, matrices: Matrices, number: int, joint: JointPlan, law: JointLaw) -> list[Element]:
    """What a joint's law and its sliders do at the points of its layer."""
    points = layer_points(matrices.structure, plan.rig.joints[number].layer_elements, joint=number)
    openings, slips = ([matrices.pad(row) for row in rows] for rows in (points.opening, points.slip))
    acting = (
        ((law.normal,), openings, points.opening_weight, "E"),
        ((law.loss,) if law.loss else (), slips, points.slip_weight, "all"),
        (law.opening, openings, points.opening_weight, "E"),
        (law.slip, slips, points.slip_weight, "all"),
    )
    elements = [
        Element(row, one, weight, velocity=isinstance(one, RunningLoss), follows=follows, joint=number)
        for laws, rows, weights, follows in acting
        for one in laws
        for row, weight in zip(rows, weights, strict=True)
    ]
    return elements + [Element(slips[point], slider, joint=number) for point, slider in joint.sliders]


def _seen(matrices: Matrices, place: Place, instrument: InstrumentChannel) -> Array:
    """Row of the motion a transducer shows: the displacement, and a share of the left surface's motion along a beam."""
    row = matrices.row(place)
    if instrument.transverse:
        row = row + instrument.transverse * matrices.pad(matrices.structure.surface_motion(place, side=1))
    return row


def _law(plan: Plan, number: int) -> JointLaw:
    """The law in force: the caller's, or the rig file's, with the effects' changes."""
    joint, filed = plan.joints[number], plan.rig.joints[number].law
    if joint.law is not None:
        law = joint.law
    elif isinstance(filed, NamedLaws):
        law = law_by_name(filed, E=joint.E, G=joint.G)
    elif isinstance(filed, LawOfRig):
        law = steel_law(joint.E)
    else:
        table = layer_table(plan.rig, E=joint.E, G=joint.G, joint=number)
        law = no_law() if table is None else law_from_table(table, E=joint.E)
    for change in joint.law_changes:
        law = change(law, joint.E)
    return law


@dataclass
class _Numbered:
    """The distinct local coordinates of elements, their numbers, and what velocity laws read beside."""

    rows: list[tuple[Array, bool]] = field(default_factory=list)
    coordinate: list[int] = field(default_factory=list)
    auxiliary_rows: list[Array] = field(default_factory=list)
    auxiliary: list[int] = field(default_factory=list)

    def add(self, row: Array, velocity: bool) -> None:
        """Number the coordinate of an element, and its auxiliary row or -1."""
        alike = (
            n for n, (other, moves) in enumerate(self.rows)
            if moves == velocity and np.allclose(other, row, rtol=1e-12, atol=0.0)
        )  # fmt: skip
        number = next(alike, len(self.rows))
        if number == len(self.rows):
            self.rows.append((row, velocity))
        self.coordinate.append(number)
        self.auxiliary.append(len(self.auxiliary_rows) if velocity else -1)
        if velocity:
            self.auxiliary_rows.append(self.rows[number][0])
