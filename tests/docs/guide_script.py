"""A guide as a script: its code blocks in order, in one shell, and the outputs it promises.

````sh```` blocks run as they are, ````python```` blocks by an interpreter of their own; a block marked
``file=NAME`` is what a reader saves under that name; a ````diff```` block is applied to the files.  A ````text````
block is what the block before it prints, with ``...`` for what differs from run to run and white space of any kind.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from needed import program

__all__ = ["Block", "as_script", "matches", "read_blocks", "run_guide"]

_FENCE = re.compile(r"^```(\w+)[ ]*([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_END = "END-OF-BLOCK"
_MARK = "\x1e"
_PROGRESS = re.compile(r"^ *\d+\.\d s  .*\n", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class Block:
    """One fenced block; `line` is where it begins in the page."""

    language: str
    file: str
    content: str
    line: int


def read_blocks(page: str) -> list[Block]:
    """The fenced blocks of a page, in order; ValueError if one would be passed over."""
    blocks = []
    for found in _FENCE.finditer(page):
        marked = re.fullmatch(r"file=(\S+)", found[2].strip())
        line = page.count("\n", 0, found.start()) + 1
        blocks.append(Block(language=found[1], file=marked[1] if marked else "", content=found[3], line=line))
    if len(re.findall(r"^[ >]*```", page, re.MULTILINE)) != 2 * len(blocks):
        raise ValueError("a block is indented, or has no language: it would not be run")
    return blocks


def as_script(blocks: list[Block]) -> str:
    """One bash script, which prints a mark and the block's number before each of them."""
    parts = ["set -eu", "exec 2>&1"]
    for number, block in enumerate(blocks):
        command = _command(block)
        if command:
            parts += [f"printf '\\036{number}\\n'", command]
    return "\n".join(parts) + "\n"


def _command(block: Block) -> str:
    if block.file:
        return f"mkdir -p \"$(dirname {block.file})\"\ncat > {block.file} <<'{_END}'\n{block.content}{_END}"
    if block.language == "sh":
        return block.content.rstrip()
    if block.language == "python":
        return f"python - <<'{_END}'\n{block.content}{_END}"
    if block.language == "diff":
        return f"git apply <<'{_END}'\n{block.content}{_END}"
    return ""


def matches(promised: str, printed: str) -> bool:
    """Whether an output is the one a guide shows, which leaves out the lines of progress, before it and within."""
    printed = _PROGRESS.sub("", printed)
    pieces = [r"\s*".join(re.escape(word) for word in piece.split()) for piece in promised.split("...")]
    return (
        re.fullmatch(r"(?:.*\n)??\s*" + r".*?".join(rf"\s*{piece}\s*" for piece in pieces), printed, re.DOTALL)
        is not None
    )


def run_guide(page: Path, folder: Path, *, timeout_s: float, path: str = "") -> list[tuple[Block, str, str]]:
    """Run a page in `folder`; every output it promises beside the one that came.

    Parameters
    ----------
    path
        Where Python looks for the packages first; the installed ones if empty.

    Raises
    ------
    AssertionError
        With what was printed, if a block fails or the whole takes too long.
    """
    blocks = read_blocks(page.read_text(encoding="utf-8"))
    environment = {
        **os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "PYTHONPATH": path,
        "COLUMNS": "110", "MPLBACKEND": "agg", "GIT_CEILING_DIRECTORIES": str(folder.parent),
    }  # fmt: skip
    if any(block.language == "diff" for block in blocks):
        program("git")
    log = folder.parent / f"{page.stem}.log"
    with log.open("wb") as stream:
        shell = subprocess.Popen(
            [program("bash"), "-c", as_script(blocks)], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
            stdout=stream, start_new_session=True,
        )  # fmt: skip
        try:
            status: int | None = shell.wait(timeout_s)
        except subprocess.TimeoutExpired:
            status = None
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(shell.pid, signal.SIGKILL)  # what the guide has left running
            shell.wait()
    printed = log.read_text(encoding="utf-8", errors="replace")
    outputs: dict[int, str] = {}
    for part in printed.split(_MARK)[1:]:
        number, _, text = part.partition("\n")
        outputs[int(number)] = text
    last = blocks[max(outputs, default=0)]
    how = f"took more than {timeout_s:g} s" if status is None else f"ended with status {status}"
    assert status == 0, f"{page.name}, line {last.line}: {how}\n{last.content}\n--- printed:\n{printed[-3000:]}"
    return [
        (block, block.content, outputs[number - 1])
        for number, block in enumerate(blocks)
        if block.language == "text" and not block.file
    ]
