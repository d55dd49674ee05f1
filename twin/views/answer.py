"""A diagnosis in words and tables, for a text pane and for the report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.diagnose.comparison import SweepComparison
from twin.diagnose.result import Diagnosis, Estimate

__all__ = ["answer_markdown", "estimate_text", "residual_rows"]


def estimate_text(value: Estimate | str) -> str:
    """A value with its standard deviation, both to the digits that the deviation supports."""
    if isinstance(value, str):
        return value
    if not np.isfinite(value.std) or value.std <= 0:
        return f"{value.value:.4g}"
    decimals = 1 - int(np.floor(np.log10(value.std)))
    if 0 <= decimals <= 8 and abs(value.value) < 1e6:
        return f"{value.value:.{decimals}f} ± {value.std:.{decimals}f}"
    digits = max(2, decimals + int(np.floor(np.log10(max(abs(value.value), value.std)))) + 1)
    return f"{value.value:.{min(digits, 8)}g} ± {value.std:.2g}"


def residual_rows(sweeps: Sequence[SweepComparison]) -> list[tuple[str, str, float, float]]:
    """Sweep, channel, and the root-mean-square residual in standard deviations before and after."""
    return [
        (
            comparison.sweep,
            channel,
            float(np.sqrt(np.mean(comparison.residual_before[:, i] ** 2))),
            float(np.sqrt(np.mean(comparison.residual_after[:, i] ** 2))),
        )
        for comparison in sweeps
        for i, channel in enumerate(comparison.channels)
    ]


def answer_markdown(diagnosis: Diagnosis) -> str:
    """The whole answer as Markdown."""
    lines = [f"# {diagnosis.verdict}", "", diagnosis.sentence, ""]
    misfit = diagnosis.misfit
    lines += [
        "## Misfit",
        "",
        f"chi² per degree of freedom {misfit.chi2_per_dof:.3g} before, {misfit.after:.3g} after; "
        f"up to {misfit.threshold:.3g} a model is taken to agree with its data.",
        "",
    ]
    if diagnosis.gain is not None:
        gain = diagnosis.gain
        lines += ["## Gain on held-out sweeps", "", "| | rms relative error |", "|---|---|"]
        lines += [
            f"| before | {100 * gain.before:.2f} % |",
            f"| after | {100 * gain.after:.2f} % |",
            f"| noise floor | {100 * gain.noise_floor:.2f} % |",
            "",
        ]
    if diagnosis.causes:
        lines += ["## Causes", ""]
    for cause in diagnosis.causes:
        held = ", in the model" if cause.in_model else ""
        lines += [f"### {cause.cause}", "", f"probability {cause.probability:.3g}{held}", ""]
        lines += [f"- {name}: {estimate_text(value)}" for name, value in cause.parameters.items()]
        if cause.confused_with:
            lines += [f"- could be confused with {', '.join(cause.confused_with)}"]
        lines += [""]
    rows = residual_rows(diagnosis.sweeps)
    if rows:
        lines += ["## Residuals, rms in σ", "", "| sweep | channel | before | after |", "|---|---|---|---|"]
        lines += [f"| {sweep} | {channel} | {before:.3g} | {after:.3g} |" for sweep, channel, before, after in rows]
        lines += [""]
    if diagnosis.next_test is not None:
        lines += ["## Next test", "", diagnosis.next_test.why, ""]
    if diagnosis.notes:
        lines += ["## Notes", "", *(f"- {note}" for note in diagnosis.notes), ""]
    return "\n".join(lines)
