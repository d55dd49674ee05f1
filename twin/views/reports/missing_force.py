"""The picture of a force that no cause explains: its loops over the motion of its place, and where it may act."""

import numpy as np
from matplotlib.figure import Figure

from twin.diagnose.answer.result import Diagnosis
from twin.diagnose.missing import MissingForce
from twin.views.drawing import dressed, legend, panels
from twin.views.page import Picture, Section, Table
from twin.views.rig_figure import SENSOR
from twin.views.style import AFTER, BEFORE, INK, level_colour


def missing_force_figure(diagnosis: Diagnosis, force: MissingForce) -> Figure:
    """Left, the force over one period at each level; right, what the misfit is with it at each place."""
    figure, ((loops, along),) = panels(1, 2, height_in=3.6)
    theta = np.linspace(0.0, 2 * np.pi, 361)
    for i, level in enumerate(force.levels):
        A, w = level.displacement_m, 2 * np.pi * level.frequency_Hz
        u, v, a = A * np.cos(theta), -A * w * np.sin(theta), -A * w**2 * np.cos(theta)
        loops.plot(1e3 * u, force.force(u, v, a), color=level_colour(i), linewidth=1.6, label=level.sweep)
    dressed(loops, title="force over a period", xlabel="displacement of its place, mm", ylabel="force, N")
    along.axhline(force.before, color=BEFORE, linestyle=(0, (4, 2.5)), linewidth=1.2, label="without a force")
    along.semilogy(
        force.places_m, force.left, color=AFTER, marker="o", markersize=3.5, linewidth=1.4, label="with it"
    )  # fmt: skip
    layout = diagnosis.evidence.rig.layout()
    for output in diagnosis.evidence.outputs:
        at = layout.position(output.place) if layout.passable else None
        if at is not None:
            along.axvline(at, color=SENSOR, linestyle=":", linewidth=1.2, label="sensors")
    along.axvline(force.position_m.value, color=INK, linewidth=1.0)
    dressed(
        along, title="the force elsewhere", xlabel="position along the beams, m", ylabel="χ² per degree of freedom"
    )  # fmt: skip
    legend(figure)
    return figure


def missing_force_section(diagnosis: Diagnosis) -> Section | None:
    """What the data say of a force that nobody has named; None where nothing is missing or no such force was found."""
    force = diagnosis.missing_force
    if force is None:
        return None
    place = str(force.position_m)
    rows = [
        (f.term.name, f.term.formula, str(f.coefficient), f.term.unit.replace("_per_", "/").replace("_", " "))
        for f in force.terms
    ]
    terms = Table(
        caption="The simplest terms that fit; u, v and a are displacement, velocity and acceleration of the place",
        head=("term", "formula", "coefficient c", "unit"),
        rows=rows,
        numbers=(2,),
    )
    levels = Table(
        caption="Where each sweep moves the place most: largest force of a period; its fundamental ahead of the motion",
        head=("sweep", "frequency, Hz", "displacement, mm", "force, N", "ahead, degrees"),
        rows=[
            (
                level.sweep,
                f"{level.frequency_Hz:.3f}",
                f"{1e3 * level.displacement_m:.3g}",
                f"{level.force_N:.3g}",
                "none" if level.phase_deg is None else f"{level.phase_deg:.0f}",
            )
            for level in force.levels
        ],
        numbers=(1, 2, 3, 4),
    )
    caption = (
        f"Left: the force over one period of the largest motion of each sweep. Right: χ² per degree of freedom with "
        f"the same terms elsewhere, everything else refitted; the black line is the best place, {place} m."
    )
    alt = (
        f"Loops of the missing force at each level, and the misfit against its place: least, {force.after:.3g}, at "
        f"{force.position_m.value:.3g} m; {force.before:.3g} without the force."
    )
    fall = f"χ² per degree of freedom from {force.before:.3g} to {force.after:.3g}"
    if force.explains:
        text = (
            f"No cause on the list explains the data. A force {force.formula} between ground and the structure at "
            f"{place} m would bring {fall}. It is a picture of what is missing, not a cause: look for what could make "
            f"it there."
        )
    else:
        text = (
            f"No cause on the list explains the data, and no force of simple terms at any one place does either: the "
            f"best, {force.formula} at {place} m, brings {fall}. What is wrong is likely not a force to ground."
        )
    return Section(
        title="The force that is missing",
        texts=[text],
        tables=[terms, levels],
        pictures=[Picture(draw=lambda: missing_force_figure(diagnosis, force), alt=alt, caption=caption)],
    )
