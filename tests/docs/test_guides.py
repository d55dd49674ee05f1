"""Every guide in docs/ runs as it is written, and prints what it says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from guide_script import as_script, matches, read_blocks, run_guide

DOCS = Path(__file__).parents[2] / "docs"
LIST = (DOCS / "README.md").read_text(encoding="utf-8")
GUIDES = [DOCS / name for name in re.findall(r"^\d+\. \[[^]]+\]\((\S+\.md)\)", LIST, re.MULTILINE)]


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    GUIDES,
    ids=lambda page: page.stem,
)
def test_guide_runs_and_prints_what_it_shows(page: Path, tmp_path: Path) -> None:
    folder = tmp_path / "guide"
    folder.mkdir()
    for block, promised, printed in run_guide(page, folder, timeout_s=600):
        assert matches(promised, printed), f"{page.name}, line {block.line}, promises\n{promised}\nbut came\n{printed}"


def test_every_page_is_on_the_list_and_every_link_leads_somewhere() -> None:
    listed = re.findall(r"\]\(([^)#]+\.md)\)", LIST)
    pages = [page for page in DOCS.rglob("*.md") if page.name != "index.md"]  # that one and the API are the site's
    of_causes = re.findall(r"\]\((causes/\S+\.md)\)", (DOCS / "causes.md").read_text(encoding="utf-8"))
    assert sorted([*listed, *of_causes, "README.md"]) == sorted(
        page.relative_to(DOCS).as_posix() for page in pages if page.parent.name != "api"
    )
    for page in pages:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name} leads to {target}"


def test_the_runner_tells_a_wrong_promise_a_failing_block_and_one_that_hangs(tmp_path: Path) -> None:
    folder = tmp_path / "work"
    folder.mkdir()
    page = tmp_path / "page.md"
    page.write_text(
        "```toml file=a/b.toml\nx = '$HOME'\n```\n```sh\ncat a/b.toml\n```\n```text\nx = ...E'\n```\n"
        "```python\nprint(6 * 7)\n```\n```text\n43\n```\n"
    )
    (_, first, printed), (_, second, other) = run_guide(page, folder, timeout_s=120)
    assert matches(first, printed)
    assert not matches(second, other)
    page.write_text("```sh\necho before\n```\n\n```sh\nfalse\n```\n```sh\necho after\n```\n")
    with pytest.raises(AssertionError, match=r"page.md, line 5: ended with status 1") as failed:
        run_guide(page, folder, timeout_s=120)
    assert "after" not in str(failed.value).partition("printed:")[2]
    page.write_text("```sh\nsleep 60 &\nwait\n```\n")
    with pytest.raises(AssertionError, match="took more than 1 s"):
        run_guide(page, folder, timeout_s=1)


def test_blocks_are_read_with_their_files_and_lines() -> None:
    blocks = read_blocks("text\n\n```toml file=x.toml\na = 1\n```\n\n```sh\ntrue\n```\n")
    assert [(b.language, b.file, b.line) for b in blocks] == [("toml", "x.toml", 3), ("sh", "", 7)]
    assert "cat > x.toml" in as_script(blocks)
