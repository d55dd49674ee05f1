"""A cause from one file outside the package: the guide's own, and files that are not what they should be."""

import importlib
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from beam_rows import deflection
from guide_script import read_blocks

import twin.cause_registry.outside as outside
from recordings.errors import InputError
from twin.bench import EFFECTS, draw_case, open_bench
from twin.campaign.plan import campaign_causes
from twin.cause_registry import DRAWS, load_causes
from twin.diagnose.models import CAUSES
from twin.rigs import load_rig, moduli_at
from twin.structure import assemble, normal_modes

GUIDE = Path(__file__).parents[3] / "docs" / "a-new-cause.md"
RIG = load_rig("steel-lap-joint")


def guides_file(folder):
    (block,) = [b for b in read_blocks(GUIDE.read_text(encoding="utf-8")) if b.file == "ground_spring.py"]
    path = folder / "ground_spring.py"
    path.write_text(block.content)
    return path


@pytest.fixture(autouse=True)
def alone(monkeypatch):
    """What a test loads is forgotten afterwards."""
    monkeypatch.setenv(outside.VARIABLE, "")
    monkeypatch.setattr(outside, "_loaded", {})
    monkeypatch.setattr(outside, "__path__", list(outside.__path__))
    modules = set(sys.modules)
    yield
    for name in set(sys.modules) - modules:
        if name.startswith("twin.cause_registry.outside."):
            del sys.modules[name]
    importlib.invalidate_caches()


def test_every_registry_knows_the_guides_cause(tmp_path):
    (cause,) = load_causes(guides_file(tmp_path))
    assert cause.name == "ground-spring"
    assert EFFECTS["ground-spring"] is cause.effect
    assert CAUSES["ground-spring"].summary.startswith("a spring")
    assert list(DRAWS)[-1] == campaign_causes()[-1] == "ground-spring"
    assert load_causes(tmp_path / "ground_spring.py") == (cause,), "twice is once"


def test_its_effect_acts_on_the_bench_as_its_draw_says(tmp_path):
    """A spring at the tip raises the first natural frequency by what it holds of the mode's energy."""
    load_causes(guides_file(tmp_path))
    case = draw_case(np.random.default_rng(3), rig=RIG, causes=["ground-spring"])
    (effect,) = case.effects
    assert 100.0 <= effect.parameters["stiffness_N_per_m"] <= 300.0
    before, after = (lowest_squared(open_bench(RIG, effects=effects)) for effects in ((), case.effects))
    structure, (moduli,) = assemble(RIG), moduli_at(RIG)
    modes = normal_modes(structure.M, structure.stiffness(moduli.normal_modulus, moduli.shear_modulus), 1)
    moved = deflection(structure, effect.parameters["position_m"]) @ modes.Phi[:, 0]
    # To first order; the spring's own share of the stiffness is some ten per cent.
    assert after - before == pytest.approx(effect.parameters["stiffness_N_per_m"] * moved**2, rel=0.1)


def lowest_squared(bench):
    """Square of the bench's lowest natural frequency, with the linear joint."""
    condensed, (joint,) = bench._built.condensed, bench._plan.joints
    return np.linalg.eigvalsh(condensed.K0 + joint.E * condensed.K_E[0] + joint.G * condensed.K_G[0])[0]


def test_another_process_knows_it_by_the_environment(tmp_path, monkeypatch):
    """As workers of a campaign do: models travel there by name."""
    path = guides_file(tmp_path)
    code = (
        "import pickle, sys\nfrom twin.causes import load_causes\nfrom pathlib import Path\n"
        f"load_causes(Path({str(path)!r}))\nfrom twin.diagnose.models import CAUSES\nimport subprocess\n"
        "data = pickle.dumps(CAUSES['ground-spring'])\n"
        "print(subprocess.run([sys.executable, '-c', 'import pickle, sys; "
        "print(pickle.loads(bytes.fromhex(sys.argv[1])).name)', data.hex()], capture_output=True, text=True).stdout)"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "ground-spring"


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("broken.py", "x = 1\ndef f(:\n", "line 2: cannot be imported (SyntaxError"),
        ("raises.py", "\n\nraise RuntimeError('no')\n", "line 3: cannot be imported (RuntimeError: no)"),
        ("empty.py", "", "CAUSE: has no CAUSE"),
        ("other.py", "CAUSE = 3\n", "CAUSE: its CAUSE is a int"),
        ("taken.py", "from twin.causes import OutsideCause\nCAUSE = OutsideCause(name='added-mass')\n", "is taken"),
        ("no-module.py", "", "is not a valid module name"),
        ("absent.py", None, "there is no such file"),
    ],
)
def test_a_file_that_is_none_is_one_line(tmp_path, name, content, told):
    path = tmp_path / name
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError) as error:
        load_causes(path)
    assert told in str(error.value)
    assert "\n" not in str(error.value)
    assert "ground-spring" not in EFFECTS, "nothing of it stays"
    assert outside.outside_causes() == ()


def test_the_command_ends_with_that_line_and_status_2(tmp_path):
    (tmp_path / "broken.py").write_text("def f(:\n")
    command = [sys.executable, "-m", "twin", "campaign", "--out", "c", "--causes", "broken.py", "--cause", "none"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "broken.py" in done.stderr
    assert not (tmp_path / "c").exists()


@pytest.mark.slow
def test_a_campaign_hides_it_finds_it_and_counts_it(tmp_path):
    """In worker processes, beside a clean rig; the report of a diagnosis names it."""
    guides_file(tmp_path)
    command = [
        sys.executable, "-m", "twin", "campaign", "--out", "c", "--causes", "ground_spring.py", "--cause",
        "ground-spring", "--cause", "none", "--seeds", "1", "--workers", "2", "--json",
    ]  # fmt: skip
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    cases = [json.loads(path.read_text()) for path in (tmp_path / "c" / "cases").glob("*.json")]
    found = {tuple(case["plan"]["causes"]): case["found"] for case in cases}
    assert found[()]["verdict"] == "none"
    named = found["ground-spring",]["causes"]
    assert named[0]["cause"] == "ground-spring"
    assert "ground-spring" in done.stdout
