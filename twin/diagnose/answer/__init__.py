"""What a diagnosis says: the named causes and their gain, what is excluded, where it falls short."""

from twin.diagnose.answer.comparison import SweepComparison
from twin.diagnose.answer.exclusion import Exclusion
from twin.diagnose.answer.gain import Gain
from twin.diagnose.answer.misfit import Misfit, Verdict
from twin.diagnose.answer.result import Diagnosis, Estimate, NamedCause
