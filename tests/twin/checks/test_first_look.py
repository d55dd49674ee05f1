"""Mistakes of a first day in a lab, each put into a clean campaign: named before any fit, and nothing where none is."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faulty_runs import filled, fitted, scaled, stepped
from first_day import MISTAKES, NAMES, PER_G, Runs

import twin
from recordings import InputError, Run, read_run
from recordings.run import DeviceSamples
from twin.checks import Finding, FirstLook, first_look
from twin.cli import main
from twin.rigs import Effect, load_rig, preload_names


@pytest.fixture(scope="module")
def clean(campaign: Path) -> Runs:
    return {name: read_run(campaign / f"{name}.mcap") for name in NAMES}


def look(runs: Runs, rig: str = "steel-lap-joint", preload: str | None = None) -> FirstLook:
    return first_look([runs["random"], runs["sweeps"]], load_rig(rig), held_out=[runs["heldout"]], preload=preload)


def every(change: Callable[[Run], Run]) -> Callable[[Runs], Runs]:
    return lambda runs: {name: change(run) for name, run in runs.items()}


def only(which: str, change: Callable[[Run], Run]) -> Callable[[Runs], Runs]:
    return lambda runs: {**runs, which: change(runs[which])}


def test_clean_recordings_have_nothing_found(clean: Runs) -> None:
    looked = look(clean)
    assert looked.findings == ()
    assert looked.passed() is looked


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_named(clean: Runs, name: str) -> None:
    MISTAKES[name].assert_named(look(MISTAKES[name].put_into(clean)))


def test_what_stops_refuses_with_its_name(clean: Runs) -> None:
    looked = look(MISTAKES["acc1 in g"].put_into(clean))
    with pytest.raises(InputError) as stopped:
        looked.passed()
    assert str(stopped.value).startswith(f"{clean['random'].path}: channel acc1: unit: ")


@pytest.mark.parametrize("name", ["acc1 zero", "acc1 no numbers", "acc1 half zero", "acc1 stuck"])
def test_a_dead_response_is_set_aside(clean: Runs, name: str) -> None:
    looked = look(MISTAKES[name].put_into(clean)).passed()
    assert all(set(run.channels) == {"force", "acc2"} for run in (*looked.runs, *looked.held_out))


def test_a_held_out_run_that_was_learnt_from_stops(clean: Runs) -> None:
    (finding,) = look({**clean, "heldout": clean["sweeps"]}).findings
    assert (finding.kind, finding.action) == ("same", "stopped")
    assert "1.5N-up" in finding.found


@pytest.mark.parametrize("gone", [lambda device: {"values": {}}, lambda device: {"values": {"acc1": np.zeros(0)}}])
def test_a_run_without_samples_of_the_force_is_refused(clean: Runs, gone: Callable[[DeviceSamples], dict]) -> None:
    with pytest.raises(InputError, match="channel force: not recorded"):
        look(only("sweeps", lambda r: fitted(r, gone))(clean))


def test_a_run_without_steps_is_nothing_to_look_at(clean: Runs) -> None:
    assert look(only("heldout", lambda r: replace(r, steps=()))(clean)).findings == ()


def test_without_any_response_left_it_stops(clean: Runs) -> None:
    dead = every(lambda r: filled(filled(r, "acc1", np.zeros_like), "acc2", np.zeros_like))(clean)
    assert look(dead).findings[0].action == "stopped"


@pytest.mark.parametrize("name", [name for name, mistake in MISTAKES.items() if mistake.kind == "wild"])
def test_a_single_wild_sample_is_drawn_over(clean: Runs, name: str) -> None:
    mistake = MISTAKES[name]
    looked = look(mistake.put_into(clean)).passed()
    assert [finding.kind for finding in looked.findings] == ["wild"]
    for which in mistake.runs:
        mended = looked.runs[NAMES.index(which)].device_of(mistake.channel).values[mistake.channel]
        sound = clean[which].device_of(mistake.channel).values[mistake.channel]
        assert np.max(np.abs(mended - sound)) < 0.5 * np.max(np.abs(sound))


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
    other = next(name for name in preload_names(rig) if name != "120N")
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
