"""What a diagnosis of tables assumes and decides by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Figures of the rules in the files that the comments name."""

    # lap_joint.py
    moduli_std: float = 0.3
    """Of the logarithms of E' and G': a layer's moduli are known from its frequencies, and hardly before them."""

    # measured.py
    assumed_std: float = 1e-3
    """Relative standard deviation of a frequency whose table gives none: bolted structures repeat to about 0.1 %."""
    model_std: float = 1e-4
    """What a mesh and rounded lengths do to any frequency, relative; added to whatever a table states."""

    # moduli.py
    unknown_std: float = 10.0
    """Standard deviation of the moduli's logarithms beforehand: the frequencies alone decide, and none runs off."""
    moduli_followed: int = 3
    moduli_rescans: int = 2
    """Places of the grid from which fits begin, and how often it is laid about the best."""

    # nominal_masses.py
    light_sensor_kg: float = 0.002
    """Mass of a miniature accelerometer."""

    # order_in_time.py
    confounded_order: float = 0.9
    """Rank correlation of amplitude with order in time beyond which a drift and a law of amplitude look alike."""
    most_order: int = 4
    """Highest order of the law beside which a drift or a jump is looked for."""
    least_deviations: float = 4.0
    """Standard deviations that a drift or a jump must have."""

    # search.py
    rival_log_evidence: float = 5.0
    """A rival whose log evidence lies no more than this below the best cannot be told from it."""
    least_gain: float = 5.0
    """Log evidence that a cause must gain: about a dozen are tried, and chance favours one of them now and then."""
    needed_gain: float = 3.0
    """The same where the data contradict the model without it, so that something must be named."""
    search_places: int = 5
    """Places of a cause that are refitted, out of all that are scored."""
    search_fine: float = 1e-3
    """Tolerance of fits that are compared by their evidence."""
    search_factors: tuple[float, ...] = (0.5, 0.65, 0.8, 1.25, 1.6, 2.2)
    """Of each assumed modulus, where fits of the moduli alone begin as well."""
    search_along: tuple[float, ...] = (-6.0, -4.0, -3.0, -2.0, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
    """Where about the best place the evidence is taken, in its standard deviations."""
    least_freedom: float = 0.5
    """Degrees of freedom that a model must leave: with fewer, the data could not have contradicted it."""

    # single_beam.py
    modulus_std: float = 0.5
    """Of the modulus' logarithm: laminates differ from their data sheets by such factors."""
    weak_section: float = 0.025
    """Length of a weak section over the beam's."""

    # sweeps.py
    most_steps: int = 20_000
    most_sweeps: int = 60
    """Beyond them a table is hardly one of stepped sines, and the fit takes minutes."""
    sweeps_held: float = 0.2
    """How far the response may stray from its median within a sweep that holds it."""


LIMITS = Limits()
