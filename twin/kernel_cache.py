"""A place for compiled kernels: beside the package, where numba puts them, they would outlive it.

A folder that an uninstalled package leaves behind with files in it hides another installation of the same name.
"""

import hashlib
import os
import sys
import tempfile
from pathlib import Path

CALLED_ELSEWHERE = (
    "bench/*.py",
    "identify/jenkins.py",
    "identify/nonlinear/*.py",
    "identify/slipping_kernel.py",
    "joint/*.py",
    "response/*.py",
)
"""Sources whose kernels are compiled into those of other files."""


def find_cache_place() -> None:
    """Name a folder for numba's cache; one that is set already is kept.

    There is one for every state of the sources: numba compiles a kernel anew when its own file changes, but not when a
    kernel does that it calls.

    It lies in the virtual environment, whose end is its own, else in the user's cache.  Where neither takes files, it
    lies among the temporary ones: it then belongs to this user alone, since what is in it is run, and is the same for
    every process of the user; where somebody else has taken its name, each process compiles for itself.
    """
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    user_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    places = [user_cache] if sys.prefix == sys.base_prefix else [Path(sys.prefix) / "var" / "cache", user_cache]
    state = state_of_sources(Path(__file__).parent)
    for place in places:
        if _takes_files(folder := place / "virtual-test-rig" / state):
            os.environ["NUMBA_CACHE_DIR"] = str(folder)
            return
    own = Path(tempfile.gettempdir()) / f"virtual-test-rig-kernels-{os.getuid()}-{state}"
    own.mkdir(mode=0o700, exist_ok=True)
    found = own.lstat()
    private = own.is_dir() and not own.is_symlink() and found.st_uid == os.getuid() and not found.st_mode & 0o077
    os.environ["NUMBA_CACHE_DIR"] = str(own) if private else tempfile.mkdtemp(prefix=f"{own.name}-")


def state_of_sources(package: Path) -> str:
    """Short hash of the sources whose kernels are called from elsewhere."""
    state = hashlib.sha256()
    for sources in CALLED_ELSEWHERE:
        for path in sorted(package.glob(sources)):
            state.update(path.read_bytes())
    return state.hexdigest()[:12]


def _takes_files(folder: Path) -> bool:
    """Whether a file can be written there, which alone tells of a read-only file system or a strange owner."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except (OSError, RuntimeError):
        return False
