"""The pages: self-contained, readable, true to what they report, and safe with strangers' names."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from html.parser import HTMLParser
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest

from recordings import InputError
from twin.diagnose.answer.result import Diagnosis
from twin.views import page as pages
from twin.views.reports.diagnosis import diagnosis_page
from twin.views.reports.rehearsal import rehearsal_page

COMMAND = "twin diagnose random.mcap sweeps.mcap --rig steel-lap-joint --out diagnosis"


class Page(HTMLParser):
    """Tags with their attributes, and the text of each."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.texts: dict[str, list[str]] = {}
        self.feed(text)
        assert self.open == [], "tags left open"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in ("meta", "img", "link", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if data.strip() and self.open:
            self.texts.setdefault(self.open[-1], []).append(" ".join(data.split()))

    def named(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module")
def report(diagnosis: Diagnosis, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    diagnosis_page(diagnosis).write(path, commands=[COMMAND])
    return path


def test_the_answer_comes_first(report: Path, diagnosis: Diagnosis) -> None:
    page = Page(report.read_text(encoding="utf-8"))
    assert page.named("p")[0] == {"class": "answer"}
    assert page.texts["p"][0] == diagnosis.sentence


def test_the_page_needs_no_network_and_is_small(report: Path) -> None:
    text = report.read_text(encoding="utf-8")
    page = Page(text)
    assert report.stat().st_size < 3_000_000
    assert page.named("link") == page.named("script") == []
    assert all((image["src"] or "").startswith("data:image/png;base64,") for image in page.named("img"))
    assert "http" not in re.sub(r"base64,[A-Za-z0-9+/=]+", "", text)


def test_pictures_have_words_and_are_pictures(report: Path, tmp_path: Path) -> None:
    images = Page(report.read_text(encoding="utf-8")).named("img")
    assert len(images) == 7
    for image in images:
        assert len(image["alt"] or "") > 40
        png = tmp_path / "picture.png"
        png.write_bytes(base64.b64decode((image["src"] or "").partition(",")[2]))
        pixels = matplotlib.image.imread(png)
        assert pixels.shape[:2] == (int(image["height"] or 0), int(image["width"] or 0))
        assert np.mean(pixels[:, :, :3].min(axis=2) < 0.9) > 0.005


def test_headings_are_in_order(report: Path) -> None:
    levels = [int(tag[1]) for tag, _ in Page(report.read_text(encoding="utf-8")).tags if re.fullmatch(r"h\d", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))


def test_tables_hold_the_diagnosis(report: Path) -> None:
    cells = Page(report.read_text(encoding="utf-8")).texts
    assert {"5.40 %", "0.77 %", "0.50 %", "sensor-position", "0.980", "70.0 %"} <= set(cells["td"])
    assert "mass 8.000 ± 0.008 g at 350.00 ± 0.05 mm" in cells["td"]
    assert COMMAND in cells["code"]
    assert "2 step(s) were still changing and were left out" in cells["li"]


def test_what_the_data_exclude_is_told_with_the_set_that_holds_the_probability(report: Path) -> None:
    page = Page(report.read_text(encoding="utf-8"))
    assert "What these data exclude" in page.texts["h2"]
    assert "Together these hold 95 % of the probability: added-mass, sensor-position." in page.texts["p"]
    assert {"drive-mass", "viscous-damper", "base-motion"} <= set(page.texts["th"])
    told = " | ".join(page.texts["td"])
    assert "mass 23 mg | " in told
    assert "damping 7.1 mN s/m | part upper at 420 mm" in told
    assert "any receptance" in told


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of few pixels, where nobody looks at them."""
    monkeypatch.setattr(pages, "DPI", 30)


@pytest.mark.usefixtures("coarse")
def test_strangers_names_stay_text(diagnosis: Diagnosis, tmp_path: Path) -> None:
    hostile = replace(diagnosis, notes=("<script>alert(1)</script>",), held_out=(), gain=None)
    diagnosis_page(hostile).write(tmp_path / "report.html")
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert page.named("script") == page.named("b") == []
    assert "<script>alert(1)</script>" in page.texts["li"]


@pytest.mark.usefixtures("coarse")
def test_a_diagnosis_of_nothing_wrong_says_so(diagnosis: Diagnosis, tmp_path: Path) -> None:
    diagnosis_page(replace(diagnosis, verdict="none", causes=())).write(tmp_path / "report.html")
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "nothing needs to be named" in page.texts["p"][0]
    assert "extended model" not in page.texts["th"]


def _luminance(colour: str) -> float:
    channels = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_text_stands_out_from_its_ground() -> None:
    style = resources.files("twin.views").joinpath("report.html").read_text(encoding="utf-8").partition("</style>")[0]
    inks = set(re.findall(r"(?<![\w-])color: (#[0-9a-f]{6})", style))
    grounds = {"#ffffff", *re.findall(r"background: (#[0-9a-f]{6})", style)}
    assert len(inks) >= 2
    for ink in inks:
        for ground in grounds:
            assert (_luminance(ground) + 0.05) / (_luminance(ink) + 0.05) > 7.0


def test_a_rehearsal_that_misleads_says_how(rehearsal: dict[str, Any], tmp_path: Path) -> None:
    rehearsal_page(rehearsal).write(tmp_path / "report.html", commands=["twin rehearse steel-sweeps"])
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "1 warning says that its data would mislead" in page.texts["p"][0]
    assert {"0.2 s against a time constant of 2.6 s", "settle for 12 s", "1.5N-up, step 2, 27 Hz"} <= set(
        page.texts["td"]
    )
    assert len(page.named("img")) == 2
    head = page.texts["th"]
    assert {"error", "transient", "distortion: force / acc1", "range: force / acc1", "distance: voltage"} <= set(head)
    assert {"-0.2", "0.04", "0.21 / 0.8", "3 / 40", "69"} <= set(page.texts["td"])


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize(
    ("improved", "words"),
    [
        ({"cleared": True, "remaining": []}, "; the improved procedure raises none."),
        (
            {"cleared": False, "remaining": ["grid-too-coarse"]},
            "; the improved procedure does not clear them all: grid-too-coarse remains.",
        ),
    ],
)
def test_a_rehearsal_says_what_its_improvement_leaves(
    rehearsal: dict[str, Any], tmp_path: Path, improved: dict[str, Any], words: str
) -> None:
    rehearsal_page({**rehearsal, "improved": {**rehearsal, **improved}}).write(tmp_path / "report.html")
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert page.texts["p"][0].endswith("that its data would mislead" + words)
    assert ("Not cleared: grid-too-coarse." in page.texts["p"]) == (not improved["cleared"])


@pytest.mark.usefixtures("coarse")
def test_a_decay_is_told_with_its_parts_where_they_differ(rehearsal: dict[str, Any], tmp_path: Path) -> None:
    parts = [
        {"amplitude": a, "frequency_Hz": 26.4, "damping_ratio": ratio, "damping_ratio_std": 2e-6}
        for a, ratio in ((20.0, 0.00301), (5.0, 0.00252))
    ]
    decay = {
        "sweep": "ring-down-26.44Hz-up", "index": 1, "channel": "acc2", "amplitude": 28.6, "frequency_Hz": 26.457,
        "damping_ratio": 0.00276, "parts": parts, "depends": True,
    }  # fmt: skip
    rehearsal_page({**rehearsal, "decays": [decay]}).write(tmp_path / "report.html")
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert {"0.276", "0.3010 ± 0.0002", "0.2520 ± 0.0002", "26.457"} <= set(page.texts["td"])
    assert any("changes with the amplitude" in text for text in page.texts["p"])


@pytest.mark.usefixtures("coarse")
def test_a_rehearsal_that_must_not_be_run_says_why(rehearsal: dict[str, Any], tmp_path: Path) -> None:
    stop = {**rehearsal["warnings"][0], "severity": "stop", "reason": "acc1 is at its converter's limit"}
    rehearsal_page({**rehearsal, "must_not_run": True, "warnings": [stop]}).write(tmp_path / "report.html")
    answer = Page((tmp_path / "report.html").read_text(encoding="utf-8")).texts["p"][0]
    assert answer == "The procedure must not be run like this: acc1 is at its converter's limit."


def test_a_report_that_cannot_be_written_leaves_nothing(diagnosis: Diagnosis, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        diagnosis_page(diagnosis).write(tmp_path / "nowhere" / "report.html")
    assert list(tmp_path.iterdir()) == []
