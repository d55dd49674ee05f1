"""The likelihood of each kind of data: residuals, errors and sensitivities, for all that fits or weighs models."""

from twin.identify.linear.linear_model import LinearParameters, nominal_parameters
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.residuals.error_model import SOUND, ErrorModel
from twin.identify.residuals.frequency_model import FrequencyModel
from twin.identify.residuals.frequency_model import sound_errors as sound_frequency_errors
from twin.identify.residuals.linearisation import Linearisation
from twin.identify.residuals.natural_frequencies import MeasuredFrequencies
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals


def residual_model(
    evidence: MeasuredData,
    modification: ModelModification | None = None,
    harmonics: HarmonicResiduals | None = None,
    *,
    errors: ErrorModel | None = None,
    held: Linearisation | None = None,
) -> ResidualModel | FrequencyModel:
    """Residuals of `evidence` for an extension of the nominal rig, by default with the errors of sound rigs."""
    errors = errors or sound_errors(evidence)
    if isinstance(evidence, MeasuredFrequencies):
        return FrequencyModel(evidence, modification, errors=errors, held=held)
    return ResidualModel(evidence, modification, harmonics, errors=errors, held=held)


def sound_errors(evidence: MeasuredData) -> ErrorModel:
    """Errors of the models of sound rigs."""
    return sound_frequency_errors(evidence) if isinstance(evidence, MeasuredFrequencies) else SOUND


def nominal_base(evidence: MeasuredData) -> LinearParameters:
    """The base parameters as the rig file has them."""
    if isinstance(evidence, MeasuredFrequencies):
        return evidence.nominal
    return nominal_parameters(evidence.rig, evidence.preload)


def solves_modes(evidence: MeasuredData, modification: ModelModification) -> bool:
    """Whether a residual solves modes anew: their rounding asks for coarser differences."""
    return isinstance(evidence, MeasuredFrequencies) or modification.changes_structure
