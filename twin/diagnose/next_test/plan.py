"""Choosing the next test: the shortest that parts the best model from its rivals, whichever of them is true."""

from collections.abc import Callable, Sequence
from pathlib import Path

from recordings.beside import temporary_folder
from recordings.errors import InputError
from recordings.run import Run
from recordings.streams import SampleSource
from twin.diagnose.answer.result import NextSensor, NextTest
from twin.diagnose.fit_problem import modification_of
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.next_test.limits import LIMITS
from twin.diagnose.next_test.predicted_data import predict_test_data
from twin.diagnose.next_test.proposal import Proposal, propose
from twin.diagnose.next_test.sensor_place import best_sensor_place
from twin.diagnose.next_test.separation import Promise, least_promise
from twin.identify.measured_data import MeasuredData
from twin.identify.time_limit import time_is_up
from twin.procedures import Procedure, save_procedure
from twin.rehearsal import NominalRig, Rehearsed, open_twin, rehearse, rehearse_until_clear
from twin.rigs import Place, Rig

PROCEDURE = "next.toml"


def plan_next_test(
    runs: Sequence[Run],
    evidence: MeasuredData,
    models: tuple[FittedModel, ...],
    extended: Rig,
    out: Path,
    *,
    report: Callable[[str], None] = lambda text: None,
) -> NextTest | None:
    """Choose a procedure that parts the best model from its close rivals, rehearse it, and write it.

    Of many proposals (:func:`~twin.diagnose.next_test.proposal.propose`), the shortest tried first and as many as the
    time allows, the shortest is taken that would part the models in nine of ten repetitions, whichever is true; where
    none would, the one that parts them farthest.

    Parameters
    ----------
    runs
        The recordings, for the forces that were used.
    models
        Those that the recordings cannot tell apart, the most probable first.
    extended
        The rig with the best model, on which the proposal is rehearsed.
    """
    best, *rivals = models
    if not rivals:
        return None
    report("looking for the test that tells the rivals apart")
    names = [model.name for model in models]
    sensor = best_sensor_place(evidence, best, rivals, margin=LIMITS.needed_log_evidence)
    ranked = _ranked(runs, evidence, best, rivals)
    if not ranked:
        return None
    for proposal, promise in ranked[: LIMITS.plan_tried]:
        report(f"rehearsing {proposal.what}")
        separates = f"separates {names[0]} from {', '.join(dict.fromkeys(names[1:]))} by {proposal.what}"
        brings = _expecting(separates, promise)
        try:
            rehearsed = _rehearsed(proposal, extended, evidence.preload)
        except (InputError, ArithmeticError) as error:
            # A law that is known badly need be no passive layer's, which could be marched in time.
            procedure, rig_time_s = proposal.procedure, proposal.rig_time_s
            told = f"not rehearsed, for {error.reason if isinstance(error, InputError) else error}"
            break
        if not rehearsed.must_not_run:
            procedure, rig_time_s = rehearsed.rehearsal.procedure, rehearsed.rehearsal.result.duration_s
            told = ", ".join(["as rehearsed", *rehearsed.remaining])
            break
    else:
        return None
    save_procedure(procedure, out / PROCEDURE)
    return NextTest(
        why=f"{brings}; {rig_time_s / 60:.0f} min on the rig, {told}",
        sensor=None if sensor is None else _sensor(evidence, *sensor),
        procedure=PROCEDURE,
        separation=promise.separation,
        needed=promise.needed,
        rig_time_s=rig_time_s,
    )


def _ranked(
    runs: Sequence[Run], evidence: MeasuredData, best: FittedModel, rivals: Sequence[FittedModel]
) -> list[tuple[Proposal, Promise]]:
    """Proposals worth rehearsing: those that suffice, the shortest first, then the others by what they promise."""
    drifting = any(
        modification.layer_drift_per_s or modification.beam_drift_per_s
        for modification in (modification_of(evidence, model.hypotheses) for model in (best, *rivals))
    )
    valued = []
    for proposal in propose(runs, evidence, best, drifting=drifting):
        if time_is_up():
            break
        data = [predict_test_data(evidence, truth, proposal) for truth in (best, *rivals)]
        valued.append((proposal, least_promise(best, rivals, data, margin=LIMITS.needed_log_evidence)))
    return sorted(valued, key=lambda one: (0.0, one[0].rig_time_s) if one[1].share >= 1 else (1.0, -one[1].share))


def _rehearsed(proposal: Proposal, extended: Rig, preload: str) -> Rehearsed:
    """The proposal on the twin with the best model, improved where its rehearsal raises warnings."""
    nominal = NominalRig.of(extended, preload=preload)

    def twin(procedure: Procedure) -> SampleSource:
        return open_twin(extended, procedure, preload=preload, seed=1, source=extended.name)

    with temporary_folder("twin-next-test") as folder:
        first = rehearse(proposal.procedure, twin(proposal.procedure), folder / "first.mcap", nominal=nominal)
        better = rehearse_until_clear(first, twin, folder / "better.mcap", rounds=LIMITS.plan_rounds)
    return better or first


def _sensor(evidence: MeasuredData, place: Place, promise: Promise) -> NextSensor:
    """The place of a further accelerometer as an answer has it."""
    told = f"one more accelerometer at {evidence.rig.layout().told(place)} and the same noise again"
    return NextSensor(
        why=_expecting(told, promise),
        part=place.part,
        at=place.at,
        direction=place.direction,
        separation=promise.separation,
        needed=promise.needed,
    )


def _expecting(test: str, promise: Promise) -> str:
    """A test with what is expected of it."""
    far = LIMITS.plan_far
    gain = f"{promise.separation:.1f}" if promise.separation < far else f"over {far:.0f}"
    enough_told = "" if promise.share >= 1 else ", so it may not be enough"
    return f"{test}: expected gain of log evidence {gain}, {promise.needed:.1f} needed{enough_told}"
