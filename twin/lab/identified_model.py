"""What identifications of every kind have in common: a model to save, to report and to go on with."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from recordings import whole_file
from twin.lab.shown import Reported
from twin.rigs import Rig
from twin.rigs.kinds import save_any_rig
from twin.rigs.modal import ModalRig

if TYPE_CHECKING:
    from twin.lab.rig import LabRig


class IdentifiedModel(Reported):
    """A model that was identified."""

    @property
    def file(self) -> Rig | ModalRig:
        """What is written to the model file."""
        raise NotImplementedError

    def to_dict(self) -> dict[str, Any]:
        """As ``twin identify --json`` prints it, without the model file's name."""
        raise NotImplementedError

    @property
    def rig(self) -> LabRig:
        """The model as a rig, to rehearse, predict and diagnose with."""
        from twin.lab.rig import LabRig

        return LabRig(source=f"{self.file.name}, identified", file=self.file)

    def save(self, path: str | Path) -> None:
        """Write the model file (TOML), whole or not at all."""
        with whole_file(Path(path)) as part:
            save_any_rig(self.file, part)
