"""The report of a modal test: the modes, how they compare with the model's, and what is wrong with the test."""

from collections.abc import Sequence

from twin.identify.modes.measured_modes import MeasuredModes
from twin.views.page import Page, Picture, Section
from twin.views.style import AFTER, CAUTION
from twin.views.table import Table


def modes_table(found: MeasuredModes) -> Table:
    """Frequencies and damping ratios with their standard deviations, and how far shapes are from real ones."""
    rows = [
        (
            str(number), f"{mode.frequency_Hz:.4f}", f"{mode.frequency_std_Hz:.2g}", f"{100 * mode.damping_ratio:.4f}",
            f"{100 * mode.damping_std:.2g}", f"{mode.share:.0%}", f"{shape.phase_scatter_deg:.2g}",
        )
        for number, (mode, shape) in enumerate(zip(found.fit.modes, found.shapes, strict=True), 1)
    ]  # fmt: skip
    head = ("mode", "frequency (Hz)", "std", "damping ratio (%)", "std", "in share of orders", "phase scatter (°)")
    return Table(caption="Modes", head=head, rows=rows, numbers=range(len(head)))


def pairs_table(found: MeasuredModes) -> list[Table]:
    """Pairs of measured and modelled modes with their MAC; none without a model."""
    if found.beside is None:
        return []
    beside, Hz = found.beside, found.beside.modelled.modes.frequency_Hz
    rows = []
    for number, mode in enumerate(found.fit.modes):
        pair = beside.pairs.get(number)
        told = ("", "", "", "")
        if pair is not None:
            mac = f"{beside.mac[number, pair]:.4f}" if len(beside.places) > 1 else ""
            told = (str(pair + 1), f"{Hz[pair]:.4f}", f"{100 * (Hz[pair] / mode.frequency_Hz - 1):+.3f} %", mac)
        rows.append((str(number + 1), f"{mode.frequency_Hz:.4f}", *told))
    head = ("mode", "measured (Hz)", "of the model", "model (Hz)", "model over measured", "MAC")
    return [Table(caption="Beside the model", head=head, rows=rows, numbers=range(len(head)))]


def modes_page(found: MeasuredModes) -> Page:
    """The report."""
    from twin.views.modal_figures import nyquist_figure, responses_figure, stabilisation_figure  # with matplotlib

    wrong = Section(title="What is wrong, or was set aside", items=found.notes)
    sections = [wrong] if found.notes else []
    sections.append(Section(title="Modes", tables=[modes_table(found)]))
    if found.beside is not None:
        sections.append(Section(title="Beside the model", tables=pairs_table(found), pictures=_beside(found)))
    coherent = "" if found.coherence is None else ", and coherence"
    responses = Picture(
        draw=lambda: responses_figure(found), alt=f"Magnitude and phase of the responses{coherent} over frequency.",
        caption=f"Response per force{coherent}; the black one shows most of all modes.",
    )  # fmt: skip
    stabilisation = Picture(
        draw=lambda: stabilisation_figure(found), alt="Poles of fits of rising order, those that stay marked.",
        caption="Poles that stay where they are as the order grows are modes.",
    )  # fmt: skip
    nyquist = Picture(
        draw=lambda: nyquist_figure(found), alt="Imaginary over real part of a response about each mode.",
        caption="About each resonance a response goes round a circle; points off it are noise, or no linear mode.",
    )  # fmt: skip
    sections += [
        Section(title="Responses", texts=_windowed(found), pictures=[responses]),
        Section(title="Stabilisation", pictures=[stabilisation]),
        Section(title="Nyquist", pictures=[nyquist]),
        Section(
            title="What was assumed",
            items=[
                "The structure is linear: what a hit shows does not depend on how hard it was.",
                "Reciprocity: a response is the same with force and sensor exchanged.",
                "Standard deviations are the fit's, of noise as coherence or scatter tells it; frequencies scatter by "
                "more from one assembly of a rig to the next.",
            ],
        ),
    ]
    force = f"{found.force} to {', '.join(found.channels)}"
    return Page(
        title="Modes of a structure", answer=found.sentence, facts=f"{found.run}; {force}.", sections=sections,
        accent=CAUTION if found.notes else AFTER, files=(found.run,),
    )  # fmt: skip


def _windowed(found: MeasuredModes) -> Sequence[str]:
    if not found.rate_per_s:
        return ()
    return (
        f"Seen through an exponential window of {found.rate_per_s:.3g} 1/s: resonances are drawn that much wider; in "
        "the tables its damping is taken off.",
    )


def _beside(found: MeasuredModes) -> list[Picture]:
    assert found.beside is not None
    if len(found.beside.places) < 2 or not found.beside.pairs:
        return []
    from twin.views.modal_figures import mac_figure, shapes_figure

    return [
        Picture(
            draw=lambda: mac_figure(found),
            alt="Matrix of the modal assurance criteria of measured and modelled modes.",
            caption="Modal assurance criterion: 1 for shapes that are alike, 0 for orthogonal ones.",
        ),
        Picture(
            draw=lambda: shapes_figure(found), alt="The model's mode shapes with the measured motions at their places.",
            caption="Mode shapes of the model (lines), and measured (points), as large by least squares; in directions "
            "that were not measured points move with the model.",
        ),
    ]  # fmt: skip
