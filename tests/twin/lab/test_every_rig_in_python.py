"""Every shipped rig, and rigs without joints, from Python: nothing fails, and nothing speaks of what a rig has not."""

import re
from contextlib import suppress

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.text import Text
from small_rigs import DRAWN, rig_file, write_procedures

import twin
from recordings.errors import InputError
from twin.rigs import RIG_FILES
from twin.structure.modelled_rig import modelled_rig

WITHOUT_JOINT = tuple(name for name in DRAWN if name != "bars-in-space")
QUICK = ("beam-clamped", "matrices-hung")
"""Rigs that are rehearsed and identified in 10 s; what their words and pictures are made by is the others' too."""
OF_CANTILEVERS = re.compile(r"\btip\b|from the clamp|\boverlap\b|\blap joint\b|\b(upper|lower) beam\b")
OF_JOINTS = re.compile(r"\bjoints?\b(?<!no joint)|\bbolted\b|\bpreload\b|\blayers?\b|E′|G′")


def words(shown):
    """What a result prints, in a terminal and in a notebook."""
    return f"{shown!r} {shown._repr_html_()}"


def labels(shown):
    """All texts in its pictures; a picture may say that there is nothing to draw."""
    found = []
    for name in [name for name in dir(shown) if name.startswith("plot_")]:
        try:
            figure = getattr(shown, name)(*(["acc1"] if name == "plot_samples" else []))
        except ValueError as error:
            found.append(str(error) if "there is no joint" not in str(error) else "")
            continue
        found += [text.get_text() for text in figure.findobj(Text)]
        plt.close(figure)
    return " ".join(found)


def sensible(name, text):
    """Names of parts and channels are the file's."""
    if name not in ("steel-lap-joint", "steel-lap-joint-light-sensors", "hybrid-joint"):
        assert not OF_CANTILEVERS.search(text.replace(name, "")), OF_CANTILEVERS.search(text)
    if name in WITHOUT_JOINT:
        assert not OF_JOINTS.search(text), text


@pytest.mark.parametrize("name", [*RIG_FILES, *DRAWN])
def test_a_rig_says_what_it_is_made_of(name, tmp_path):
    rig = twin.load_rig(rig_file(name, tmp_path))
    assert rig.file.sentence in repr(rig)
    assert len(rig.tables()) == 1 + bool(rig.file.joints)
    sensible(name, words(rig))


@pytest.mark.parametrize(
    "name",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in (*RIG_FILES, *DRAWN)],
)
def test_every_call_answers_in_words_of_that_rig(name, tmp_path):
    rig = twin.load_rig(rig_file(name, tmp_path))
    noise, sweep = write_procedures(tmp_path, modelled_rig(rig.file).modes.frequency_Hz[0])
    rehearsed = [rig.rehearse(procedure, rounds=0) for procedure in (noise, sweep)]
    runs = [each.recording for each in rehearsed]
    identified = rig.identify(runs)
    predicted = identified.rig.predict(np.linspace(45.0, 55.0, 5), force_N=0.1)
    # With no time for it a cause that is to be excluded has no limit yet: that is told, and costs no answer.
    little = twin.DiagnosisOptions(time_limit_s=1.0, exclude=["channel-polarity"])
    diagnosed = rig.diagnose(runs, out=tmp_path / "diagnosis", options=little)
    assert any(note.startswith("channel-polarity: has no size") for note in diagnosed.diagnosis.notes)
    sensible(name, " ".join(finding.line for finding in rig.check(runs).findings))
    shown = [*rehearsed, *runs, identified, identified.rig, predicted, diagnosed]
    with suppress(InputError):  # of six seconds of noise there may be too few lines
        shown.append(rig.modes(runs[0]))
    for number, each in enumerate(shown):
        sensible(name, f"{words(each)} {labels(each)}")
        if hasattr(each, "report"):
            each.report(tmp_path / f"{number}.html")
    assert predicted.sentence
