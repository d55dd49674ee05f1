"""Measure this clone and write what came out: docs/measured.md whole, and the README's lines between its two marks.

python docs/measure.py                              every stage, some hours
python docs/measure.py --only demo --only speed     these alone; `--help` lists them

Answers are kept in the folder `measured` of the clone, by stage.  The page tells those of the present code: an answer
of another commit of the packages is not told, and its stage is listed as not run.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from measured_stages import STAGES, Stage

ROOT = Path(__file__).parents[1]
PACKAGES = ("recordings", "drivers", "twin", "studies", "benchmarks")
"""What an answer depends on; a change of the documents leaves it true."""
BEGIN, END = "<!-- measured:begin -->", "<!-- measured:end -->"
LONGEST_s = 3 * 3600.0
"""After which a stage is given up: several times what the longest takes on two cores."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What a stage's command said.

    Attributes
    ----------
    code
        Commit of the packages, with a plus where they differ from it.
    machine
        Processor, cores and the versions that matter.
    date
        Day, UTC.
    seconds
        That the command took.
    load
        Mean number of running processes of the machine over the last minute of it.
    answer
        Its JSON; None if it failed.
    failure
        Why, in a line.
    """

    code: str
    machine: str
    date: str
    seconds: float
    load: float
    answer: Any
    failure: str = ""


def code_here() -> str:
    """Commit of the packages, with a plus where they differ from it."""
    commit = _git("log", "-1", "--format=%h", "--", *PACKAGES)
    return f"{commit}+" if _git("status", "--porcelain", "--", *PACKAGES) else commit


def _git(*words: str) -> str:
    done = subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def machine_here() -> str:
    """Processor, cores and the versions that matter."""
    about = Path("/proc/cpuinfo")
    lines = about.read_text(encoding="utf-8").splitlines() if about.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    versions = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    processor = models[0] if models else platform.processor() or platform.machine()
    return f"{processor}, {os.cpu_count()} cores, Python {platform.python_version()}, {versions}"


def run(stage: Stage) -> Answer:
    """Run a stage's command in an empty folder; what goes wrong is its answer's failure."""
    answer, failure, begun = None, "", time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "tests").symlink_to(ROOT / "tests")
        try:
            done = subprocess.run(
                [sys.executable, "-m", "twin", *shlex.split(stage.command), "--json", "--quiet"], cwd=folder,
                env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, timeout=LONGEST_s,
            )  # fmt: skip
            answer = json.loads(done.stdout)
        except subprocess.TimeoutExpired:
            failure = f"did not end within {LONGEST_s / 3600:g} h"
        except json.JSONDecodeError:
            said = done.stderr.strip().splitlines()
            failure = f"ended with status {done.returncode}: {said[-1] if said else 'nothing was said'}"
    return Answer(
        code=code_here(), machine=machine_here(), date=datetime.datetime.now(datetime.UTC).date().isoformat(),
        seconds=time.monotonic() - begun, load=os.getloadavg()[0], answer=answer, failure=failure,
    )  # fmt: skip


def kept(folder: Path, code: str) -> dict[str, Answer]:
    """Answers of earlier runs that are of this code, by stage."""
    read = {name: folder / f"{name}.json" for name in STAGES}
    answers = {
        name: Answer(**json.loads(path.read_text(encoding="utf-8"))) for name, path in read.items() if path.exists()
    }
    return {name: answer for name, answer in answers.items() if answer.code == code}


def page(answers: Mapping[str, Answer], code: str) -> str:
    """The page of measured figures."""
    told = [
        "# Measured",
        "Written by `python docs/measure.py`, which runs the commands below and tells what they answer; "
        f"version {version('virtual-test-rig')}, commit {code} of the packages.",
        *(f"Machine: {machine}." for machine in dict.fromkeys(one.machine for one in answers.values())),
    ]
    for name, stage in STAGES.items():
        told += [f"## {stage.title}", _ran(name, stage, answers.get(name))]
        if name in answers and not answers[name].failure:
            told.append(_markdown(stage.table(answers[name].answer)))
    return "\n\n".join(told) + "\n"


def _ran(name: str, stage: Stage, answer: Answer | None) -> str:
    command = f"`twin {stage.command}`"
    if answer is None:
        return f"{command}: not run (`python docs/measure.py --only {name}`)."
    when = f"{answer.date}, {answer.seconds:.0f} s, load {answer.load:.1f}"
    return f"{command}: {when}{f'; failed: {answer.failure}' if answer.failure else ''}."


def readme_lines(answers: Mapping[str, Answer], code: str) -> str:
    """What stands between the README's marks."""
    rows = [("figure", f"commit {code}", "command")]
    for name, stage in STAGES.items():
        if stage.figure:
            answer = answers.get(name)
            known = answer is not None and not answer.failure
            rows.append((stage.figure, stage.line(answer.answer) if known else "not run", f"`twin {stage.command}`"))
    return _markdown(rows)


def _markdown(rows: list[Any]) -> str:
    headings, *others = rows
    cells = [headings, ["---"] * len(headings), *others]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in cells)


def between_marks(text: str, lines: str) -> str:
    """`text` with `lines` between its two marks.

    Raises
    ------
    ValueError
        If a mark is missing.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"README.md needs the marks {BEGIN} and {END}")
    return f"{before}{begin}\n\n{lines}\n\n{end}{after}"


def main(only: list[str], folder: Path) -> int:
    """Run the stages, keep their answers, write both documents; 1 if a stage failed."""
    folder.mkdir(exist_ok=True)
    for name in only or STAGES:
        print(f"{name}: twin {STAGES[name].command}", flush=True)
        answer = run(STAGES[name])
        print(f"{answer.seconds:.0f} s{f', failed: {answer.failure}' if answer.failure else ''}", flush=True)
        (folder / f"{name}.json").write_text(json.dumps(asdict(answer)), encoding="utf-8")
        write(folder)
    return int(any(answer.failure for answer in kept(folder, code_here()).values()))


def write(folder: Path) -> None:
    """Both documents, from the answers in `folder` that are of this code."""
    code = code_here()
    answers = kept(folder, code)
    (ROOT / "docs" / "measured.md").write_text(page(answers, code), encoding="utf-8")
    readme = ROOT / "README.md"
    text = between_marks(readme.read_text(encoding="utf-8"), readme_lines(answers, code))
    readme.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", choices=list(STAGES), default=[], help="run this stage; repeatable")
    sys.exit(main(parser.parse_args().only, ROOT / "measured"))
