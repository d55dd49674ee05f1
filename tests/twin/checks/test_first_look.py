"""Mistakes of a first day in a lab, each put into a clean campaign: named before any fit, and nothing where none is."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faulty_runs import copied, filled, fitted, relabelled, retimed, scaled, stepped, swapped, thinned

import twin
from recordings import InputError, Run, read_run
from recordings.run import DeviceSamples
from twin.checks import Finding, FirstLook, first_look
from twin.cli import main
from twin.rigs import Effect, load_rig

Runs = dict[str, Run]
NAMES = ("random", "sweeps", "heldout")
PER_G, PER_POUND = 1 / 9.80665, 1 / 4.4482216


@pytest.fixture(scope="module")
def clean(campaign: Path) -> Runs:
    return {name: read_run(campaign / f"{name}.mcap") for name in NAMES}


def look(runs: Runs, rig: str = "steel-lap-joint", preload: str | None = None) -> FirstLook:
    return first_look([runs["random"], runs["sweeps"]], load_rig(rig), held_out=[runs["heldout"]], preload=preload)


def every(change: Callable[[Run], Run]) -> Callable[[Runs], Runs]:
    return lambda runs: {name: change(run) for name, run in runs.items()}


def only(which: str, change: Callable[[Run], Run]) -> Callable[[Runs], Runs]:
    return lambda runs: {**runs, which: change(runs[which])}


def noise(run: Run) -> Run:
    rng = np.random.default_rng(list(run.path.encode()))
    for channel in run.channels:
        run = filled(run, channel, lambda x: rng.standard_normal(len(x)))
    return run


def spoilt(channel: str, value: float) -> Callable[[Run], Run]:
    return lambda run: filled(run, channel, lambda x: np.where(np.arange(len(x)) == len(x) // 2, value, x))


def one_off(run: Run) -> Run:
    """Each step with the frequency of the next one, on the campaign's grid of 0.06 Hz."""
    return stepped(run, lambda step: {"frequency_Hz": step.frequency_Hz + 0.06 * (step.frequency_Hz > 0)})


def later_half(run: Run, channel: str, value: float | None = None) -> Run:
    def change(x: np.ndarray) -> np.ndarray:
        return np.where(np.arange(len(x)) > len(x) // 2, x[len(x) // 2] if value is None else value, x)

    return filled(run, channel, change)


def renamed(run: Run) -> Run:
    """With the first accelerometer by another name than the rig's."""
    names = {"acc1": "ACC"}
    whole = replace(run, channels={names.get(n, n): replace(c, name=names.get(n, n)) for n, c in run.channels.items()})
    return fitted(whole, lambda device: {"values": {names.get(n, n): x for n, x in device.values.items()}})


def slower(run: Run) -> Run:
    """Rate and all time stamps wrong alike, by a thousand."""
    slow = retimed(fitted(run, lambda device: {"sample_rate_Hz": device.sample_rate_Hz / 1000}), 1000)
    return stepped(slow, lambda step: {"time_ns": step.time_ns * 1000})


def test_clean_recordings_have_nothing_found(clean: Runs) -> None:
    looked = look(clean)
    assert looked.findings == ()
    assert looked.passed() is looked


@pytest.mark.parametrize(
    ("mistake", "kind", "channel", "said"),
    [
        pytest.param(every(lambda r: scaled(r, acc1=PER_G)), "unit", "acc1", "in g", id="acc1-in-g"),
        pytest.param(every(lambda r: scaled(r, acc1=PER_G, acc2=PER_G)), "unit", "acc1, acc2", "in g", id="both-in-g"),
        pytest.param(every(lambda r: scaled(r, force=PER_POUND)), "unit", "force", "lbf", id="force-in-lbf"),
        pytest.param(
            every(lambda r: scaled(r, force=PER_POUND, acc1=PER_G, acc2=PER_G)), "unit", "force", "lbf", id="lbf-and-g"
        ),
        pytest.param(only("sweeps", lambda r: scaled(r, acc2=1e3)), "unit", "acc2", "1000", id="milli-in-one-run"),
        pytest.param(every(lambda r: scaled(r, acc2=0.5)), "unit", "acc2", "0.5", id="half"),
        pytest.param(every(lambda r: scaled(r, acc2=2**0.5)), "unit", "acc2", "sqrt 2", id="peak-for-rms"),
        pytest.param(every(lambda r: scaled(r, acc1=2 * np.pi)), "unit", "acc1", "2 pi", id="hertz"),
        pytest.param(every(lambda r: swapped(r, "acc1", "acc2")), "swapped", "", "acc1 is acc2", id="accelerometers"),
        pytest.param(
            only("heldout", lambda r: swapped(r, "acc1", "acc2")), "swapped", "", "acc1 is acc2", id="in-one-run"
        ),
        pytest.param(every(lambda r: swapped(r, "force", "acc1")), "swapped", "force", "acc1", id="force-and-acc1"),
        pytest.param(every(lambda r: scaled(r, acc1=-1, acc2=-1)), "direction", "force", "turned", id="both-turned"),
        pytest.param(only("sweeps", lambda r: scaled(r, acc1=-1)), "direction", "acc1", "every", id="turned-in-one"),
        pytest.param(every(lambda r: filled(r, "force", np.zeros_like)), "dead", "force", "is 0", id="force-zero"),
        pytest.param(every(lambda r: later_half(r, "force", 0.0)), "empty", "force", "zero", id="force-half-zero"),
        pytest.param(
            every(lambda r: relabelled(r, "acc1", quantity="velocity", unit="m/s")), "quantity", "acc1", "velocity",
            id="velocity",
        ),
        pytest.param(every(lambda r: retimed(r, 1e-3)), "clock", "", "0.001", id="stamps-in-ms"),
        pytest.param(
            every(lambda r: stepped(r, lambda s: {"time_ns": s.time_ns // 1000})), "clock", "", "without samples",
            id="steps-in-ms",
        ),
        pytest.param(
            every(lambda r: fitted(r, lambda d: {"sample_rate_Hz": 1000 * d.sample_rate_Hz})), "clock", "", "1000",
            id="rate",
        ),
        pytest.param(every(slower), "clock", "force", "0.001", id="rate-and-stamps"),
        pytest.param(
            only("random", lambda r: filled(r, "force", lambda x: np.roll(x, len(x) // 3))), "unrelated", "acc1",
            "coherence", id="other-force",
        ),
        pytest.param(only("sweeps", noise), "unrelated", "force", "power", id="noise-for-sines"),
        pytest.param(every(noise), "unrelated", "acc1", "coherence", id="noise-for-all"),
        pytest.param(every(lambda r: scaled(r, acc1=50.0)), "unit", "acc1", "no unit", id="absurd"),
        pytest.param(
            every(lambda r: scaled(r, acc1=1 / 0.3048, acc2=1 / 0.3048)), "unit", "acc1, acc2", "feet", id="feet"
        ),
        pytest.param(every(lambda r: scaled(r, force=PER_G)), "unit", "force", "kgf", id="force-in-kgf"),
        pytest.param(
            every(lambda r: stepped(r, lambda s: {"target_amplitude": s.target_amplitude / 2**0.5})), "unit", "force",
            "sqrt 2", id="targets-in-rms",
        ),
        pytest.param(
            every(lambda r: stepped(r, lambda s: {"frequency_Hz": s.frequency_Hz * 2 * np.pi})), "clock", "force",
            "0.159", id="steps-in-rad-per-s",
        ),
        pytest.param(
            only("sweeps", lambda r: scaled(r, force=-1)), "direction", "force", "turned", id="force-cell-turned"
        ),
        pytest.param(
            only("heldout", lambda r: swapped(r, "force", "acc1")), "swapped", "force", "acc1",
            id="force-and-acc1-held-out",
        ),
        pytest.param(every(lambda r: filled(r, "acc1", np.abs)), "unrelated", "acc1", "coherence", id="rectified"),
        pytest.param(
            every(lambda r: fitted(r, lambda d: {"sample_rate_Hz": 1.02 * d.sample_rate_Hz})), "clock", "", "1.02",
            id="rate-two-per-cent",
        ),
        pytest.param(only("sweeps", lambda r: copied(r, "acc2", "acc1")), "same", "acc2", "acc1", id="copied-channel"),
        pytest.param(lambda runs: {**runs, "heldout": runs["sweeps"]}, "same", "", "1.5N-up", id="held-out-was-learnt"),
    ],
)  # fmt: skip
def test_a_mistake_stops_with_its_name(
    clean: Runs, mistake: Callable[[Runs], Runs], kind: str, channel: str, said: str
) -> None:
    looked = look(mistake(clean))
    first = looked.findings[0]
    assert (first.kind, first.action) == (kind, "stopped"), looked.told
    assert first.channel.startswith(channel), looked.told
    assert said in first.found
    with pytest.raises(InputError) as stopped:
        looked.passed()
    assert str(stopped.value).startswith(first.run)
    assert kind in str(stopped.value)


@pytest.mark.parametrize(
    ("mistake", "kind", "channel"),
    [
        pytest.param(every(lambda r: filled(r, "acc1", np.zeros_like)), "dead", "acc1", id="zeros"),
        pytest.param(every(lambda r: filled(r, "acc1", lambda x: np.full_like(x, np.nan))), "dead", "acc1", id="nan"),
        pytest.param(every(lambda r: later_half(r, "acc1", 0.0)), "empty", "acc1", id="half-zero"),
        pytest.param(every(lambda r: later_half(r, "acc1")), "empty", "acc1", id="stuck"),
    ],
)
def test_a_dead_response_is_set_aside(clean: Runs, mistake: Callable[[Runs], Runs], kind: str, channel: str) -> None:
    looked = look(mistake(clean)).passed()
    assert {(one.kind, one.channel, one.action) for one in looked.findings} == {(kind, channel, "set aside")}
    assert all(set(run.channels) == {"force", "acc2"} for run in (*looked.runs, *looked.held_out))


@pytest.mark.parametrize("gone", [lambda device: {"values": {}}, lambda device: {"values": {"acc1": np.zeros(0)}}])
def test_a_run_without_samples_of_the_force_is_refused(clean: Runs, gone: Callable[[DeviceSamples], dict]) -> None:
    with pytest.raises(InputError, match="channel force: not recorded"):
        look(only("sweeps", lambda r: fitted(r, gone))(clean))


def test_a_run_without_steps_is_nothing_to_look_at(clean: Runs) -> None:
    assert look(only("heldout", lambda r: replace(r, steps=()))(clean)).findings == ()


def test_without_any_response_left_it_stops(clean: Runs) -> None:
    dead = every(lambda r: filled(filled(r, "acc1", np.zeros_like), "acc2", np.zeros_like))(clean)
    assert look(dead).findings[0].action == "stopped"


@pytest.mark.parametrize("value", [1e3, -1e3, 1e38])
@pytest.mark.parametrize("which", ["random", "sweeps"])
@pytest.mark.parametrize("channel", ["force", "acc1"])
def test_a_single_wild_sample_is_drawn_over(clean: Runs, channel: str, which: str, value: float) -> None:
    looked = look(only(which, spoilt(channel, value))(clean)).passed()
    assert [(one.kind, one.channel, one.action) for one in looked.findings] == [("wild", channel, "set aside")]
    mended = looked.runs[NAMES.index(which)].device_of(channel).values[channel]
    sound = clean[which].device_of(channel).values[channel]
    assert np.max(np.abs(mended - sound)) < 0.5 * np.max(np.abs(sound))


@pytest.mark.parametrize(
    ("mistake", "kind", "said"),
    [
        pytest.param(every(lambda r: scaled(r, acc1=-1)), "direction", "acc1 turned", id="one-turned"),
        pytest.param(every(lambda r: relabelled(r, "acc1", position_m=0.2)), "position", "0.2 m", id="position"),
        pytest.param(
            every(lambda r: stepped(r, lambda s: {"target_channel": "acc1"})), "target", "force keeps", id="target"
        ),
        pytest.param(only("random", lambda r: thinned(r, 4)), "aliasing", "anti-aliasing", id="no-filter"),
        pytest.param(every(lambda r: replace(r, info={**r.info, "rig": "other"})), "rig", "other", id="rig"),
        pytest.param(only("sweeps", one_off), "step", "one step", id="one-step-off"),
        pytest.param(every(renamed), "name", "the file has ACC", id="another-name"),
        pytest.param(
            every(lambda r: replace(r, info={**r.info, "preload_N": "540"})),
            "preload",
            "resonances of 120N",
            id="another-preload",
        ),
    ],
)
def test_what_a_fit_can_bear_is_told(clean: Runs, mistake: Callable[[Runs], Runs], kind: str, said: str) -> None:
    looked = look(mistake(clean)).passed()
    found = next(one for one in looked.findings if one.kind == kind)
    assert found.action == "told"
    assert said in found.found


def test_a_sweep_given_twice_counts_once(clean: Runs) -> None:
    again = replace(clean["sweeps"], path="copy.mcap")
    looked = first_look([clean["random"], clean["sweeps"], again], load_rig("steel-lap-joint"))
    assert [(one.run, one.kind, one.action) for one in looked.findings] == [("copy.mcap", "same", "set aside")]
    assert [run.path for run in looked.runs] == [clean["random"].path, clean["sweeps"].path]


def test_a_held_out_sweep_of_another_specimen_is_told(clean: Runs) -> None:
    """A resonance 0.3 % higher: its sines as they are, commanded that much lower."""
    other = stepped(clean["heldout"], lambda step: {"frequency_Hz": step.frequency_Hz * (1 - 3e-3)})
    other = fitted(other, lambda device: {"sample_rate_Hz": device.sample_rate_Hz * (1 - 3e-3)})
    kinds = [(one.kind, one.action) for one in look({**clean, "heldout": other}).passed().findings]
    assert kinds == [("specimen", "told")]


def test_another_rig_than_the_recordings_stops(clean: Runs) -> None:
    rig = load_rig("two-lap-joints")
    findings = first_look([clean["random"], clean["sweeps"]], rig).findings
    assert ("rig", "stopped") in {(one.kind, one.action) for one in findings}, findings


def test_a_preload_that_the_file_contradicts_is_told(clean: Runs) -> None:
    rig = load_rig("steel-lap-joint")
    other = next(name for name in rig.preloads if name != "120N")
    findings = look(clean, preload=other).findings
    assert ("preload", f"{other}, as was asked for") in {(one.kind, one.expected) for one in findings}


def test_what_the_rig_file_knows_of_a_channel_is_no_finding(clean: Runs) -> None:
    effect = Effect(cause="channel-gain", parameters={"channel": "acc1", "factor": 2.0})
    rig = load_rig("steel-lap-joint").model_copy(update={"effect": [effect]})
    doubled = every(lambda r: scaled(r, acc1=2.0))(clean)
    assert first_look(list(doubled.values()), rig).findings == ()


def test_a_finding_is_one_line_without_control_characters() -> None:
    line = Finding("a/run.mcap", "acc\x1b[1m", "dead", "a signal", "every\nsample is 0", "stopped").line
    assert line == "run.mcap: channel acc?[1m: dead: every sample is 0; expected a signal; check cable and supply"


def test_the_command_tells_and_its_status_says_so(campaign: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runs = [str(campaign / f"{name}.mcap") for name in NAMES]

    def run(*arguments: str) -> int:
        with pytest.raises(SystemExit) as ended:
            main(["check", *arguments])
        return int(ended.value.code or 0)

    assert run(*runs, "--rig", "steel-lap-joint", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["sound"], told["findings"], len(told["runs"])) == (True, [], 3)
    assert run(*runs, runs[1], "--rig", "steel-lap-joint", "--json") == 0
    (again,) = json.loads(capsys.readouterr().out)["findings"]
    assert set(again) == {"run", "channel", "kind", "expected", "found", "action"}
    assert run(*runs, "--rig", "two-lap-joints") == 1
    assert "stopped: " in capsys.readouterr().err


@pytest.mark.parametrize("ask", ["identify", "diagnose"])
def test_no_fit_is_begun_on_what_stops(clean: Runs, ask: str) -> None:
    grams = [scaled(clean[name], acc1=PER_G) for name in ("random", "sweeps")]
    with pytest.raises(InputError, match="recorded in g"):
        getattr(twin.load_rig("steel-lap-joint"), ask)(grams)
