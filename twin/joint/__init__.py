"""Laws of the joint, one a file, each in time and as an equivalent stiffness over amplitude."""

from twin.joint.describing_function import describing_function
from twin.joint.functions import law_of_functions
from twin.joint.iwan import iwan
from twin.joint.jenkins_element import ParallelJenkins, jenkins
from twin.joint.knots import Curve, loss_of_knots, softening_of_knots, table_of_softening
from twin.joint.law import Law
from twin.joint.masing import masing_of_points
from twin.joint.named_law import NamedLaw, Parameter, PointForce
from twin.joint.polynomial import Polynomial
from twin.joint.power_laws import Cubic, Linear, QuadraticDrag
from twin.joint.registry import known_laws, law_named, load_laws
from twin.joint.running_loss import RunningLoss
from twin.joint.saturating import Saturating
from twin.joint.slap import PiecewiseLinearContact, one_sided
from twin.joint.steel import steel_loss, steel_softening
from twin.joint.table import ForceTable, table_from_stiffness

__all__ = [
    "Cubic", "Curve", "ForceTable", "Law", "Linear", "NamedLaw", "ParallelJenkins", "Parameter",
    "PiecewiseLinearContact", "PointForce", "Polynomial", "QuadraticDrag", "RunningLoss", "Saturating",
    "describing_function", "iwan", "jenkins", "known_laws", "law_named", "law_of_functions", "load_laws",
    "loss_of_knots", "masing_of_points", "one_sided", "softening_of_knots", "steel_loss", "steel_softening",
    "table_from_stiffness", "table_of_softening",
]  # fmt: skip
