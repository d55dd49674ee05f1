"""Records campaigns: ``python -m tests.second_bench.campaign --out FOLDER --seeds 1:20 --effect all``."""

from __future__ import annotations

import argparse
import json
import sys
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.second_bench.believed import TRANSDUCERS, rig_text
from tests.second_bench.channels import Wiring
from tests.second_bench.effects import LISTED, UNLISTED, Rig
from tests.second_bench.mechanics.structure import modes_of
from tests.second_bench.plans import Noise, sweeps_of
from tests.second_bench.recorder import Campaign
from tests.second_bench.sizing import sized
from tests.second_bench.unknowns import drawn_specimen

EFFECTS = {**LISTED, **UNLISTED}
TRUTH = "truth.json"
BROADBAND = "broadband.mcap"
WANDERS = (1e-5, 1e-4)
"""Of all resonances from sweep to sweep, relative, as rooms make them wander; drawn in between."""
ALL_STORED = 0.25
"""Share of the campaigns without a drift whose waits are recorded too; with one all are, for time to be known."""


@dataclass(frozen=True)
class Case:
    """One campaign: what is hidden, what decides all that is drawn, and whether resonances wander between sweeps."""

    effect: str
    seed: int
    strength: float = 1.0
    modes: int = 1
    still: bool = False

    @property
    def name(self) -> str:
        """Of its folder."""
        strength = "" if self.strength == 1 else f"-{self.strength:g}"
        modes = "" if self.modes == 1 else f"-modes{self.modes}"
        return f"{self.effect}{strength}-{self.seed}{modes}" + ("-still" if self.still else "")


def recording_names(mode: int) -> tuple[str, str]:
    """Names of the recordings about a mode: the sweeps, and the one that is held out."""
    number = "" if mode == 1 else str(mode)
    return f"sweeps{number}.mcap", f"heldout{number}.mcap"


def record(case: Case, out: Path) -> Path:
    """Record a case into a folder of its own; the truth is written last, and marks that it is whole.

    Parameters
    ----------
    case
        What to record.
    out
        Gets the folder.

    Returns
    -------
    Path
        The case's folder.
    """
    folder = out / case.name
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([case.seed, zlib.crc32(case.effect.encode())])
    sound = Rig(drawn_specimen(rng), {t.channel: Wiring.drawn(rng, t) for t in TRANSDUCERS})
    effect = EFFECTS[case.effect](rng)
    rig, parameters = effect.apply(sound, sized(effect, sound, rng, case.strength))
    stored = "all" if effect.drifts or rng.random() < ALL_STORED else "settled"
    wander = float(np.exp(rng.uniform(*np.log(WANDERS))))
    campaign = Campaign(rig.specimen, rig.wiring, rng, stored, wander=0.0 if case.still else wander)
    (folder / "rig.toml").write_text(rig_text())
    campaign.record_noise(folder / BROADBAND, Noise())
    natural_Hz = modes_of(rig.specimen).omega / (2 * np.pi)
    for mode in range(1, case.modes + 1):
        for name, plan in zip(recording_names(mode), sweeps_of(mode, natural_Hz[mode - 1]), strict=True):
            campaign.record_sweeps(folder / name, plan)
    truth = {
        "cause": "unknown" if case.effect in UNLISTED else case.effect, "effect": case.effect, "parameters": parameters,
        "strength": case.strength, "seed": case.seed, "modes": case.modes, "stored": stored,
        "wander": campaign.wander,
        "layer": {
            "normal_modulus": rig.specimen.layer.normal_modulus, "shear_modulus": rig.specimen.layer.shear_modulus,
        },
        "modal_ratio": rig.specimen.modal_ratio,
        "natural_frequencies_Hz": natural_Hz[:4].tolist(),
    }  # fmt: skip
    (folder / TRUTH).write_text(json.dumps(truth, indent=1) + "\n")
    return folder


def _seeds(text: str) -> range:
    first, _, last = text.partition(":")
    return range(int(first), int(last or first) + 1)


def main() -> None:
    """Record what the command line asks for; whole cases are left as they are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=_seeds, default=range(1, 2), help="one, or FIRST:LAST")
    parser.add_argument("--effect", choices=["all", *EFFECTS], action="append", required=True)
    parser.add_argument("--modes", type=int, choices=[1, 2], default=1)
    parser.add_argument("--strength", type=float, default=1.0)
    parser.add_argument("--still", action="store_true", help="resonances do not wander from sweep to sweep")
    asked = parser.parse_args()
    for seed in asked.seeds:
        for effect in EFFECTS if "all" in asked.effect else asked.effect:
            case = Case(effect, seed, asked.strength, asked.modes, asked.still)
            if not (asked.out / case.name / TRUTH).exists():
                print(record(case, asked.out), file=sys.stderr)


if __name__ == "__main__":
    main()
