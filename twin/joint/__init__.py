"""Laws of the joint, one a file, each in time and as an equivalent stiffness over amplitude."""

from twin.joint.cubic import Cubic
from twin.joint.describing import describing_function
from twin.joint.drag import QuadraticDrag
from twin.joint.iwan import iwan, iwan_backbone, iwan_stiffness
from twin.joint.jenkins import jenkins_stiffness
from twin.joint.law import Law
from twin.joint.linear import Linear
from twin.joint.masing import masing, masing_stiffness
from twin.joint.polynomial import Polynomial
from twin.joint.running_loss import RunningLoss
from twin.joint.saturating import Saturating
from twin.joint.slap import Hinges, mayer_gaul, one_sided
from twin.joint.sliders import Sliders, jenkins
from twin.joint.table import Table, table_from_stiffness

__all__ = [
    "Cubic",
    "Hinges",
    "Law",
    "Linear",
    "Polynomial",
    "QuadraticDrag",
    "RunningLoss",
    "Saturating",
    "Sliders",
    "Table",
    "describing_function",
    "iwan",
    "iwan_backbone",
    "iwan_stiffness",
    "jenkins",
    "jenkins_stiffness",
    "masing",
    "masing_stiffness",
    "mayer_gaul",
    "one_sided",
    "table_from_stiffness",
]
