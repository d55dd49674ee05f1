"""A place for compiled kernels: numba stops with an error where neither the package nor the user can keep them."""

import os
import tempfile
from pathlib import Path


def find_cache_place() -> None:
    """Name a folder for numba's cache where it would have none; one that is set already is kept.

    The folder lies among the temporary files, belongs to this user alone, since what is in it is run, and is the same
    for every process of the user; where somebody else has taken its name, each process compiles for itself.
    """
    user_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    if "NUMBA_CACHE_DIR" in os.environ or _takes_files(Path(__file__).parent) or _takes_files(user_cache / "numba"):
        return
    own = Path(tempfile.gettempdir()) / f"virtual-test-rig-kernels-{os.getuid()}"
    own.mkdir(mode=0o700, exist_ok=True)
    found = own.lstat()
    private = own.is_dir() and not own.is_symlink() and found.st_uid == os.getuid() and not found.st_mode & 0o077
    os.environ["NUMBA_CACHE_DIR"] = str(own) if private else tempfile.mkdtemp(prefix=f"{own.name}-")


def _takes_files(folder: Path) -> bool:
    """Whether a file can be written there, which alone tells of a read-only file system or a strange owner."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except (OSError, RuntimeError):
        return False
