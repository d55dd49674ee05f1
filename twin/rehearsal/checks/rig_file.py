"""Implausible rig: numbers in its file that are no solid's or no beam's, so that nothing rehearsed on it holds."""

from collections.abc import Iterator

from twin.rehearsal.rehearsal import Caution, Rehearsal


def check_rig_file(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Tell what the rig's file is unlikely to mean."""
    if not rehearsal.nominal.implausible:
        return
    yield Caution(
        kind="implausible-rig", severity="warning", sweep="", index=0, frequency_Hz=0.0,
        steps=len(rehearsal.result.steps), reason="; ".join(rehearsal.nominal.implausible),
        advice="correct the rig file, in SI units; 'twin rig show' tells all that is implausible of it",
    )  # fmt: skip
