"""The studies by name, imported when they are asked for."""

import importlib
from collections.abc import Callable

from studies.reproduction import Reproduction
from studies.tables import load_study

SEED = 11
"""Of the nonlinear sweeps' noise."""

STUDY_NAMES = ("steel-lap-joint", "composite-beam", "hybrid-joint")


def reproduce(name: str, *, sweeps: bool = True, report: Callable[[str], None] = lambda text: None) -> Reproduction:
    """Recompute one study, see :data:`STUDY_NAMES`.

    Parameters
    ----------
    sweeps
        Also the nonlinear ones, where the paper has any: recorded on the bench, which takes half a minute a preload.
    report
        Told what is being done.

    Raises
    ------
    KeyError
        If there is no such study.
    """
    if name not in STUDY_NAMES:
        raise KeyError(name)
    module = importlib.import_module(f"studies.{name.replace('-', '_')}")
    result = getattr(module, f"reproduce_{name.replace('-', '_')}")()
    assert isinstance(result, Reproduction)
    study = load_study(name)
    if not sweeps or study.sweeps is None:
        return result
    from studies.nonlinear_sweeps import reproduce_sweeps
    from twin.rigs import load_rig

    return reproduce_sweeps(study, load_rig(name), seed=SEED, report=report).added_to(result)
