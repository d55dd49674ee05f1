"""The twin of a rig that is hit as an impact procedure says."""

import numpy as np

from recordings.directions import unit_vector
from twin.bench import Bench, HammeredBench, Hit, assembled, open_bench
from twin.procedures import Impact
from twin.rehearsal.limits import LIMITS
from twin.rigs import Place, Rig


def point_places(procedure: Impact) -> dict[str, Place]:
    """Where the points of an impact test are, by name."""
    return {point.name: Place(point.part, point.at, unit_vector(point.direction)) for point in procedure.point}


def hammered_twin(rig: Rig, procedure: Impact, *, preload: str, seed: int) -> HammeredBench:
    """One assembly of the rig, at rest, its shaker taken off.

    ValueError if the rig cannot be built, or has no such point.
    """
    rig = assembled(rig, seed=seed)
    places = [*point_places(procedure).values()]
    if procedure.sensor is not None:
        mobile, faces = rig.hit_at(rig.drive_place), rig.place_of(procedure.sensor).direction
        rigs = [mobile.with_moved_sensor(procedure.sensor, place) for place in places if mobile.hit_at(place)]
        for point, place in zip(procedure.point, places, strict=True):
            if not np.allclose(place.direction, faces):
                raise ValueError(f"point {point.name!r}: {procedure.sensor} keeps its direction as it roves")
    else:
        rigs = [rig.hit_at(place) for place in places or [rig.drive_place]]

    def open_at(number: int) -> Bench:
        own_seed = int(np.random.SeedSequence([seed, number]).generate_state(1)[0])
        return open_bench(rigs[number], preload=preload, seed=own_seed, sample_rate_Hz=procedure.sample_rate)

    hammer = procedure.hammer
    chance = np.random.default_rng(hammer.seed)
    scatter = np.clip(chance.standard_normal((len(rigs), procedure.hits)), -2.5, 2.5) * hammer.scatter
    hits = [
        [Hit(peak_N=hammer.peak * (1 + share), rebound=n in hammer.double_hits) for n, share in enumerate(row, first)]
        for first, row in zip(range(1, scatter.size + 1, procedure.hits), scatter, strict=True)
    ]
    return HammeredBench(open_at, hits, width_s=hammer.width, every_s=procedure.record + LIMITS.between_hits_s)
