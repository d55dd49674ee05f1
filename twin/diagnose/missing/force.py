"""A force of simple terms between ground and one place of the structure: what is fitted where no cause explains."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from twin.arrays import Array
from twin.diagnose.cause import Cause, Parameter, Values
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.limits import LIMITS
from twin.diagnose.missing.terms import TERMS, Term
from twin.diagnose.places import place_at, position, single_point
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification, NonlinearForce

Force = Callable[[Array, Array, Array], Array]

POINTS = 96
THETA = 2 * np.pi * (np.arange(POINTS) + 0.5) / POINTS
"""Half a step off, so that no point lies on the jump of a friction force."""
NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(40)
WEIGHTS = WEIGHTS / WEIGHTS.sum()


def named_law(terms: Sequence[Term]) -> str:
    """The label of a force made of these terms."""
    return " + ".join(term.name for term in terms)


def law_of(label: Mapping[str, str]) -> tuple[Term, ...]:
    """The terms of a label."""
    return tuple(TERMS[name] for name in label["law"].split(" + "))


class LocalForce(Cause):
    """The sum of its terms; one search for each single term, more of them by a label of its own."""

    name = "missing-force"
    summary = "a force between ground and one place of the structure"

    def labels(self, evidence: MeasuredData) -> Sequence[Mapping[str, str]]:
        """One law of a single term each."""
        return tuple({"law": term.name} for term in TERMS.values())

    def parameters(self, evidence: MeasuredData, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """A coefficient for each term, by the term's name, and the place."""
        largest = max(float(np.max(evidence.steps.amplitude_m, initial=0.0)), 1e-5)
        coefficients = []
        for term in law_of(label):
            usual = LIMITS.usual_n / term.size(largest, evidence.reference_omega)
            coefficients.append(
                # Where the structure moves less than at the tip the same force has a far larger coefficient.
                Parameter(
                    name=term.name, scale=usual, lower=-20 * usual, upper=2e3 * usual, null=0.0, starts=(0.1 * usual,)
                )
            )
        return (*coefficients, *position(evidence, label, 12))

    def modification(self, evidence: MeasuredData, label: Mapping[str, str], values: Values) -> ModelModification:
        """A local nonlinear force, its harmonics and linear substitutes by quadrature."""
        force = _summed(law_of(label), values)

        def equivalent(amplitude: Array, omega: Array) -> Array:
            amplitude = np.maximum(amplitude, 1e-12)
            return np.asarray(force_harmonics(force, amplitude, omega, 1)[:, 0] / amplitude)

        local = NonlinearForce(
            row=single_point(place_at(evidence, label, values)),
            equivalent=equivalent,
            harmonics=lambda amplitude, count, omega: force_harmonics(force, amplitude, omega, count),
            random=lambda motion, omega: linear_substitute(force, motion.displacement, motion.velocity, omega),
        )
        return ModelModification(nonlinear=(local,))


def peak_and_fundamental(hypothesis: CauseHypothesis, amplitude: Array, omega: Array) -> tuple[Array, Array]:
    """Largest force within a period (s,), and its complex fundamental (s,), for u = amplitude cos(omega t)."""
    force = _summed(law_of(hypothesis.label), hypothesis.values)
    over_period = force(*_motion(amplitude, omega))
    return np.max(np.abs(over_period), axis=1), force_harmonics(force, amplitude, omega, 1)[:, 0]


def force_harmonics(force: Force, amplitude: Array, omega: Array, count: int) -> Array:
    """Complex harmonics 1 ... count (s, count) of a force f(u, v, a) of the motion u = amplitude cos(omega t)."""
    f = force(*_motion(amplitude, omega))
    return np.asarray(f @ np.exp(-1j * np.outer(THETA, np.arange(1, count + 1))) * (2 / POINTS))


def linear_substitute(force: Force, displacement: float, velocity: float, omega: Array) -> Array:
    """Dynamic stiffness (f,) of the linear force nearest to f(u, v, a) under Gaussian motion of these rms values."""
    still = np.zeros_like(NODES)

    def slope(values: Array, along: Array) -> float:
        return float(WEIGHTS @ (values * along) / (WEIGHTS @ along**2))

    u, v = max(displacement, 1e-12) * NODES, max(velocity, 1e-12) * NODES
    k, c, m = (
        slope(force(u, still, still), u),
        slope(force(still, v, still), v),
        slope(force(still, still, NODES), NODES),
    )
    return np.asarray(k + 1j * omega * c - omega**2 * m)


def _summed(terms: Sequence[Term], values: Values) -> Force:
    """The terms' sum as a function of u, v, a."""

    def force(u: Array, v: Array, a: Array) -> Array:
        return sum((values[term.name] * term.force(u, v, a) for term in terms), np.zeros(np.shape(u)))

    return force


def _motion(amplitude: Array, omega: Array) -> tuple[Array, Array, Array]:
    """Displacement, velocity and acceleration (s, POINTS) over a period of u = amplitude cos(omega t)."""
    A, w = amplitude[:, None], omega[:, None]
    return A * np.cos(THETA), -A * w * np.sin(THETA), -A * w**2 * np.cos(THETA)
