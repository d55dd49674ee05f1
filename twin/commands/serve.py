"""`twin serve`: the virtual instruments of a rig."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import click

from recordings.errors import InputError, blamed_on
from twin.commands.common.options import causes_option, json_option, laws_option
from twin.commands.common.serving import Serving, address_options, serve_source

if TYPE_CHECKING:
    from recordings.streams import SampleSource
    from twin.rigs import Rig

STEEL_SOFTENING_per_K = 3e-4
"""How much Young's modulus of structural steel falls by, relatively, for each kelvin near room temperature; typical."""
_NEWTON = re.compile(r"\d+(\.\d+)?N")


@click.command()
@click.option("--rig", "rig_name", required=True, metavar="RIG", help="A shipped rig's name or a TOML file.")
@click.option(
    "--commands",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=lambda context, _, wanted: _print_commands(context) if wanted else None,
    help="Print the instruments' manual (SCPI commands, errors, frames, CAN messages), and leave.",
)
@click.option("--preload", metavar="NAME", help="State of the joint; the rig's first if left out.")
@click.option("--drive", metavar="NAME", help="Which of the rig's drives is connected; the first if left out.")
@click.option("--hammer", metavar="PROCEDURE", help="An impact procedure: the rig is hit as it says, without a shaker.")
@click.option("--meter", metavar="auto|PATH|HOST:PORT", help="A slow SCPI meter of preload and temperature.")
@address_options
@causes_option
@laws_option
@json_option
def command(
    rig_name: str, preload: str | None, drive: str | None, hammer: str | None, meter: str | None, serving: Serving,
    as_json: bool,
) -> None:  # fmt: skip
    """Serve the virtual instruments of a rig over serial, TCP and CAN, until SIGINT or SIGTERM.

    Their addresses are printed as JSON lines when they are ready.
    """
    from recordings.streams import Excitation
    from twin.bench import open_bench
    from twin.procedures import Impact, load_procedure
    from twin.rehearsal import open_twin
    from twin.rigs import known_preload, load_rig

    rig = load_rig(rig_name).driven_by(drive)
    name, seed = known_preload(rig, preload), serving.seed
    hits = load_procedure(hammer) if hammer is not None else None
    if hammer is not None and not isinstance(hits, Impact):
        raise InputError(hammer, "procedure", "is no impact test", "give one of hits, or leave --hammer out")

    def open_source() -> SampleSource:
        if hits is not None:
            open_twin(rig, hits, preload=name, seed=seed, source=rig_name).read(64)
            return open_twin(rig, hits, preload=name, seed=seed, source=rig_name)
        with blamed_on(rig_name):
            # The first samples of a fresh installation compile the kernels, longer than any client waits: do it now.
            rehearsed = open_bench(rig, preload=name, seed=seed)
            rehearsed.set_output(Excitation(kind="sine", amplitude_V=0.1, frequency_Hz=20.0))
            rehearsed.read(64)
            return open_bench(rig, preload=name, seed=seed)

    slow = JointMeter(rig, name) if meter is not None else None
    serve_source(open_source, serving, origin="simulated", as_json=as_json, meter=meter, slow=slow)


class JointMeter:
    """Preload and temperature behind a virtual meter: a :class:`recordings.streams.SlowSource`.

    Where the rig's moduli fall with time, what makes them fall shows: the preload, of the joint that loses it, follows
    the layer's normal modulus along the states that the rig file has of it, the temperature follows the moduli as
    steel's do.
    """

    def __init__(self, rig: Rig, preload: str) -> None:
        import numpy as np

        from recordings.run import Channel

        rates = {effect.cause: effect.parameters.get("rate_per_s", 0.0) for effect in rig.effect}
        self._layer_rate = float(rates.get("preload-loss", 0.0)) + rig.drift.preload_loss_per_h / 3600
        self._warming_K_per_s = (
            float(rates.get("temperature-drift", 0.0)) / STEEL_SOFTENING_per_K + rig.drift.temperature_K_per_h / 3600
        )
        lost = [effect.parameters.get("joint") for effect in rig.effect if effect.cause == "preload-loss"]
        own = [joint for joint in rig.joints if not lost or lost[0] in (None, joint.name)][:1]
        states = {
            float(key[:-1]): state.normal_modulus
            for joint in own
            for key, state in joint.preload.items()
            if _NEWTON.fullmatch(key)
        }
        self.channels = [Channel(name="temperature", quantity="temperature", unit="degC", range=150.0, device="meter")]
        self._preload_N: float | None = None
        if _NEWTON.fullmatch(preload):
            self._preload_N = float(preload[:-1])
            self._modulus = states[self._preload_N]
            forces = np.array(list(states))
            moduli = np.array(list(states.values()))
            # A single state tells no slope: then the preload falls in proportion.
            self._force_per_modulus = (
                float(np.polyfit(moduli, forces, 1)[0]) if len(states) > 1 else self._preload_N / self._modulus
            )
            limit = 2.0 * max(states)
            self.channels.insert(0, Channel(name="preload", quantity="preload", unit="N", range=limit, device="meter"))

    def read(self, time_s: float) -> list[float]:
        """Preload (where it is known as a force), N, and temperature, degC."""
        values = [21.0 + self._warming_K_per_s * time_s]  # a room's
        if self._preload_N is not None:
            lost = self._modulus * self._layer_rate * time_s * self._force_per_modulus
            values.insert(0, max(0.0, self._preload_N - lost))
        return values


def _print_commands(context: click.Context) -> None:
    from drivers.virtual.manual import write_manual

    click.echo(write_manual(), nl=False)
    context.exit()
