"""What a command says on standard error beside the stages of its work, which show where a machine is slow."""

import re

_STAGE = re.compile(r" *\d+\.\d s  ")


def said_beside_stages(said: str) -> list[str]:
    """The lines that tell no stage."""
    return [line for line in said.splitlines() if line.strip() and not _STAGE.match(line)]
