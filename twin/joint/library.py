"""The library's laws by name, with their parameters in the layer's own units.

A law acts on a point's opening or on its slip: lengths are metres of that coordinate, and its stiffnesses are N/m2, as
the layer's moduli are.  What a law says, it says beyond E' and G' at rest (:class:`twin.joint.named_law.PointForce`).
"""

from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from twin.joint.iwan import iwan
from twin.joint.jenkins_element import jenkins
from twin.joint.knots import loss_of_knots, softening_of_knots
from twin.joint.law import Law
from twin.joint.masing import masing_of_points
from twin.joint.named_law import NamedLaw, Parameter
from twin.joint.polynomial import Polynomial
from twin.joint.power_laws import Cubic
from twin.joint.running_loss import growing_loss
from twin.joint.saturating import Saturating
from twin.joint.slap import PiecewiseLinearContact


def _parameter(unit: str, name: str, about: str, **more: Any) -> Parameter:
    """Above zero unless another lower bound is given."""
    bound: dict[str, Any] = {} if more.keys() & {"above", "least"} else {"above": 0.0}
    return Parameter(name=name, unit=unit, about=about, **bound, **more)


_modulus, _length, _number = (partial(_parameter, unit) for unit in ("N/m2", "m", "1"))
_coefficients = partial(_parameter, "N/m2 per m, m2, ...", above=None, default=[], several=True)


def _iwan(stiffness: float, slips_at: float, exponent: float, sliders: float) -> Law:
    force = stiffness * slips_at * (exponent + 1.0) / (exponent + 2.0)
    return iwan(stiffness, force, sliders=_whole("sliders", sliders), chi=exponent)


def _masing(deflection: list[float], force: list[float]) -> Law:
    _rising("deflection", deflection, beside=("force", force))
    return masing_of_points(np.array([0.0, *deflection]), np.array([0.0, *force]))


def _polynomial(softening: list[float], loss: list[float], reversal: float) -> Law:
    if not softening and not loss:
        raise ValueError("a polynomial needs softening, loss or both")
    if loss and not reversal:
        raise ValueError("loss needs a reversal: the travel over which it changes its sign, which steps must resolve")
    return Polynomial((0.0, *(-c for c in softening)), (0.0, *loss), stick=reversal)


def _mayer_gaul(opened: float, closed: float, pressed: float, gap: float) -> Law:
    if not opened < closed < pressed:
        raise ValueError("the layer stiffens as it closes: opened < closed < pressed")
    # The contact pressure without its constant part, which the preload is.
    return PiecewiseLinearContact(
        (opened, -opened, closed, pressed - closed), (0.0, gap, 0.0, -gap), (1, 1, -1, -1)
    )  # fmt: skip


def _softening_table(amplitude: list[float], softening: list[float]) -> Law:
    _rising("amplitude", amplitude, beside=("softening", softening))
    return softening_of_knots(amplitude, softening)


def _loss_table(amplitude: list[float], loss: list[float]) -> Law:
    _rising("amplitude", amplitude, beside=("loss", loss))
    return loss_of_knots(amplitude, loss)


def _whole(name: str, value: float) -> int:
    if value != int(value):
        raise ValueError(f"{name} is a number of things, not {value:g}")
    return int(value)


def _rising(name: str, knots: list[float], *, beside: tuple[str, list[float]]) -> None:
    other, values = beside
    if len(knots) < 2 or len(values) != len(knots):
        raise ValueError(f"{name} needs two entries or more, and {other} as many")
    if any(after <= before for before, after in pairwise(knots)):
        raise ValueError(f"{name} must increase")


LIBRARY = (
    NamedLaw(
        name="saturating",
        sentence="softens by {softening:.3g} N/m2 as it moves, smoothly, beginning about {begins_at:.3g} m",
        parameters=(
            _modulus("softening", "what large motions take off the modulus"),
            _length("begins_at", "deflection over which it saturates"),
        ),
        make=lambda softening, begins_at: Saturating(softening, begins_at),
    ),
    NamedLaw(
        name="cubic",
        sentence="stiffens with the cube of its motion, by {stiffness:.3g} N/m4",
        parameters=(_parameter("N/m4", "stiffness", "force per cube of the deflection"),),
        make=lambda stiffness: Cubic(stiffness),
    ),
    NamedLaw(
        name="jenkins",
        sentence="slips as one: a spring of {stiffness:.3g} N/m2 whose slider slips at {slips_at:.3g} m",
        parameters=(
            _modulus("stiffness", "of the spring, which is lost while it slips"),
            _length("slips_at", "deflection at which it slips"),
        ),
        make=lambda stiffness, slips_at: jenkins(stiffness, stiffness * slips_at),
    ),
    NamedLaw(
        name="iwan",
        sentence=(
            "slips bit by bit: an Iwan network of {stiffness:.3g} N/m2, all of whose sliders slip at {slips_at:.3g} m "
            "(exponent {exponent:g})"
        ),
        parameters=(
            _modulus("stiffness", "of all springs"),
            _length("slips_at", "deflection at which the last slider slips"),
            _number("exponent", "of the density of slip forces", above=-1.0, most=10.0, default=0.0),
            _number("sliders", "how many stand for it", least=1.0, most=100.0, default=10.0),
        ),
        make=_iwan,
    ),
    NamedLaw(
        name="masing",
        sentence="follows Masing's rule over a backbone of points",
        parameters=(
            _length("deflection", "of the backbone's points after (0, 0), rising", several=True),
            _parameter("N/m", "force", "of these points: modulus times metres", several=True),
        ),
        make=_masing,
    ),
    NamedLaw(
        name="polynomial",
        sentence="softens and loses by polynomials of its amplitude, as the papers have them",
        parameters=(
            _coefficients("softening", "coefficients of the first power on"),
            _coefficients("loss", "likewise, of the loss modulus"),
            _length("reversal", "travel over which the loss changes its sign", least=0.0, default=0.0),
        ),
        make=_polynomial,
    ),
    NamedLaw(
        name="slap",
        sentence="loses contact beyond {gap:.3g} m, and with it {stiffness:.3g} N/m2",
        parameters=(
            _length("gap", "deflection beyond which it has lost contact"),
            _modulus("stiffness", "what is lost there"),
        ),
        make=lambda gap, stiffness: PiecewiseLinearContact((-stiffness,), (gap,), (1,)),
    ),
    NamedLaw(
        name="stop",
        sentence="meets a stop of {stiffness:.3g} N/m2 beyond {gap:.3g} m",
        parameters=(_length("gap", "deflection at which it meets the stop"), _modulus("stiffness", "of the stop")),
        make=lambda gap, stiffness: PiecewiseLinearContact((stiffness,), (gap,), (1,)),
    ),
    NamedLaw(
        name="mayer-gaul",
        sentence=(
            "presses as Mayer and Gaul have it: {opened:.3g} N/m2 open, {closed:.3g} closed, {pressed:.3g} beyond "
            "{gap:.3g} m of closing, nothing beyond {gap:.3g} m of opening"
        ),
        parameters=(
            _modulus("opened", "modulus where it has opened"),
            _modulus("closed", "modulus where it has closed"),
            _modulus("pressed", "modulus where it has closed by more than the gap"),
            _length("gap", "opening at which contact ends"),
        ),
        make=_mayer_gaul,
    ),
    NamedLaw(
        name="running-loss",
        sentence="loses at any rate alike: a loss modulus of {loss:.3g} N/m2, half of it at {reached_at:.3g} m",
        parameters=(
            _modulus("loss", "loss modulus of large motions"),
            _length("reached_at", "amplitude at which half of it is there"),
            _number("power", "of the amplitude, at first", least=1.0, most=10.0, default=4.0),
        ),
        make=growing_loss,
    ),
    NamedLaw(
        name="softening-table",
        sentence="softens over its amplitude as a table says",
        parameters=(
            _length("amplitude", "knots, rising", least=0.0, several=True),
            _modulus("softening", "what is taken off the modulus there", above=None, several=True),
        ),
        make=_softening_table,
    ),
    NamedLaw(
        name="loss-table",
        sentence="loses over its amplitude, at any rate alike, as a table says",
        parameters=(
            _length("amplitude", "knots, rising", least=0.0, several=True),
            _modulus("loss", "loss modulus there", least=0.0, several=True),
        ),
        make=_loss_table,
    ),
)
"""All of them, in the order in which they are told."""
