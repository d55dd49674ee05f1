"""The rig's twin: structure, joint, bench, procedures, identification, diagnosis and views.

In a notebook or a script::

    import twin

    rig = twin.load_rig("steel-lap-joint")
    rehearsal = rig.rehearse("steel-sweeps")
    model = rig.identify(["random.mcap", "sweeps.mcap"])
    model.plot_law()
    found = rig.diagnose(["random.mcap", "sweeps.mcap"], held_out=["heldout.mcap"])
    found.plot_residuals()

Results print as tables; figures are matplotlib's.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from twin.kernel_cache import find_cache_place

if TYPE_CHECKING:
    from recordings import InputError
    from twin.diagnose import DiagnosisOptions
    from twin.lab import LabRig, Recording, load_rig, load_run

__all__ = ["DiagnosisOptions", "InputError", "LabRig", "Recording", "load_rig", "load_run"]


find_cache_place()


def __getattr__(name: str) -> Any:
    # Imported when asked for: the command line must start without all of identification.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = {"InputError": "recordings", "DiagnosisOptions": "twin.diagnose"}.get(name, "twin.lab")
    return getattr(import_module(home), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
