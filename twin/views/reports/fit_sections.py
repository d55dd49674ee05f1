"""Parts that the reports of a diagnosis and of an identification share: what was measured beside what was fitted."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from twin.diagnose.answer.comparison import SweepComparison
from twin.identify.measured_data import MeasuredData
from twin.views.curves import Fitted
from twin.views.figures import broadband_figure, sweeps_figure
from twin.views.page import Picture, Section
from twin.views.reports.answer import residual_rows
from twin.views.rig_figure import modes_figure


def fit_facts(evidence: MeasuredData) -> str:
    """Rig, preload where there is one, and the recordings without their folders."""
    preload = f", preload {evidence.preload}" if evidence.preload else ""
    runs = ", ".join(Path(source).name for source in evidence.sources)
    return f"Rig {evidence.rig.name}{preload}; recordings {runs}"


def sweeps_picture(
    evidence: MeasuredData, sweeps: Sequence[SweepComparison], *, kinds: Sequence[str], caption: str
) -> Picture:
    """Receptances of sweeps, measured and modelled."""
    names = ", ".join(sweep.sweep for sweep in sweeps)
    peaks = "; ".join(
        f"{sweep.sweep} peaks at {sweep.frequency_Hz[int(np.argmax(np.abs(sweep.measured[:, -1])))]:.5g} Hz"
        for sweep in sweeps
    )
    return Picture(
        draw=lambda: sweeps_figure(evidence, sweeps, kinds=kinds),
        alt=f"Receptance and phase against frequency for {names}, measured and modelled. {peaks}.",
        caption=f"{caption}; amplitude of displacement per newton, and its phase.",
    )


def residuals_picture(evidence: MeasuredData, sweeps: Sequence[SweepComparison], *, kinds: Sequence[str]) -> Picture:
    """Residuals of all sweeps."""
    sizes = "; ".join(
        f"{sweep} {channel}: " + (f"{after:.3g}" if len(kinds) == 1 else f"{before:.3g} before, {after:.3g} after")
        for sweep, channel, before, after in residual_rows(sweeps)
    )
    return Picture(
        draw=lambda: sweeps_figure(evidence, sweeps, kinds=kinds, residuals=True),
        alt=f"Residuals in standard deviations against frequency, by channel and sweep. Root mean square: {sizes}.",
        caption="Residuals of the fundamental in standard deviations of the measurement's noise alone. Close to a "
        "sharp resonance a shift of a thousandth of a hertz already shows here; chi² also allows for such errors "
        "of the model.",
    )


def broadband_section(evidence: MeasuredData, models: Mapping[str, Fitted]) -> Section | None:
    """Broadband responses, measured and by the models; nothing without any."""
    pictures = [
        Picture(
            draw=lambda i=i: broadband_figure(evidence, models, i),  # type: ignore[misc]
            alt=f"Broadband responses of {', '.join(data.channels)} from {data.frequency_Hz[0]:.0f} to "
            f"{data.frequency_Hz[-1]:.0f} Hz, logarithmic, measured and modelled, with relative errors below.",
            caption=f"Broadband run {Path(data.run).name}: responses per force, and relative errors of what is "
            "modelled beside one standard deviation of the measurement.",
        )
        for i, data in enumerate(evidence.broadband)
    ]
    return Section(title="Broadband responses", pictures=pictures) if pictures else None


def modes_picture(evidence: MeasuredData, model: Fitted, *, caption: str) -> Picture:
    """Mode shapes of the fitted structure."""
    return Picture(
        draw=lambda: modes_figure(evidence, model),
        alt="The parts in the first modes, over where they are at rest, with the sensors marked.",
        caption=caption,
    )


def assumed_of_rig(evidence: MeasuredData) -> list[str]:
    """What every fit assumes: the rig file, the layer, the force and the noise."""
    rig, layout = evidence.rig, evidence.rig.layout()
    places = ", ".join(f"{o.channel} at {layout.told(o.place)}" for o in evidence.outputs)
    acted = sorted({*evidence.steps.drive.tolist(), *(data.drive for data in evidence.broadband)}) or [0]
    driven = " and ".join(layout.told([*rig.drives.values()][number]) for number in acted)
    effects = ", ".join(effect.cause for effect in rig.effect)
    return [
        f"The rig file: {rig.sentence}, driven at {driven}; {places}."
        + (f" Its effects act: {effects}." if effects else ""),
        *(
            f"{'The joint' if len(rig.joints) == 1 else joint.name} is a thin layer of {joint.layer_elements} "
            "elements. Each has the moduli E′ − s(o) and G′ + j l(q), smooth functions of its own amplitudes of "
            "opening o and slip q."
            for joint in rig.joints
        ),
        "The force is what the force cell reads; steps that were still changing were left out.",
        "The noise is estimated from the recordings themselves, and is Gaussian.",
    ]
