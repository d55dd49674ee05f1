"""A rig to rehearse, to identify, to predict and to diagnose with.

What each of these needs is imported when it is asked for: a rig is loaded, and a wrong one refused, in a moment.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from recordings import InputError
from recordings.responses import read_responses
from recordings.whereabouts import Stages, told_in_one_line
from twin.lab.given import AnyRun, Report, Runs, are_all_responses, are_tables, listed, no_scatter, one_preload
from twin.lab.recording import as_runs
from twin.lab.shown import Shown
from twin.rigs import Rig
from twin.rigs.assumed import assumed
from twin.rigs.beam import BeamRig
from twin.rigs.modal import ModalRig
from twin.rigs.preloads import known_preload
from twin.rigs.store import AnyRig, load_any_rig, no_structure
from twin.views.table import Table

if TYPE_CHECKING:
    from twin.checks import FirstLook
    from twin.diagnose import DiagnosisOptions
    from twin.lab.diagnosed import DiagnosedRecordings
    from twin.lab.diagnosed_tables import DiagnosedTables
    from twin.lab.identified_joint import Beside, IdentifiedJoint
    from twin.lab.identified_mode import IdentifiedMode
    from twin.lab.identified_moduli import IdentifiedModuli
    from twin.lab.identified_responses import IdentifiedResponses
    from twin.lab.modal_test import ModalTest
    from twin.lab.predicted import PredictedResponse
    from twin.lab.rehearsed import RehearsedProcedure
    from twin.procedures import Procedure


def _silent(_: str) -> None:
    pass


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class LabRig(Shown):
    """What is assumed of a rig."""

    source: str
    """The name or file it was loaded from."""
    file: AnyRig
    """What that says: a structure, a beam alone, or one measured mode."""

    @property
    def assumed(self) -> tuple[str, ...]:
        """What stands for what its file leaves out."""
        return assumed(self.file)

    @property
    def sentence(self) -> str:
        """Its name, and what it is made of."""
        kinds = {BeamRig: "a beam alone", ModalRig: "one mode of a structure"}
        kind = self.file.sentence if isinstance(self.file, Rig) else kinds[type(self.file)]
        return f"{self.file.name}: {kind}."

    def tables(self) -> Sequence[Table]:
        """The joints' moduli, where it has any, and the channels."""
        rig = self.file
        if not isinstance(rig, Rig):
            return []
        moduli = Table(
            caption="Joints: moduli of their layers, N/mm²",
            head=("joint", "preload", "E′", "G′"),
            rows=[
                (joint.name, name, f"{1e-6 * m.normal_modulus:.4g}", f"{1e-6 * m.shear_modulus:.4g}")
                for joint in rig.joints
                for name, m in joint.preload.items()
            ],
            numbers=(2, 3),
        )
        sensors = [rig.force_sensor, *rig.response_sensors]
        channels = Table(
            caption="Channels",
            head=("channel", "quantity", "at"),
            rows=[(s.channel, s.quantity, rig.layout().told(rig.place_of(s.channel))) for s in sensors],
        )
        return [moduli, channels] if rig.joints else [channels]

    def rehearse(
        self,
        procedure: str | Path | Procedure,
        *,
        out: str | Path | None = None,
        preload: str | None = None,
        seed: int = 0,
        rounds: int = 5,
        report: Report = _silent,
    ) -> RehearsedProcedure:
        """Run a procedure on the twin, and improve it until it raises no warning.

        Parameters
        ----------
        procedure
            A shipped procedure's name, a file, or the procedure itself.
        out
            Folder of the recordings; a temporary one that lives as long as the result if not given.
        preload
            State of the joint; the rig's first if not given.
        rounds
            At most so many improvements.

        Raises
        ------
        InputError
            If the procedure or the preload is wrong, or the rig has not what the procedure asks for.
        """
        from twin.lab.rehearsed import rehearse_procedure

        return rehearse_procedure(
            procedure, self._structure(), source=self.source, preload=preload, seed=seed,
            out=None if out is None else Path(out), rounds=rounds, report=report,
        )  # fmt: skip

    def check(self, runs: Runs, *, held_out: Runs = (), preload: str | None = None) -> FirstLook:
        """Look at recordings, before any fit: units, channels, time base, and what belongs together.

        Parameters
        ----------
        runs, held_out
            Recordings to learn from, and those that no fit is to see.
        preload
            State of the joint; what the recordings name if not given.

        Raises
        ------
        InputError
            If the runs cannot be read, or lack the rig's channels.
        """
        from twin.checks import first_look

        rig = self._structure()
        if preload is not None:
            known_preload(rig, preload)
        learnt, kept = as_runs(listed(runs)), as_runs(listed(held_out))
        stages = Stages(_silent)
        stages("looking at the recordings")
        with told_in_one_line(self.source, stages):
            return first_look(learnt, rig, held_out=kept, preload=preload)

    def modes(self, run: AnyRun) -> ModalTest:
        """Natural frequencies, damping and shapes of a recording's hits or noise, beside the rig's own.

        Raises
        ------
        InputError
            If it holds neither, or no mode.
        """
        from twin.lab.modal_test import modal_test

        return modal_test(as_runs([run])[0], rig=self._structure())

    def identify(
        self, runs: Runs, *, preload: str | None = None, frequency_scatter: float | None = None,
        beside: Beside | None = None, report: Report = _silent,
    ) -> IdentifiedJoint | IdentifiedModuli | IdentifiedMode | IdentifiedResponses:  # fmt: skip
        """Identify the rig's model.

        Recordings give the layer's moduli, the damping and the joint's law; a table of natural frequencies (.csv) the
        joints' moduli, or those of the beams of a rig without joints; a table of sweeps the law of a rig of one mode.

        Parameters
        ----------
        runs
            Recordings, in memory or as files, or one table, or frequency responses of one state (.uff, .npz, .csv).
        preload
            State of the joint; what the recordings name if not given.
        frequency_scatter
            Of frequency responses, as for :meth:`diagnose`.
        beside
            Another identification of recordings to report beside this one, such as the papers' own,
            :func:`studies.force_levels.with_polynomials`.

        Raises
        ------
        InputError
            If the runs cannot be read, or do not fit the rig.
        """
        given, stages = listed(runs), Stages(report)
        paths = [Path(run) for run in given if isinstance(run, str | Path)]
        with told_in_one_line(paths[0] if paths else self.source, stages):
            if are_all_responses(paths):
                from twin.lab.identified_responses import identify_responses

                stages("following the resonances of the frequency responses")
                rig = self._structure()
                return identify_responses(
                    paths, rig, preload=known_preload(rig, preload) if preload else None, scatter=frequency_scatter
                )
            if frequency_scatter is not None:
                raise no_scatter()
            return self._identified(given, paths, preload, beside, stages)

    def _identified(
        self, given: Sequence[AnyRun], paths: Sequence[Path], preload: str | None, beside: Beside | None, report: Report
    ) -> IdentifiedJoint | IdentifiedModuli | IdentifiedMode:
        tables = [path for path in paths if path.suffix.lower() == ".csv"]
        if isinstance(self.file, ModalRig):
            if len(given) != 1 or len(tables) != 1:
                first = paths[0] if paths else self.source
                raise InputError(first, "", "a rig of kind modal is identified from one table of sweeps (.csv)")
            if preload is not None:
                raise InputError(self.source, "--preload", "a modal rig has no preloads")
            from twin.lab.identified_mode import identify_mode

            return identify_mode(tables[0], self.file)
        if tables and len(given) > 1:
            raise InputError(tables[0], "", "a table is identified by itself", "give it as the only RUN")
        if tables:
            from twin.lab.identified_moduli import identify_moduli

            return identify_moduli(tables[0], self.file, source=self.source, preload=preload)
        rig = self._structure()
        report("reading, and a first look")
        looked = self.check(given, preload=preload).passed()
        from twin.lab.identified_joint import identify_recordings

        return identify_recordings(looked, rig, source=self.source, preload=preload, report=report, beside=beside)

    def diagnose(
        self,
        runs: Runs,
        *,
        held_out: Runs = (),
        preload: str | Sequence[str] | None = None,
        out: str | Path | None = None,
        frequency_scatter: float | None = None,
        options: DiagnosisOptions | None = None,
        report: Report = _silent,
    ) -> DiagnosedRecordings | DiagnosedTables:
        """Say what the rig's model gets wrong about what was measured.

        Parameters
        ----------
        runs
            Recordings, in memory or as files, or tables (.csv), or frequency responses of one state (.uff, .npz, .csv).
        held_out
            Runs that are kept for the gain.
        preload
            State of the joint: of the recordings, or of tables that do not say it, one for all or one each.
        out
            Folder for the extended model of recordings and, where the answer is ambiguous, the next procedure.
        frequency_scatter
            Of frequency responses: relative standard deviation of a natural frequency from case to case; the rig
            file's, or what the cases show, if not given.
        options
            How far the search goes, in which time and in how many processes.

        Raises
        ------
        InputError
            If the runs cannot be read, do not fit the rig, or are recordings and tables at once.
        """
        from twin.diagnose import DiagnosisOptions, diagnose, diagnose_data, responses_data
        from twin.lab.diagnosed import DiagnosedRecordings

        asked, stages = options or DiagnosisOptions(), Stages(report)
        folder = None if out is None else Path(out)
        learnt, kept = listed(runs), listed(held_out)
        paths = [Path(run) for run in [*learnt, *kept] if isinstance(run, str | Path)]
        preloads = [preload] if isinstance(preload, str) else list(preload or [])
        if are_all_responses(paths):
            rig = self._structure()
            if kept:
                reason = "nothing is held out of frequency responses: there is no gain at other force levels"
                raise InputError("--held-out", "", reason, "give them with the others, or by themselves")
            if asked.exclude:
                raise InputError("--exclude", "", "the next test is planned from recordings alone", "leave it out")
            stages("reading the frequency responses")
            with told_in_one_line(paths[0], stages), asked.in_effect():
                data = responses_data(
                    [read_responses(path) for path in paths], rig, preload=one_preload(preloads, rig),
                    scatter=frequency_scatter, source=self.source, causes=asked.causes, report=stages,
                )  # fmt: skip
                result = diagnose_data(data, out=folder, options=asked, report=stages)
            return DiagnosedRecordings(result)
        if frequency_scatter is not None:
            raise no_scatter()
        if are_tables(paths):
            if len(paths) != len(learnt) + len(kept):
                raise InputError(paths[0], "", "stands beside recordings in memory", "give either")
            from twin.lab.diagnosed_tables import diagnose_tables

            # Their fits take a moment: further processes would take longer to begin.
            with told_in_one_line(paths[0], stages), replace(asked, processes=1).in_effect():
                return diagnose_tables(
                    paths[: len(learnt)], paths[len(learnt) :], self.file, source=self.source, preloads=preloads,
                    report=stages,
                )  # fmt: skip
        rig = self._structure()
        named = one_preload(preloads, rig)
        stages("reading, and a first look")
        with asked.in_effect():
            looked = self.check(learnt, held_out=kept, preload=named).passed()
            blamed = looked.runs[0].path if looked.runs else self.source
            with told_in_one_line(blamed, stages):
                result = diagnose(
                    looked.runs, rig, preload=named, held_out=looked.held_out, source=self.source, out=folder,
                    options=asked, report=stages,
                )  # fmt: skip
        return DiagnosedRecordings(result, looked.findings)

    def predict(
        self,
        frequency_Hz: Iterable[float],
        *,
        force_N: float | Iterable[float] | None = None,
        acceleration_m_per_s2: float | Iterable[float] | None = None,
        preload: str | None = None,
        shaker: str | None = None,
        channel: str | None = None,
    ) -> PredictedResponse:
        """Predict the response to given forces, all branches of it, or the force that given accelerations need.

        Parameters
        ----------
        frequency_Hz
            Of each step.
        force_N, acceleration_m_per_s2
            Peak values, one for all steps or one each; one of the two.
        preload
            State of the joint; the rig's first if not given.
        shaker
            Which of the rig's drives acts; the first if not given.
        channel
            Whose response; that of the file's law if not given, or of the sensor that moves most in the first mode.

        Raises
        ------
        InputError
            If the rig cannot be predicted with, or has not that preload, drive or channel.
        ValueError
            If not just one of force and acceleration is given.
        """
        from twin.lab.predicted import asked_drive, predict_response

        drive = asked_drive(frequency_Hz, force_N, acceleration_m_per_s2)
        return predict_response(
            self.file, drive, preload=preload, shaker=shaker, channel=channel, source=self.source
        )  # fmt: skip

    def _structure(self) -> Rig:
        if not isinstance(self.file, Rig):
            raise no_structure(self.file.kind, self.source)
        return self.file


def load_rig(name_or_path: str | Path) -> LabRig:
    """Load a rig of any kind: a shipped rig's name, or a TOML file.

    Raises
    ------
    InputError
        If there is no such rig or file, or it does not describe a rig.
    """
    file = load_any_rig(name_or_path)
    if isinstance(file, Rig):
        from twin.bench import EFFECTS, check_effects

        # A cause of one's own need have no effect on the bench.
        acting = [effect for effect in file.effect if effect.cause in EFFECTS]
        check_effects(file.model_copy(update={"effect": acting}), source=str(name_or_path))
    return LabRig(source=str(name_or_path), file=file)
