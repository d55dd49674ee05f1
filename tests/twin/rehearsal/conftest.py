"""The small rig of the procedures' tests serves the rehearsals too."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "procedures"))
