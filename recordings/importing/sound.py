"""WAV files: whole numbers become parts of full scale, -1 to 1; what that is in volts only a mapping can say."""

import warnings
from pathlib import Path

import numpy as np
import scipy.io.wavfile

from recordings.errors import InputError
from recordings.importing.signals import Signal, check_size, columns_of
from recordings.reader import open_input


def read_sound(path: Path) -> list[Signal]:
    """Every channel of a sound file.

    Raises
    ------
    InputError
        If it is no WAV file that scipy reads.
    """
    check_size(path, "", path.stat().st_size)
    try:
        with open_input(path) as stream, warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # of chunks that are not samples
            rate, samples = scipy.io.wavfile.read(stream)
    except Exception as error:  # scipy lets through whatever a broken file provokes
        raise InputError(path, "", f"not a WAV file that scipy can read: {str(error)[:120]}") from error
    full = 1.0
    if samples.dtype.kind == "u":
        samples, full = samples.astype(np.float64) - 128.0, 128.0
    elif samples.dtype.kind == "i":
        full = float(1 << (8 * samples.dtype.itemsize - 1))
    if not rate or (samples.ndim == 2 and samples.shape[0] < samples.shape[1]):
        raise InputError(path, "", f"has {samples.shape[0]} samples at {rate} Hz")
    named = columns_of(path.stem, samples)
    return [Signal(name=name, values=each / full, table="", sample_rate_Hz=float(rate)) for name, each in named]
