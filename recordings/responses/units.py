"""Units of frequency responses: a label or a type code for the response and for the force, to SI."""

from recordings.quantities import known_quantities, quantity, quantity_of_unit


def factor_of_label(label: str) -> tuple[str, float]:
    """Quantity of the response and factor to SI of a unit such as ``g/N``, ``(m/s^2)/N`` or ``in/s^2/lbf``.

    Raises
    ------
    ValueError
        If it is no response per force.
    """
    above, slash, below = label.strip().rpartition("/")
    if not slash:
        raise ValueError(f"unit {label!r:.40} is no response per force, such as (m/s^2)/N")
    return factor_of_labels(above, below)


def factor_of_labels(response: str, force: str) -> tuple[str, float]:
    """The same of two labels.

    Raises
    ------
    ValueError
        If the first is no motion, or the second no force.
    """
    above, below = (quantity_of_unit(label.strip().strip("()")) for label in (response, force))
    if above is None or quantity(above[0]).reads != "displacement":
        raise ValueError(f"unit {response!r:.40} is none of a displacement, a velocity or an acceleration")
    if below is None or not known_quantities()[below[0]].drives:
        raise ValueError(f"unit {force!r:.40} is none of a force")
    return above[0], above[1] / below[1]
