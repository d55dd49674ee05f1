"""`twin modes`: a recorded rig's poles without its model, as a table that identification takes."""

import json
import subprocess
import sys

import pytest
from said import said_beside_stages

from recordings import FrequencyTable, RunWriter, read_table
from twin.bench import no_law, open_bench
from twin.cli import main
from twin.demo import broadband
from twin.procedures import DirectAcquisition, run_procedure
from twin.rigs import load_rig
from twin.structure import assemble, normal_modes


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return ended.value.code, captured.out, captured.err


@pytest.fixture(scope="module")
def linear_run(tmp_path_factory):
    """A minute of noise on the steel rig with a joint that has no law beyond its moduli."""
    path = tmp_path_factory.mktemp("linear") / "noise.mcap"
    bench = open_bench(load_rig("steel-lap-joint"), preload="120N", seed=3, sample_rate_Hz=5120.0, joint_law=no_law())
    acquisition = DirectAcquisition(bench)
    with RunWriter(path, info={"source": "simulated"}, channels=acquisition.channels) as writer:
        run_procedure(broadband(), acquisition, writer)
    return path


@pytest.mark.slow
def test_a_recorded_rigs_modes_are_found_without_its_model(linear_run, tmp_path, capsys):
    table, picture = tmp_path / "modes.csv", tmp_path / "chart.png"
    status, printed, _ = run(
        capsys, "modes", linear_run, "--band", 5, 950, "--out", table, "--picture", picture, "--json"
    )
    result = json.loads(printed)
    rig = load_rig("steel-lap-joint")
    s, moduli = assemble(rig), rig.joint.preload["120N"]
    natural_Hz = normal_modes(s.M, s.stiffness(moduli.normal_modulus, moduli.shear_modulus), 4).frequency_Hz
    assert status == 0
    assert [m["frequency_Hz"]["value"] for m in result["modes"]] == pytest.approx(natural_Hz, rel=2e-4)
    # Sharp resonances of a record of a minute: what windows would add to the damping is many times this.
    assert [m["damping_ratio"]["value"] for m in result["modes"]] == pytest.approx(rig.damping.modal_ratio, rel=0.02)
    assert isinstance(read_table(table), FrequencyTable)
    assert len(read_table(table)) == 4
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_neither_numba_nor_matplotlib_are_loaded_for_it(linear_run):
    """They take as much memory as all samples that are held at once."""
    code = (
        "import atexit, runpy, sys\n"
        f"sys.argv[1:] = ['modes', {str(linear_run)!r}, '--band', '5', '200']\n"
        "atexit.register(lambda: print(*[m for m in ('numba', 'matplotlib') if m in sys.modules], file=sys.stderr))\n"
        "runpy.run_module('twin', run_name='__main__')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    assert done.stderr.endswith("\n\n"), done.stderr


def test_what_cannot_be_fitted_is_refused_in_one_line(linear_run, campaign, tmp_path, capsys):
    out = tmp_path / "modes.csv"
    for arguments, reason in (
        ((linear_run, "--band", 50, 20), "no band"),
        ((linear_run, "--force", "acc9"), "acc9"),
        ((linear_run, "--band", 30, 31), "noise.mcap"),
        ((campaign / "sweeps.mcap",), "no broadband stretch"),
        ((tmp_path / "none.mcap",), "none.mcap"),
    ):
        status, printed, said = run(capsys, "modes", *arguments, "--out", out, "--json")
        assert (status, printed) == (2, "")
        assert reason in said
        assert len(said_beside_stages(said)) == 1
        assert not list(tmp_path.iterdir())
