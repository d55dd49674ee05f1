"""Twenty blind cases of the bench: which of six known masses was removed, from frequency responses of one point alone.

The bench's beam has another modulus, a clamp that yields, sensor, shaker and damping a little elsewhere, and
natural frequencies that scatter by 0.3 % from case to case.  Learnt on responses in closed form with seeds 31 to 43.
"""

import numpy as np
import pytest
from clamped_beam import LAB

from recordings import read_run
from recordings.responses import read_responses
from twin.diagnose import DiagnosisOptions, diagnose_data, responses_data
from twin.exchange import frequency_responses, write_universal
from twin.identify.responses.updating import update_rig
from twin.lab.rig import LabRig

NOISE = 'procedure = "random"\nband = [5.0, 1000.0]\nrms = 2.0\nduration = 30.0\n'
SEEDS, REMOVED, NAMED = range(1, 6), 4, 18
SCATTER = 0.003


def believed():
    """One accelerometer near the tip."""
    sensors = [sensor for sensor in LAB.rig.sensor if sensor.channel != "mid"]
    return LAB.rig.model_copy(update={"sensor": [s.model_copy(update={"noise_density": 5e-4}) for s in sensors]})


def truth(rig, rng):
    (part,), (support,) = rig.part, rig.support
    compliance = abs(0.01 * rng.standard_normal()) * part.length / (part.youngs_modulus * part.second_moment)
    modulus = part.youngs_modulus * (1 + 0.03 * rng.standard_normal())
    drive = rig.drive[0].model_copy(update={"at": rig.drive[0].at + 0.002 * rng.standard_normal()})
    sensors = [
        s.model_copy(update={"at": drive.at if s.quantity == "force" else s.at + 0.002 * rng.standard_normal()})
        for s in rig.sensor
    ]
    ratios = (0.004 * np.exp(0.4 * rng.standard_normal(6))).tolist()
    return rig.model_copy(
        update={
            "part": [part.model_copy(update={"youngs_modulus": modulus})],
            "support": [support.yielding(compliance)],
            "drive": [drive],
            "sensor": sensors,
            "damping": rig.damping.model_copy(update={"modal_ratio": ratios}),
            "natural_frequencies": rig.natural_frequencies.model_copy(update={"scatter": SCATTER}),
        }
    )


def measured(rig, seed, folder):
    """Responses as an analyser would leave them, from a random run of the bench."""
    procedure = folder / "noise.toml"
    procedure.write_text(NOISE)
    out = folder / f"run-{seed}"
    LabRig(source="bench", file=rig).rehearse(procedure, out=out, rounds=0, seed=seed)
    run, file = read_run(out / "run.mcap"), folder / f"{seed}.uff"
    write_universal(frequency_responses(run, resolution_Hz=0.25), file, run=run)
    return read_responses(file)


def cases(seed, folder):
    """What was removed, and what was named."""
    rng = np.random.default_rng(seed)
    rig = believed()
    lab = truth(rig, rng)
    intact = [measured(lab, 1000 * seed + n, folder) for n in range(3)]
    model = update_rig(intact, rig).rig
    for n, number in enumerate(rng.permutation(6)[:REMOVED], 3):
        name = f"m{number + 1}"
        data = responses_data([measured(LAB.without(lab, name), 1000 * seed + n, folder)], model)
        found = diagnose_data(data, out=None, options=DiagnosisOptions())
        first = found.causes[0] if found.causes else None
        named = first is not None and first.in_model and first.cause == "added-mass" and first.parameters.get("mass")
        yield name, named


@pytest.mark.nightly
def test_the_removed_mass_is_named_in_eighteen_of_twenty(tmp_path):
    found = [case for seed in SEEDS for case in cases(seed, tmp_path)]
    assert len(found) == 20
    assert sum(removed == named for removed, named in found) >= NAMED, found
