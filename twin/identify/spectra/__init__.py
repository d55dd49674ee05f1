"""Recordings as numbers: spectra and binned responses of broadband runs, harmonics of stepped sines."""

from twin.identify.spectra.broadband import BinnedResponse
from twin.identify.spectra.sine_fit import SteadyState, steady_states
from twin.identify.spectra.spectrum import BroadbandRecord, broadband_records, h1
from twin.identify.spectra.sweeps import rows_by_sweep
