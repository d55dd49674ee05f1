"""Impact tests: the hits that can be used, windows, averaged responses, and what is wrong with a test."""

from twin.identify.impacts.hits import Hits, sound_hits
from twin.identify.impacts.reduction import ImpactResponses, Reduction, reduce_hits
