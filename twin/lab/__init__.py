"""The laboratory in Python: a rig, its recordings, and what follows from them, for notebooks, scripts and commands."""

from twin.lab.recording import Recording, load_run
from twin.lab.rig import LabRig, load_rig
