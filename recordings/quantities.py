"""The one table of quantities: what a channel may measure, in which unit, and what else goes with it.

Everything that knows one quantity from another asks this table: recordings and their metadata, files of other programs,
the devices' descriptions, the bench's transducers, identification and the pictures.  A quantity from outside is an
entry point of the group ``twin.quantities`` in an installed package, a :class:`Quantity`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import entry_points
from typing import Literal

from recordings.errors import InputError

GROUP = "twin.quantities"
STANDARD_GRAVITY = 9.80665
INCH, FOOT = 0.0254, 0.3048
POUND_FORCE = 0.45359237 * STANDARD_GRAVITY
"""By definition, in SI units."""
_SPELT = str.maketrans({"²": "2", "^": "", "*": "", "·": "", "µ": "u", "μ": "u", " ": ""})
NO_CODE = 255
"""On the bus, of what is none of the table's."""


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """What a channel may measure."""

    name: str
    """In rig files, recordings and device descriptions."""
    unit: str
    """SI, as recordings say it."""
    code: int
    """On the CAN bus, 0 to 254; from 128 on for quantities from outside."""
    spellings: Mapping[str, float] = field(default_factory=dict)
    """Other labels of units as :func:`quantity_of_unit` compares them, with the factor to `unit`; in lower case but
    where milli and mega would be the same then."""
    reads: Literal["", "displacement", "strain"] = ""
    """What of a structure's motion it is: the displacement of a place or the strain of a beam's surface; empty for
    what is no motion."""
    derivative: int = 0
    """How many times that is derived by time, 0 to 2."""
    drives: bool = False
    """Whether it is what excites the structure."""
    slow: bool = False
    """Whether meters read it now and then, as they do temperature and preload."""
    pictured: str = ""
    factor: float = 1.0
    """Unit of what it `reads` in pictures, and its factor from SI: millimetres, micrometres per metre."""
    per_force: str = ""
    """Name of such a response per force; empty where there is none."""
    column: str = ""
    """Name of a table's column; empty where tables know it not."""
    uff: int = 0
    """Specific data type of universal files, 0 for unknown."""
    letter: str = ""
    """Of SEP-0005; empty where it has none."""


QUANTITIES = (
    Quantity(
        name="force", unit="N", code=0, drives=True, uff=13, letter="f",
        spellings={
            "newton": 1.0, "newtons": 1.0, "mN": 1e-3, "kn": 1e3, "MN": 1e6, "lbf": POUND_FORCE, "lb": POUND_FORCE,
            "lbs": POUND_FORCE, "ozf": POUND_FORCE / 16, "kip": 1e3 * POUND_FORCE, "kgf": STANDARD_GRAVITY,
            "kp": STANDARD_GRAVITY, "dyn": 1e-5,
        },
    ),
    Quantity(
        name="acceleration", unit="m/s^2", code=1, derivative=2, uff=12, letter="a", per_force="accelerance",
        spellings={
            "m/s/s": 1.0, "mm/s2": 1e-3, "cm/s2": 1e-2, "in/s2": INCH, "ft/s2": FOOT, "g": STANDARD_GRAVITY,
            "gn": STANDARD_GRAVITY, "mg": 1e-3 * STANDARD_GRAVITY,
        },
        column="acceleration_m_per_s2",
        reads="displacement", pictured="mm", factor=1e3,
    ),
    Quantity(
        name="velocity", unit="m/s", code=2, derivative=1, uff=11, letter="v", per_force="mobility",
        spellings={"um/s": 1e-6, "mm/s": 1e-3, "cm/s": 1e-2, "in/s": INCH, "ips": INCH, "ft/s": FOOT},
        column="velocity_m_per_s", reads="displacement", pictured="mm", factor=1e3,
    ),
    Quantity(
        name="displacement", unit="m", code=3, derivative=0, uff=8, letter="d", per_force="receptance",
        spellings={
            "nm": 1e-9, "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "in": INCH, "inch": INCH, "mil": 1e-3 * INCH, "ft": FOOT,
        },
        column="displacement_m", reads="displacement", pictured="mm", factor=1e3,
    ),
    Quantity(name="voltage", unit="V", code=4, spellings={"uv": 1e-6, "mv": 1e-3, "volt": 1.0, "volts": 1.0}),
    Quantity(name="current", unit="A", code=5, spellings={"ma": 1e-3}),
    Quantity(name="temperature", unit="degC", code=6, spellings={"°c": 1.0, "celsius": 1.0}, slow=True, uff=5),
    Quantity(name="preload", unit="N", code=7, slow=True),
    Quantity(
        name="strain", unit="m/m", code=8, reads="strain", pictured="µm/m", factor=1e6, uff=3,
        spellings={"um/m": 1e-6, "microstrain": 1e-6, "ue": 1e-6, "uε": 1e-6, "strain": 1.0},
    ),
)  # fmt: skip
"""In the order of their codes."""


@cache
def known_quantities() -> Mapping[str, Quantity]:
    """All quantities by name, those of installed packages last.

    Raises
    ------
    InputError
        If an installed package brings what is no quantity, or one whose name or code is taken.
    """
    known = {one.name: one for one in QUANTITIES}
    for point in entry_points(group=GROUP):
        one = point.load()
        where = (point.value, GROUP)
        if not isinstance(one, Quantity):
            raise InputError(*where, "is not a recordings.quantities.Quantity")
        if one.name in known or one.code in {other.code for other in known.values()} or not 0 <= one.code < NO_CODE:
            raise InputError(*where, f"{one.name!r} with code {one.code}: name or code is taken, or no code at all")
        if one.derivative not in (0, 1, 2):
            raise InputError(*where, f"{one.name!r} is derivative {one.derivative}; there are 0, 1 and 2")
        known[one.name] = one
    return known


def quantity(name: str) -> Quantity:
    """The quantity of that name.

    Raises
    ------
    ValueError
        If there is none.
    """
    known = known_quantities()
    if name not in known:
        raise ValueError(f"quantity is {name!r:.80}, not one of {', '.join(known)}")
    return known[name]


def is_response(name: str) -> bool:
    """Whether channels of this quantity show the structure's answer to a force; False for one that nobody knows."""
    found = known_quantities().get(name)
    return found is not None and bool(found.reads)


def is_motion(name: str) -> bool:
    """Whether it is a displacement or one of its derivatives."""
    found = known_quantities().get(name)
    return found is not None and found.reads == "displacement"


def follows_excitation(name: str) -> bool:
    """Whether a sine of force shows in channels of this quantity as one."""
    found = known_quantities().get(name)
    return found is not None and (bool(found.reads) or found.drives)


def quantity_of_code(code: int) -> str:
    """Name of the quantity of a code on the bus; ``unknown`` if there is none."""
    return next((one.name for one in known_quantities().values() if one.code == code), "unknown")


def quantity_of_unit(label: str) -> tuple[str, float] | None:
    """The first quantity that a unit's label means, and the factor to its unit; None if there is none.

    ``m/s^2``, ``m/s²``, ``m/s**2`` and ``m_per_s2`` are one, and so are small and capital letters wherever that leaves
    no doubt.
    """
    spelt = label.strip().replace("_per_", "/").replace(" per ", "/").translate(_SPELT)
    for each in (spelt, spelt.lower()):
        for one in known_quantities().values():
            if each in (own := one.unit.translate(_SPELT), own.lower()):
                return one.name, 1.0
            if each in one.spellings:
                return one.name, one.spellings[each]
    return None
