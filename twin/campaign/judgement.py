"""Was it right?  One found case beside its truth."""

from dataclasses import replace
from typing import Literal

from twin.campaign.case import CaseResult, in_model

Outcome = Literal["right", "in a set", "partly", "none", "unknown", "wrong", "failed"]
"""``right``: the hidden cause is first; every one is named, if there are several, and nothing, if there is none.

``in a set``: another is first, with a verdict of ``ambiguous`` that lists the hidden one among what it could be.
``partly``: some of several.  ``none`` and ``unknown``: that verdict, though something listed is hidden.  ``wrong``: a
false name.  ``failed``: no diagnosis."""


def judge(result: CaseResult) -> Outcome:
    """The outcome of one case."""
    found = result.found
    if found is None:
        return "failed"
    hidden, named = set(result.plan.causes), [cause["cause"] for cause in result.named]
    if found["verdict"] == "unknown":
        return "unknown"
    if not hidden:
        return "wrong" if named else "right"
    if not named:
        return "none"
    if len(hidden) > 1:
        return "right" if hidden <= set(named) else "partly" if hidden & set(named) else "wrong"
    if named[0] in hidden:
        return "right"
    suspects = {name for cause in result.named for name in cause["confused_with"]}
    return "in a set" if found["verdict"] == "ambiguous" and hidden & (suspects | set(named)) else "wrong"


def resolved(result: CaseResult) -> bool | None:
    """Whether the test that an ambiguous diagnosis proposed brought the hidden causes; None where none was run."""
    if result.followed is None:
        return None
    after = replace(result, found=result.followed)
    return result.followed["verdict"] != "ambiguous" and judge(after) == "right"


def named_first(result: CaseResult) -> str:
    """The cause that was named first, or the verdict where none was."""
    if result.found is None:
        return "failed"
    named = result.named
    return str(named[0]["cause"]) if named else str(result.found["verdict"])


def covered(result: CaseResult) -> list[tuple[str, bool]]:
    """Numeric parameters of the hidden causes that were named: whether the truth lies inside the 95 % interval."""
    out = []
    for effect in result.hidden:
        named = [c for c in in_model(result.found) if c["cause"] == effect["cause"]]
        for name, truth in effect["parameters"].items():
            estimate = named[0]["parameters"].get(name) if named else None
            if isinstance(estimate, dict) and not isinstance(truth, str):
                inside = abs(estimate["value"] - truth) <= 1.96 * estimate["std"]  # 95 %
                out.append((f"{effect['cause']} {name}", bool(inside)))
    return out
