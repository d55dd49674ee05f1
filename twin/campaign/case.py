"""One blind case: a rig with something hidden in it is recorded, and diagnosed from the recordings alone."""

from __future__ import annotations

import math
import time
import zlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from recordings import RunWriter, read_run
from recordings.beside import temporary_folder
from twin.bench import HiddenCase, draw_case
from twin.demo import BROADBAND, broadband, planned_sweeps, recording_names, resonance
from twin.diagnose import DiagnosisOptions, diagnose
from twin.diagnose.models import CAUSES, DRIFTS
from twin.procedures import DirectAcquisition, Procedure, load_procedure, run_procedure
from twin.rigs import Rig, preload_name, preload_record

NEXT = "next.mcap"
"""Recording of the test that an ambiguous diagnosis proposed."""
Diagnosed = Callable[..., dict[str, Any]]
"""A diagnosis of a case's recordings: which causes it may name, and its options."""


@dataclass(frozen=True)
class CasePlan:
    """What is to be hidden: nothing, one cause, or several at once; and about how many modes is swept."""

    seed: int
    causes: tuple[str, ...]
    strength: float = 1.0
    modes: int = 1

    @property
    def label(self) -> str:
        """The causes in one word; ``none`` for a clean rig."""
        return "+".join(self.causes) or "none"

    @property
    def name(self) -> str:
        """A name for files, one for each case."""
        return f"{self.label}-{self.strength:g}-{self.seed}" + (f"-modes{self.modes}" if self.modes > 1 else "")

    @property
    def learnt(self) -> tuple[str, ...]:
        """Names of the recordings that are diagnosed."""
        return (BROADBAND, *(recording_names(mode)[0] for mode in range(1, self.modes + 1)))

    @property
    def held_out(self) -> tuple[str, ...]:
        """Names of the recordings of sweeps that no diagnosis sees."""
        return tuple(recording_names(mode)[1] for mode in range(1, self.modes + 1))


@dataclass(frozen=True, kw_only=True)
class CaseResult:
    """What was hidden and what was found."""

    plan: CasePlan
    rig: str
    hidden: list[dict[str, Any]]
    """``cause`` and ``parameters`` of each hidden effect."""
    found: dict[str, Any] | None
    """The diagnosis, as the contract's ``result.json``; None where it failed."""
    followed: dict[str, Any] | None = None
    """Where the first diagnosis was ambiguous: the one with a recording of the test that it proposed, of the same
    rig."""
    oracle_after: float | None = None
    """Error on the held-out sweep of a diagnosis that may name the hidden causes only; None where they have no model or
    the diagnosis failed."""
    aborted: list[str]
    overloaded: tuple[str, ...] = ()
    """Channels whose converter counted samples on its limit: their clipping is true, hidden or not."""
    recording_s: float
    error: str = ""

    @property
    def named(self) -> list[dict[str, Any]]:
        """Causes in the diagnosis' model, the most probable first, but for an overload that the converter counted."""
        return [
            cause for cause in in_model(self.found)
            if cause["cause"] != "clipping" or "clipping" in self.plan.causes
            or cause["parameters"]["channel"] not in self.overloaded
        ]  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """For JSON; :meth:`from_dict` is the way back."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> CaseResult:
        """From :meth:`to_dict`."""
        plan = CasePlan(**data["plan"] | {"causes": tuple(data["plan"]["causes"])})
        return cls(**(data | {"plan": plan, "overloaded": tuple(data.get("overloaded", ()))}))


def record_case(plan: CasePlan, rig: Rig, folder: Path) -> tuple[HiddenCase, list[str]]:
    """Hide what the plan says and record it, see :func:`record_hidden`: the truth, and recordings that ended early.

    The plan's seed decides sizes, places, noise, and what is unknown of the rig anyway.
    """
    names = list(plan.causes) or ["none"]
    rng = np.random.default_rng([plan.seed, zlib.crc32(plan.label.encode())])
    case = draw_case(rng, rig=rig, causes=names, number=len(names), strength=plan.strength)
    waits_too = bool(set(plan.causes) & set(DRIFTS))
    return case, record_hidden(case, rig, folder, rng=rng, waits_too=waits_too, modes=plan.modes)


def record_hidden(
    case: HiddenCase, rig: Rig, folder: Path, *, rng: np.random.Generator, waits_too: bool = False, modes: int = 1
) -> list[str]:
    """Record the demonstration's runs of a rig, sample by sample through sensors and converter.

    Parameters
    ----------
    folder
        Gets the recordings, three with one mode, in place of those that an interrupted campaign may have left there.
    waits_too
        Store the waits between steps as well.

    Returns
    -------
    list of str
        Recordings that ended early: a joint that slaps hard may rattle at the largest force until a guard ends it.
    """
    aborted = []

    def record(name: str, procedure: Procedure) -> Path:
        if waits_too:
            procedure = procedure.model_copy(update={"store": "all"})
        if not _recorded(case, rig, folder / name, procedure, rng=rng):
            aborted.append(name)
        return folder / name

    noise = read_run(record(BROADBAND, broadband()))
    for mode in range(1, modes + 1):
        found_Hz = resonance(noise, rig, mode=mode)
        for name, procedure in planned_sweeps(rig, found_Hz, mode).items():
            record(name, procedure)
    return aborted


def _recorded(case: HiddenCase, rig: Rig, path: Path, procedure: Procedure, *, rng: np.random.Generator) -> bool:
    """Record one procedure; whether it came to its end."""
    acquisition = DirectAcquisition(case.open_bench(seed=int(rng.integers(2**31))))
    info = {"source": "simulated", "rig": rig.name, "procedure": procedure.procedure, "stored": procedure.store}
    info |= preload_record(preload_name(rig))
    with RunWriter(path, info=info, channels=acquisition.channels, overwrite=True) as writer:
        try:
            return run_procedure(procedure, acquisition, writer).state == "done"
        except ArithmeticError:
            # Driven beyond what its law has an answer for, a soft joint falls apart; what came before is recorded.
            return False


def run_case(plan: CasePlan, rig: Rig, keep: Path | None = None, *, time_limit_s: float = math.inf) -> CaseResult:
    """Record and diagnose one case; whatever goes wrong is in the result, so that a campaign goes on.

    Parameters
    ----------
    rig
        As it is assumed, which with the recordings is all that the diagnosis sees.
    keep
        Folder for the recordings; without it they vanish.
    time_limit_s
        After which the search of each diagnosis ends where it is.
    """
    with temporary_folder("twin-campaign") as temporary:
        folder = keep or temporary
        folder.mkdir(parents=True, exist_ok=True)
        diagnosed = partial(_diagnosed, plan, folder, rig, time_limit_s)
        started = time.perf_counter()
        result = CaseResult(plan=plan, rig=rig.name, hidden=[], found=None, aborted=[], recording_s=0.0)
        try:
            case, aborted = record_case(plan, rig, folder)
            result = replace(result, aborted=aborted, recording_s=time.perf_counter() - started)
            hidden = [{"cause": effect.cause, "parameters": dict(effect.parameters)} for effect in case.effects]
            result = replace(result, overloaded=_overloaded(plan, folder), hidden=hidden)
            found = diagnosed(list(CAUSES), out=folder)
            result = replace(result, found=found)
            result = replace(result, followed=_followed(diagnosed, plan, case, found, folder, rig))
            result = replace(result, oracle_after=_oracle(diagnosed, plan, found))
        except Exception as problem:
            result = replace(result, error=f"{type(problem).__name__}: {problem}")
    return result


def _overloaded(plan: CasePlan, folder: Path) -> tuple[str, ...]:
    runs = [read_run(folder / name) for name in plan.learnt]
    counts = [(channel, n) for run in runs for device in run.devices.values() for channel, n in device.overload.items()]
    return tuple(sorted({channel for channel, n in counts if n}))


def _diagnosed(
    plan: CasePlan, folder: Path, rig: Rig, time_limit_s: float, may_name: list[str], *, more: Sequence[str] = (),
    out: Path | None = None,
) -> dict[str, Any]:  # fmt: skip
    learn, held_out = ([read_run(folder / name) for name in names] for names in ((*plan.learnt, *more), plan.held_out))
    causes = {name: CAUSES[name] for name in may_name}
    options = DiagnosisOptions(causes=causes, time_limit_s=time_limit_s)
    return diagnose(learn, rig, held_out=held_out, out=out, options=options).to_dict()


def _followed(
    diagnosed: Diagnosed, plan: CasePlan, case: HiddenCase, found: dict[str, Any], folder: Path, rig: Rig
) -> dict[str, Any] | None:
    """The diagnosis with the test that an ambiguous one proposed, run on the same hidden rig."""
    if not found["next_test"]:
        return None
    procedure = load_procedure(folder / found["next_test"]["procedure"])
    rng = np.random.default_rng([plan.seed, zlib.crc32(NEXT.encode())])
    _recorded(case, rig, folder / NEXT, procedure, rng=rng)
    return diagnosed(list(CAUSES), more=[NEXT])


def _oracle(diagnosed: Diagnosed, plan: CasePlan, found: dict[str, Any]) -> float | None:
    """The error that is left when only the hidden causes may be named."""
    if not found["gain"] or not set(plan.causes) <= set(CAUSES):
        return None
    if sorted(cause["cause"] for cause in in_model(found)) != sorted(plan.causes):
        found = diagnosed(list(plan.causes))
    return float(found["gain"]["held_out"]["after"])


def in_model(found: dict[str, Any] | None) -> list[dict[str, Any]]:
    """The causes that a diagnosis put into its model, the most probable first; none where there is no diagnosis."""
    return [cause for cause in found["causes"] if cause["in_model"]] if found else []
