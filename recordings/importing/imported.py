"""Foreign files put together as one run: which column is the time, which are channels, in which unit."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from recordings.container.metadata import run_record
from recordings.convert.blocks import device_from_rows, to_float32
from recordings.errors import InputError, blamed_on
from recordings.importing.files import read_files
from recordings.importing.labels import channel_name, is_time
from recordings.importing.mapping import ChannelMapping, Mapping, MappingQuestion, parse_sensitivity, write_mapping
from recordings.importing.signals import Signal
from recordings.importing.steps import found_steps
from recordings.importing.time_axis import TimeAxis, axis_of
from recordings.quantities import follows_excitation, known_quantities, quantity, quantity_of_unit
from recordings.run import Channel, DeviceSamples, Run

LEAST_RATE_Hz = 10.0
"""Below this a time without a unit is not taken for seconds: nobody shakes a structure so slowly."""


@dataclass(frozen=True)
class Imported:
    """A run made of foreign files, and what people should know of it."""

    run: Run
    notes: tuple[str, ...]


def import_files(paths: Sequence[Path], mapping: Mapping, *, ask: Path) -> Imported:
    """Read files as one run; every table of them is a device.

    Parameters
    ----------
    paths
        At least one.
    mapping
        What is known of them beside what they say.
    ask
        Where a mapping to be filled in is written, if something is not known.

    Raises
    ------
    InputError
        If a file cannot be read, contradicts itself, or does not say something that a recording needs; then `ask` is
        there, and named.
    """
    signals = read_files(paths, mapping)
    source = paths[0] if len(paths) == 1 else f"{paths[0]} and {len(paths) - 1} more"
    reading = _Reading(source, signals, mapping)
    if reading.questions:
        write_mapping(ask, mapping, reading.columns, reading.questions)
        asked = reading.questions[0]
        place = f"column {asked.column!r:.60}" if asked.column else ""
        more = f" and {len(reading.questions) - 1} more" if len(reading.questions) > 1 else ""
        raise InputError(source, place, asked.why, f"fill in '{asked.field}'{more} in {ask}, and run the command again")
    return reading.imported()


class _Reading:
    """One import: what is known and what is not."""

    def __init__(self, source: Path | str, signals: Sequence[Signal], mapping: Mapping) -> None:
        self._source, self._mapping = source, mapping
        self.questions: list[MappingQuestion] = []
        self.notes: list[str] = []
        self._tables: dict[tuple[str, int], list[Signal]] = {}
        for each in signals:
            self._tables.setdefault((each.table, len(each.values)), []).append(each)
        self._axes = {key: self._axis(table) for key, table in self._tables.items()}
        listed = {each.column: each for each in mapping.channel}
        missing = [name for name in listed if name not in {each.name for each in signals}]
        if missing:
            there = ", ".join(each.name for each in signals)[:160]
            raise InputError(source, f"column {missing[0]!r:.60}", "is not in the file", f"there are {there}")
        self._channels = [
            (each, listed.get(each.name) or self._guess(each))
            for table in self._tables.values()
            for each in table
            if (each.name in listed if listed else not self._is_aside(each))
        ]
        if not self._channels:
            raise InputError(source, "", "has no columns that could be channels")
        self.columns = [channel for _, channel in self._channels]
        self._ask_for_units()

    def _is_aside(self, signal: Signal) -> bool:
        """Whether a column is a time, or only counts the rows, or is empty."""
        if signal.values.dtype.kind == "M" or is_time(signal.name, signal.unit) or signal.name == self._mapping.time:
            return True
        steps = np.diff(signal.values)
        counts = not signal.unit and len(steps) > 1 and bool(np.all(steps == 1))
        if counts or not np.isfinite(signal.values).any():
            self.notes.append(f"{signal.name} is left out: it {'counts the rows' if counts else 'is empty'}")
            return True
        return False

    def _axis(self, table: Sequence[Signal]) -> TimeAxis | None:
        """When a table's samples were taken; None, and a question, if that is not known."""
        count, mapping = len(table[0].values), self._mapping
        times = [
            each
            for each in table
            if (
                each.name == mapping.time
                if mapping.time
                else each.values.dtype.kind == "M" or is_time(each.name, each.unit)
            )
        ]
        if len(times) > 1 and any(not np.array_equal(each.values, times[0].values) for each in times[1:]):
            names = " and ".join(repr(each.name) for each in times[:3])
            self.questions.append(MappingQuestion(field="time", why=f"has {len(times)} columns of time: {names}"))
            return None
        start_ns = next((each.start_ns for each in table if each.start_ns is not None), 0)
        rate = mapping.sample_rate_Hz or next((each.sample_rate_Hz for each in table if each.sample_rate_Hz), None)
        if times and mapping.sample_rate_Hz is None:
            unit = mapping.time_unit or times[0].unit
            with blamed_on(self._source, f"column {times[0].name!r:.60}"):
                axis = axis_of(times[0].values, unit)
            if not unit and axis.sample_rate_Hz < LEAST_RATE_Hz and times[0].values.dtype.kind != "M":
                why = f"{times[0].name!r:.60} has no unit, and {axis.sample_rate_Hz:g} Hz is no sample rate if it is s"
                self.questions.append(MappingQuestion(field="time_unit", why=why))
            lost = int(axis.number[-1]) + 1 - count
            if lost:
                self.notes.append(f"{lost} samples are missing by the column {times[0].name}")
            return replace(axis, start_ns=axis.start_ns or start_ns)
        if rate is None:
            if all(each.sample_rate_Hz is None for each in table):
                self.questions.append(
                    MappingQuestion(field="sample_rate_Hz", why="has no column of time and no sample rate")
                )
            return None
        if not 1e-3 < rate < 1e9:
            raise InputError(self._source, "", f"a sample rate of {rate:g} Hz")
        return TimeAxis(rate, start_ns, np.arange(count))

    def _guess(self, signal: Signal) -> ChannelMapping:
        return ChannelMapping(
            column=signal.name, name=channel_name(signal.name)[:64], unit=signal.unit, position_m=signal.position_m,
            direction=signal.direction,
        )  # fmt: skip

    def _ask_for_units(self) -> None:
        measured = {}
        for signal, channel in self._channels:
            unit = channel.unit or signal.unit
            known = quantity_of_unit(unit)
            if known is None:
                why = f"has no unit; {_UNITS}" if not unit else f"its unit {unit!r:.20} is not known; {_UNITS}"
                self.questions.append(MappingQuestion(field="unit", why=why, column=signal.name))
            elif channel.sensitivity is None:
                measured[signal.name] = channel.quantity or known[0]
            else:
                measured[signal.name] = "by sensitivity"
        volts = [name for name, each in measured.items() if each == "voltage"]
        useful = [each for each in measured.values() if each == "by sensitivity" or follows_excitation(each)]
        if volts and not useful and not self.questions:
            self.questions += [
                MappingQuestion(field="sensitivity", why="is in volts; write '10.2 mV/g' or '22.4 mV/N'", column=name)
                for name in volts
            ]
        elif volts:
            self.notes.append(
                f"{', '.join(volts)} stay in volts; a 'sensitivity' in a mapping makes them what they measure"
            )

    def imported(self) -> Imported:
        """The run; raises InputError if units or sizes contradict what a recording can hold."""
        channels: dict[str, Channel] = {}
        devices: dict[str, DeviceSamples] = {}
        for number, (key, table) in enumerate(self._tables.items()):
            axis, inside = self._axes[key], {each.name for each in table}
            values = {}
            device = "daq" if len(self._tables) == 1 else f"daq{number + 1}"
            for signal, channel in self._channels:
                if signal.name in inside and axis is not None:
                    made, samples = self._channel(signal, channel, device)
                    if made.name in channels:
                        raise InputError(
                            self._source, f"channel {made.name!r:.60}", "stands twice", "give another 'name'"
                        )
                    channels[made.name], values[made.name] = made, samples
            if values and axis is not None:
                kept = np.flatnonzero(np.any([np.isfinite(each) for each in values.values()], axis=0))
                time_ns = axis.start_ns + np.rint(axis.number * (1e9 / axis.sample_rate_Hz)).astype(np.int64)
                rows = {name: each[kept] for name, each in values.items()}
                made_device = device_from_rows(device, axis.sample_rate_Hz, axis.number[kept], time_ns[kept], rows, {})
                if made_device is not None:
                    devices[device] = made_device
        if not devices:
            raise InputError(self._source, "", "has no samples")
        return self._with_steps(channels, devices)

    def _with_steps(self, channels: dict[str, Channel], devices: dict[str, DeviceSamples]) -> Imported:
        mapping = self._mapping
        target = mapping.target or self._target(channels)
        if target not in channels:
            raise InputError(
                self._source, "target", f"there is no channel {target!r:.60}", f"there are {', '.join(channels)}"
            )
        info = run_record(min(int(each.block_time_ns[0]) for each in devices.values()))
        for name in ("preload_N", "preload_Nm"):
            if (preload := getattr(mapping, name)) is not None:
                info[name] = f"{preload:g}"
        run = Run(path=str(self._source), info=info, channels=channels, devices=devices, steps=(), events=())
        with blamed_on(self._source):
            steps, notes = found_steps(run, mapping.excitation, target)
        procedure = "stepped-sine" if steps[0].frequency_Hz else "broadband"
        info = {**info, "procedure": procedure}
        return Imported(replace(run, info=info, steps=steps), (*self.notes, *notes))

    @staticmethod
    def _target(channels: dict[str, Channel]) -> str:
        """The force; else what follows it, else the first."""
        known = known_quantities()
        ranked = sorted(
            channels.values(),
            key=lambda each: (not known[each.quantity].drives, not follows_excitation(each.quantity)),
        )
        return ranked[0].name

    def _channel(self, signal: Signal, channel: ChannelMapping, device: str) -> tuple[Channel, np.ndarray]:
        """A column in SI units."""
        place = f"column {signal.name!r:.60}"
        found = quantity_of_unit(channel.unit or signal.unit)
        assert found is not None  # else it was asked for
        measured, factor = found
        if channel.sensitivity is not None:
            if measured != "voltage":
                raise InputError(
                    self._source, place, f"has a sensitivity, but its unit {channel.unit!r} is not of volts"
                )
            volts, unit = parse_sensitivity(channel.sensitivity)
            of_unit = quantity_of_unit(unit)
            assert of_unit is not None  # else the mapping was refused
            measured, factor = of_unit[0], of_unit[1] * factor / volts
        wanted = quantity(channel.quantity or measured)
        if wanted.unit != quantity(measured).unit:
            raise InputError(self._source, place, f"is a {wanted.name}, but its unit is that of a {measured}")
        with blamed_on(self._source, place):
            samples = to_float32(signal.values.astype(np.float64) * (channel.scale * factor))
        made = Channel(
            name=channel.name or channel_name(signal.name), quantity=wanted.name, unit=wanted.unit, device=device,
            position_m=channel.position_m, direction=channel.direction,
        )  # fmt: skip
        return made, samples


_UNITS = "N, lbf, m/s^2, g, mm/s2, mm/s, mm, V and others are known"
