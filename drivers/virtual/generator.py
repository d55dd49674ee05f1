"""The generator's half of the instrument: what it puts out, set by SCPI."""

from dataclasses import replace

from drivers.scpi import Boolean, Choice, Instrument, Integer, Number, ScpiError, command
from drivers.virtual.feed import SampleFeed
from recordings.streams import Excitation

AMPLIFIER_V = 10.0
"""Full scale of the output, as of most generators that drive a shaker's amplifier."""


class Generator(Instrument):
    """Sine, noise or multisine; all settings of one message hold from the same sample.

    Parameters
    ----------
    feed
        What the output drives.
    drive_limit_V
        Amplitude that no client can pass.
    """

    def __init__(self, feed: SampleFeed, *, drive_limit_V: float = AMPLIFIER_V) -> None:
        super().__init__()
        self._feed = feed
        self._drive_limit_V = drive_limit_V
        self._output_on = False
        self._excitation = Excitation(kind="sine", frequency_Hz=100.0)
        self._applied = Excitation()
        self._effective = (0, 0)

    @property
    def stream_origin(self) -> int:
        """The sample that a client counts as 0."""
        return 0

    def reset(self) -> None:
        """Off, with defaults."""
        self._output_on = False
        self._excitation = Excitation(kind="sine", frequency_Hz=100.0)

    def switch_off(self) -> None:
        """Output to zero without the source, which has failed; settings stay."""
        self._output_on = False
        self._applied = Excitation()

    def end_message(self) -> None:
        """Apply the generator's settings of one message at one sample."""
        wanted = self._excitation if self._output_on else Excitation()
        if wanted != self._applied and not self._feed.failure:
            self._effective = self._feed.schedule_output(wanted)
            self._applied = wanted

    def _set(self, **changes: object) -> None:
        self._excitation = replace(self._excitation, **changes)  # type: ignore[arg-type]

    @command("[SOURce:]FUNCtion[:SHAPe]", Choice(("SINusoid", "RANDom", "MULTisine")))
    def _set_function(self, name: str) -> None:
        """Sine; Gaussian noise in a band; or equally high sines at all multiples of 1/period in that band."""
        self._set(kind={"SIN": "sine", "RAND": "random", "MULT": "multisine"}[name])

    @command("[SOURce:]FUNCtion[:SHAPe]?")
    def _get_function(self) -> str:
        """SIN, RAND or MULT."""
        return {"sine": "SIN", "random": "RAND"}.get(self._excitation.kind, "MULT")

    @command("[SOURce:]FREQuency[:CW]", Number(minimum=1e-3, maximum=1e5, unit="Hz"))
    def _set_frequency(self, value: float) -> None:
        """Frequency of the sine; changes without a jump of phase."""
        self._set(frequency_Hz=value)

    @command("[SOURce:]FREQuency[:CW]?")
    def _get_frequency(self) -> float:
        """In Hz."""
        return self._excitation.frequency_Hz

    @command("[SOURce:]VOLTage[:LEVel][:AMPLitude]", Number(minimum=0.0, maximum=AMPLIFIER_V, unit="V"))
    def _set_voltage(self, value: float) -> None:
        """Peak value of the sine, rms value of noise and multisine."""
        if value > self._drive_limit_V:
            raise ScpiError(-222, f"this instrument's drive limit is {self._drive_limit_V:g} V")
        self._set(amplitude_V=value)

    @command("[SOURce:]VOLTage[:LEVel][:AMPLitude]?")
    def _get_voltage(self) -> float:
        """In V."""
        return self._excitation.amplitude_V

    @command(
        "[SOURce:]NOISe:BAND",
        Number(minimum=0.0, maximum=1e5, unit="Hz"),
        Number(minimum=0.0, maximum=1e5, unit="Hz"),
    )
    def _set_band(self, low: float, high: float) -> None:
        """Lower and upper end of the noise, and of the multisine's lines."""
        if not low < high:
            raise ScpiError(-224, "the band's upper end is not above its lower one")
        self._set(band_Hz=(low, high))

    @command("[SOURce:]NOISe:BAND?")
    def _get_band(self) -> tuple[float, float]:
        """In Hz."""
        return self._excitation.band_Hz

    @command("[SOURce:]NOISe:SEED", Integer(maximum=2**63 - 1))
    def _set_seed(self, value: int) -> None:
        """Seed of the noise, and of the multisine's phases."""
        self._set(seed=value)

    @command("[SOURce:]NOISe:SEED?")
    def _get_seed(self) -> int:
        """The seed."""
        return self._excitation.seed

    @command("[SOURce:]MULTisine:PERiod", Number(minimum=1e-3, maximum=100.0, unit="s"))
    def _set_period(self, value: float) -> None:
        """After which the multisine repeats."""
        self._set(period_s=value)

    @command("[SOURce:]MULTisine:PERiod?")
    def _get_period(self) -> float:
        """In s."""
        return self._excitation.period_s

    @command("OUTPut[:STATe]", Boolean())
    def _set_output(self, on: bool) -> None:
        """Switch the generator; it and the settings of the same line hold from the same sample."""
        if on and self._feed.latched:
            raise ScpiError(-221, f"{self._feed.failure}; OUTP:PROT:CLE first")
        self._output_on = on

    @command("OUTPut[:STATe]?")
    def _get_output(self) -> bool:
        """Whether it is on."""
        return self._output_on

    @command("OUTPut:EFFective?")
    def _get_effective(self) -> tuple[int, int]:
        """Sample of the stream, and time in ns, from which the latest change of the output holds."""
        self.end_message()
        index, time_ns = self._effective
        return index - self.stream_origin, time_ns
