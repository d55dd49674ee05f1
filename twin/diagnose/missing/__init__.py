"""What the data still say where no cause on the list explains them: a force that is missing."""

from twin.diagnose.missing.picture import FittedTerm, ForceAtLevel, MissingForce, find_missing_force
