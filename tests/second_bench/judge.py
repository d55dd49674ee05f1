"""Has the tool judge recorded campaigns: ``python -m tests.second_bench.judge FOLDER...``, cases or folders of them."""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from tests.second_bench.campaign import BROADBAND, TRUTH, recording_names

HEADINGS = ("case", "verdict", "set_95", "p(truth)", "pulls", "before", "after", "noise", "CPU s")


def cases_in(folders: Iterable[Path]) -> list[Path]:
    """Folders with a truth among those given and right below them, in order of name."""
    found = {path.parent for folder in folders for path in (*folder.glob(TRUTH), *folder.glob(f"*/{TRUTH}"))}
    return sorted(found)


def diagnosed(folder: Path, *, limit_s: float) -> tuple[dict[str, Any] | None, str]:
    """The tool's answer about a case, or None, and the last thing it said if it had none.

    It runs as a program of its own that sees the recordings and the rig file, for so many seconds of CPU time: those of
    the clock say little where others work too.
    """
    truth = json.loads((folder / TRUTH).read_text())
    learnt, held_out = zip(*(recording_names(mode) for mode in range(1, truth["modes"] + 1)), strict=True)
    command = [
        sys.executable, "-m", "twin", "diagnose", *(str(folder / name) for name in (BROADBAND, *learnt)),
        "--rig", str(folder / "rig.toml"), "--out", str(folder / "diagnosis"), "--json",
        "--held-out", *(str(folder / name) for name in held_out),
    ]  # fmt: skip
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    limit = math.ceil(limit_s)
    done = subprocess.run(
        command, capture_output=True, text=True, env=environment, check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit)),
    )  # fmt: skip
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return None, f"no answer in {limit} s"
    try:
        return json.loads(done.stdout), ""
    except json.JSONDecodeError:
        return None, (done.stderr.strip().splitlines() or [f"status {done.returncode}"])[-1]


def judged(folder: Path, *, limit_s: float) -> dict[str, Any]:
    """What was hidden and what was found, of one case."""
    truth = json.loads((folder / TRUTH).read_text())
    before_s, started = _children_cpu_s(), time.monotonic()
    found, trouble = diagnosed(folder, limit_s=limit_s)
    entry = {
        "case": folder.name, "truth": truth["cause"], "trouble": trouble,
        "CPU s": _children_cpu_s() - before_s, "seconds": time.monotonic() - started,
    }  # fmt: skip
    if found is None:
        return entry
    named = {cause["cause"]: cause for cause in found["causes"]}
    gain = found["gain"]["held_out"] if found["gain"] else dict.fromkeys(("before", "after", "noise_floor"))
    return entry | {
        "verdict": found["verdict"],
        "set_95": found["set_95"],
        "named": [cause["cause"] for cause in found["causes"] if cause["in_model"]],
        "p(truth)": named[truth["cause"]]["probability"] if truth["cause"] in named else None,
        "pulls": pulls(truth["parameters"], named[truth["cause"]]) if truth["cause"] in named else {},
        "before": gain["before"], "after": gain["after"], "noise": gain["noise_floor"],
        "misfit": found["misfit"]["chi2_per_dof"],
        "model_error": found["model_error"]["inferred"],
    }  # fmt: skip


def pulls(truth: Mapping[str, Any], cause: Mapping[str, Any]) -> dict[str, float | bool]:
    """How far each parameter is from the truth, in its own standard deviations; of a name, whether it is right."""
    out: dict[str, float | bool] = {}
    for name, value in cause["parameters"].items():
        if isinstance(value, dict) and name in truth and value.get("std"):
            out[name] = (value["value"] - truth[name]) / value["std"]
        elif isinstance(value, str) and name in truth:
            out[name] = value == truth[name]
    return out


def _children_cpu_s() -> float:
    """CPU time of the diagnoses that this process has run."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def row(entry: Mapping[str, Any]) -> list[str]:
    """An entry as a line of the table."""

    def number(key: str, form: str) -> str:
        return format(entry[key], form) if entry.get(key) is not None else "-"

    pulled = ", ".join(f"{name} {value:.1f}" if not isinstance(value, bool) else f"{name} {'=' if value else '!='}"
                       for name, value in entry.get("pulls", {}).items())  # fmt: skip
    return [
        entry["case"], entry.get("verdict") or entry["trouble"], ", ".join(entry.get("set_95", [])) or "-",
        number("p(truth)", ".3f"), pulled or "-", number("before", ".2%"), number("after", ".2%"),
        number("noise", ".3%"), number("CPU s", ".0f"),
    ]  # fmt: skip


def table(entries: Iterable[Mapping[str, Any]]) -> str:
    """All entries, a line each."""
    rows = [list(HEADINGS), *(row(entry) for entry in entries)]
    widths = [max(len(line[column]) for line in rows) for column in range(len(HEADINGS))]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) for line in rows)


def main() -> None:
    """Judge what is not in the file of results yet, and print a table of it all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--results", type=Path, help="a JSON line for each case; judged.jsonl in the first folder")
    parser.add_argument("--time-limit", type=float, default=600.0, help="CPU seconds for each case")
    parser.add_argument("--at-once", type=int, default=2)
    asked = parser.parse_args()
    results = asked.results or asked.folders[0] / "judged.jsonl"
    known = [json.loads(line) for line in results.read_text().splitlines()] if results.exists() else []
    entries = {entry["case"]: entry for entry in known}

    cases = [folder for folder in cases_in(asked.folders) if folder.name not in entries]
    with ProcessPoolExecutor(asked.at_once) as pool, results.open("a") as file:
        for judging in as_completed([pool.submit(judged, folder, limit_s=asked.time_limit) for folder in cases]):
            entry = judging.result()
            entries[entry["case"]] = entry
            file.write(json.dumps(entry) + "\n")
            file.flush()
            print("  ".join(row(entry)), file=sys.stderr, flush=True)
    print(table(entries[name] for name in sorted(entries)))


if __name__ == "__main__":
    main()
