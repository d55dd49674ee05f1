"""A modal test, of hits or of noise: modes, shapes, and how they compare with a rig's."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from recordings.errors import InputError, blamed_on
from recordings.quantities import is_motion, quantity
from recordings.run import Run
from twin.identify.impacts import Reduction, reduce_hits, sound_hits
from twin.identify.impacts.modes import modes_of_impacts
from twin.identify.limits import LIMITS
from twin.identify.measured_data import common_preload
from twin.identify.modes import ModalFit
from twin.identify.modes.beside_model import beside_model, missing_and_still
from twin.identify.modes.from_record import modes_of_record
from twin.identify.modes.measured_modes import MeasuredModes
from twin.identify.modes.shapes import Shape, shape_of
from twin.identify.rig_channels import drive_of
from twin.identify.spectra.spectrum import broadband_records, is_impact_test
from twin.lab.shown import Reported
from twin.procedures import Impact, parse_procedure
from twin.rigs import Place, Rig
from twin.structure.modelled_rig import modelled_rig
from twin.views.page import Page
from twin.views.reports.modes import modes_page, modes_table, pairs_table
from twin.views.table import Table

Band = tuple[float, float]


@dataclass(frozen=True, repr=False, eq=False)
class ModalTest(Reported):
    """Modes of a recording, to print and to report."""

    found: MeasuredModes

    @property
    def sentence(self) -> str:
        """How many modes, and how well they are the model's."""
        return self.found.sentence

    def tables(self) -> Sequence[Table]:
        """The modes, and the pairs with the model's."""
        return [modes_table(self.found), *pairs_table(self.found)]

    def page(self) -> Page:
        """The report."""
        return modes_page(self.found)

    def to_dict(self) -> dict[str, Any]:
        """As the command prints it with ``--json``."""
        found, beside = self.found, self.found.beside
        modes = [
            {
                "frequency_Hz": {"value": mode.frequency_Hz, "std": mode.frequency_std_Hz},
                "damping_ratio": {"value": mode.damping_ratio, "std": mode.damping_std},
                "residues": {o: [r.real, r.imag] for o, r in zip(found.outputs, mode.residues.tolist(), strict=True)},
                "share_of_orders": mode.share,
                "shape": {p: [v.real, v.imag] for p, v in zip(found.places, shape.values.tolist(), strict=True)},
                "phase_scatter_deg": shape.phase_scatter_deg,
            }
            for mode, shape in zip(found.fit.modes, found.shapes, strict=True)
        ]
        table: dict[str, Any] = {
            "run": found.run, "force": found.force, "channels": list(found.channels), "modes": modes,
            "chi2_per_dof": found.fit.chi2_per_dof, "lines": len(found.frequency_Hz), "notes": list(found.notes),
        }  # fmt: skip
        if beside is not None:
            alone, Hz = len(beside.places) < 2, beside.modelled.modes.frequency_Hz
            table["pairs"] = [
                {"mode": r + 1, "model_mode": m + 1, "model_Hz": Hz[m], "mac": None if alone else beside.mac[r, m]}
                for r, m in sorted(beside.pairs.items())
            ]
        return table


def modal_test(
    run: Run, *, force: str | None = None, band_Hz: Band | None = None, rig: Rig | None = None,
    reduction: Reduction | None = None,
) -> ModalTest:  # fmt: skip
    """The modes of an impact test, or of the first broadband stretch of a run.

    Parameters
    ----------
    force
        Its channel; the only one if not given.
    band_Hz
        Where to look; what the force excites if not given.
    rig
        Whose modes they are compared with.
    reduction
        Of an impact test.

    Raises
    ------
    InputError
        If the run has no such channels, nothing to fit, or no mode.
    """
    forces = [name for name, channel in run.channels.items() if channel.quantity == "force"]
    if force is None and len(forces) != 1:
        raise InputError(run.path, "channels", f"holds {len(forces)} force channels", "name one with --force")
    force = force or forces[0]
    if force not in run.channels:
        raise InputError(run.path, f"channel {force}", "not recorded", f"it has {', '.join(run.channels)}")
    channels = tuple(n for n, c in run.channels.items() if is_motion(c.quantity) and n != force)
    if not channels:
        raise InputError(run.path, "channels", "holds no acceleration, velocity or displacement")
    rig = None if rig is None else rig.driven_by(drive_of(run, rig))
    with blamed_on(run.path):
        if is_impact_test(run):
            return ModalTest(_of_hits(run, force, channels, band_Hz, rig, reduction or Reduction()))
        if reduction is not None:
            raise InputError(run.path, "", "is no impact test", "leave the estimator and the windows out")
        return ModalTest(_of_noise(run, force, channels, band_Hz, rig))


def _of_noise(run: Run, force: str, channels: tuple[str, ...], band_Hz: Band | None, rig: Rig | None) -> MeasuredModes:
    records = broadband_records(run, channels=[force, *channels])
    if not records:
        raise InputError(run.path, "/procedure", "holds no broadband stretch", "run a procedure of kind random")
    fit, made = modes_of_record(records[0], force=force, channels=channels, band_Hz=band_Hz)
    found = MeasuredModes(
        run=run.path, force=force, channels=channels, places=channels, fit=fit,
        frequency_Hz=made.frequency_Hz, H=made.H, outputs=channels,
        shapes=_shapes(run, fit, channels, roving=False),
    )  # fmt: skip
    if rig is None:
        return found
    sensors = _sensors(run, rig, channels)
    return _beside(found, run, rig, sensors, {"the drive": rig.drive_place, **sensors})


def _of_hits(
    run: Run, force: str, channels: tuple[str, ...], band_Hz: Band | None, rig: Rig | None, reduction: Reduction
) -> MeasuredModes:
    from twin.rehearsal.hammer import point_places  # whose bench numba takes a while to load

    procedure = parse_procedure(run.attachments["procedure.toml"], source=run.path)
    assert isinstance(procedure, Impact)
    if procedure.sensor is not None:
        channels = (procedure.sensor,)
    hit = reduce_hits(sound_hits(run, force=force, channels=channels), reduction, band_Hz=band_Hz)
    fit, lines, notes = modes_of_impacts(hit)
    roving = bool(procedure.point)
    H, coherence = (each.reshape(len(each), -1)[lines] for each in (hit.H, hit.coherence))
    found = MeasuredModes(
        run=run.path, force=force, channels=channels, places=hit.points if roving else channels, fit=fit,
        frequency_Hz=hit.frequency_Hz[lines], H=H, coherence=coherence, rate_per_s=hit.rate_per_s,
        outputs=tuple(f"{name} / {point}" for point in hit.points for name in channels),
        shapes=_shapes(run, fit, channels, roving=roving), notes=(*hit.notes, *notes),
    )  # fmt: skip
    if rig is None:
        return found
    sensors = _sensors(run, rig, channels)
    fixed = {"the hammer's place": rig.drive_place} if procedure.sensor is not None else sensors
    places = {name: place for name, place in point_places(procedure).items() if name in hit.points}
    with blamed_on(run.path, "procedure.toml", "is it the rig of this test?"):
        hung = [rig.hit_at(place) for place in (*places.values(), rig.drive_place)].pop()
    if procedure.sensor is not None:
        found = replace(found, notes=(*found.notes, *_loaded(run, hung, procedure.sensor, [*places.values()])))
    return _beside(found, run, hung, places or sensors, fixed)


def _loaded(run: Run, rig: Rig, sensor: str, places: Sequence[Place]) -> Iterator[str]:
    """What the mass of an accelerometer does to the natural frequencies as it roves, by the model."""
    preload = common_preload([run], rig) or None
    moved = [modelled_rig(rig.with_moved_sensor(sensor, place), preload=preload) for place in places]
    Hz = np.array([each.modes.frequency_Hz[: LIMITS.damped_modes] for each in moved])
    spread = float(np.max(np.ptp(Hz, axis=0) / np.mean(Hz, axis=0)))
    if spread > LIMITS.loaded:
        mass_g = 1e3 * next(each.mass for each in rig.sensor if each.channel == sensor)
        yield (
            f"{sensor}, {mass_g:.3g} g, moves natural frequencies by up to {spread:.2%} as it roves: modes split and "
            "shapes are no one structure's; rove the hammer, or put a dummy of its mass at all other points"
        )


def _sensors(run: Run, rig: Rig, channels: Sequence[str]) -> dict[str, Place]:
    known = {sensor.channel for sensor in rig.response_sensors}
    for name in channels:
        if name not in known:
            has = f"it has {', '.join(sorted(known))}"
            raise InputError(run.path, f"channel {name}", f"is no sensor of the rig {rig.name}", has)
    return {name: rig.place_of(name) for name in channels}


def _shapes(run: Run, fit: ModalFit, channels: Sequence[str], *, roving: bool) -> tuple[Shape, ...]:
    """Shapes of displacement at the points that rove, or at the channels where none does."""
    orders = np.array([quantity(run.channels[name].quantity).derivative for name in channels])
    found = []
    for mode in fit.modes:
        residues = mode.residues.reshape(-1, len(channels)) / mode.pole**orders
        found.append(shape_of(residues if roving else residues.T))
    return tuple(found)


def _beside(
    found: MeasuredModes, run: Run, rig: Rig, places: Mapping[str, Place], fixed: Mapping[str, Place]
) -> MeasuredModes:
    """The same beside a rig's modes."""
    modelled = modelled_rig(rig, preload=common_preload([run], rig) or None)
    Hz = np.array([mode.frequency_Hz for mode in found.fit.modes])
    shapes = np.stack([shape.values for shape in found.shapes], axis=1)
    band = float(found.frequency_Hz[0]), float(found.frequency_Hz[-1])
    beside = beside_model(modelled, [*places.values()], Hz, shapes, highest_Hz=band[1])
    told = missing_and_still(beside, band, fixed, found.places)
    return replace(found, beside=beside, notes=(*found.notes, *told))
