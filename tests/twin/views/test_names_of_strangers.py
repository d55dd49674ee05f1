"""What strangers wrote is text in every view, whichever format it came in: it steers nothing and means nothing."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from recorded_views import columns, sdof_run, verify, write_mcap

from recordings import Run, read_run
from recordings.convert import convert, read_as
from twin.commands.convert import formats
from twin.views.drawing import Drawing
from twin.views.page import Page, Picture, Section
from twin.views.rerun.run import save_run
from twin.views.table import Table, markdown_text, table_html, table_text

NAME = "x\x1b]0;owned\x07\u202e <script>alert(1)</script> ![](http://a/b) $\\frac[$ | *"
"""A title for the terminal, letters from right to left, a script, a picture to be fetched, half a formula."""


def strange_run() -> Run:
    """The run whose every name somebody else has chosen."""
    run = sdof_run()
    device = run.devices["daq"]
    return replace(
        run,
        info={**run.info, "rig": NAME, "procedure": NAME},
        channels={"force": run.channels["force"], NAME: replace(run.channels["acc1"], name=NAME)},
        devices={"daq": replace(device, values={"force": device.values["force"], NAME: device.values["acc1"]})},
        steps=tuple(replace(step, sweep=f"{NAME} {step.target_amplitude:g}") for step in run.steps),
        events=tuple(replace(event, source=NAME, kind=NAME, detail=NAME) for event in run.events),
    )


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_mcap(strange_run(), tmp_path_factory.mktemp("strange") / "run.mcap")


def harmless(text: str) -> bool:
    return all(c.isprintable() or c == "\n" for c in text)


def texts_in(found: Any) -> Iterator[str]:
    """Every text in what an .rrd holds."""
    if isinstance(found, str):
        yield found
    elif isinstance(found, list):
        for each in found:
            yield from texts_in(each)


@pytest.mark.parametrize("suffix", [".mcap", ".csv", ".mat"])
def test_a_view_of_a_recording(suffix: str, recording: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = recording
    if suffix != ".mcap":
        path = tmp_path / f"run{suffix}"
        convert(recording, path, formats=formats())
    run = read_run(path) if suffix == ".mcap" else read_as(path, formats=formats())
    assert NAME in run.channels
    out = tmp_path / "run.rrd"
    save_run(run, out)
    verify(out)
    assert capfd.readouterr().err == ""  # rerun warns of paths that it has to guess
    entities = columns(out)
    texts = [text for parts in entities.values() for rows in parts.values() for text in texts_in(rows)]
    assert sum("owned" in text for text in texts) > 5
    assert all(map(harmless, texts))
    (about,) = entities["/about"]["TextDocument:text"][0]
    assert markdown_text(NAME) in about
    for mark in ("0<script", " ![", "$\\frac[", "| *"):
        assert mark not in about


def strange_page() -> Page:
    def draw() -> Drawing:
        figure = Drawing(figsize=(4, 3), layout="constrained")
        axes = figure.subplots()
        axes.loglog([1, 1000], [1, 2], label=NAME)
        axes.set(title=NAME, xlabel=NAME)
        axes.legend()
        return figure

    table = Table(caption=NAME, head=(NAME, "value"), rows=[(NAME, "1")])
    picture = Picture(draw=draw, alt=NAME, caption=NAME)
    section = Section(title=NAME, texts=[NAME], tables=[table], items=[NAME], pictures=[picture], commands=[NAME])
    return Page(title=NAME, answer=NAME, facts=NAME, sections=[section])


def test_a_report(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of characters that the font has no picture for
        strange_page().write(tmp_path / "report.html", commands=[NAME])
    text = (tmp_path / "report.html").read_text()
    assert harmless(text)
    assert text.count("owned") == 15
    assert "<script" not in text


def test_a_text_pane() -> None:
    text = strange_page().markdown()
    assert harmless(text)
    assert text.count(markdown_text(NAME)) == 9


def test_tables() -> None:
    (table,) = strange_page().sections[0].tables
    assert harmless(table_text(table))
    assert harmless(table_html(table))
    assert "<script" not in table_html(table)


def test_powers_of_ten_at_an_axis_stay_numbers() -> None:
    figure = strange_page().sections[0].pictures[0].draw()
    figure.canvas.draw()
    (axes,) = figure.axes
    assert r"$\mathdefault{10^{3}}$" in [label.get_text() for label in axes.get_xticklabels()]
    assert all(label.get_parse_math() for label in axes.get_xticklabels())


@pytest.mark.parametrize("name", ["acc_1", "1.5N-up", "G' = 2e9 N/m^2", "no 3, the best"])
def test_usual_names_are_left_as_they_are(name: str) -> None:
    assert markdown_text(name) == name
