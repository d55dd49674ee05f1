"""Packages that most people do not need, and are installed when they are asked for."""

import importlib
from pathlib import Path
from typing import Any

from recordings.errors import InputError


def extra(module: str, path: Path, *, of: str = "import") -> Any:
    """A module of the extra `of`; raises InputError with what to install if it is missing."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        remedy = f"pip install 'virtual-test-rig[{of}]'"
        raise InputError(path, "", f"needs {module}, which is not installed", remedy) from error
