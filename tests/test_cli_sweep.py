"""``bifurc sweep`` and ``bifurc basins --resume``: what is printed and kept, one-line errors, an interrupt and what follows."""
import matplotlib.image
import pytest

import bifurc as bf
from bifurc import cli
from bifurc.basins.sweeps import attractor_sweep as sweeps

STEM = "impact_oscillator_omega_sweep"


def said(capsys, *arguments):
    code = cli.main(arguments)
    streams = capsys.readouterr()
    return code, streams.out, streams.err


def command(folder, *more):
    return ["sweep", "impact_oscillator", "omega", "--bounds", "1.3", "1.5", "--points", "5", "--samples", "40", "--quiet",
            "--out", str(folder), *more]


def test_a_sweep_prints_its_tracks_saves_and_draws(capsys, tmp_path):
    code, out, err = said(capsys, *command(tmp_path))
    assert (code, err) == (0, "")
    assert "2 tracks" in out and "Track(0: period 1, 5 values from 1.3 to 1.5" in out
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"{STEM}.npz", f"{STEM}.png"]
    assert len(bf.load(tmp_path / f"{STEM}.npz").tracks) == 2
    assert matplotlib.image.imread(tmp_path / f"{STEM}.png").std() > 0.05


def test_an_interrupted_sweep_resumes(capsys, tmp_path, monkeypatch):
    work, calls = sweeps.sweep_points, []

    def interrupted(payload):
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return work(payload)

    monkeypatch.setattr(sweeps, "sweep_points", interrupted)
    code, _, err = said(capsys, *command(tmp_path, "--workers", "1", "--no-branches"))
    assert code == 130 and "what was finished is on disk" in err
    assert len(list((tmp_path / f"{STEM}.npz.chunks").glob("*.npz"))) == 1
    code, _, _ = said(capsys, *command(tmp_path, "--workers", "1", "--no-branches"))
    assert code == 0 and len(calls) == 3  # two chunks: one was there
    assert not (tmp_path / f"{STEM}.npz.chunks").exists()
    code, _, _ = said(capsys, *command(tmp_path, "--workers", "1", "--no-branches", "--no-resume"))
    assert code == 0 and len(calls) == 5


def test_a_sweep_with_values_that_failed_ends_with_code_1(capsys, tmp_path):
    """restitution = 1.1 is no system: the three other values are there, and whoever started the command is told."""
    code, out, _ = said(capsys, "sweep", "impact_oscillator", "restitution", "--bounds", "0.8", "1.1", "--points", "4",
                        "--samples", "20", "--quiet", "--no-branches", "--out", str(tmp_path))
    assert code == 1 and "values from 0.8 to 1" in out and "1 value" in out
    stem = "impact_oscillator_restitution_sweep"
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"{stem}.npz.chunks", f"{stem}.png"]  # what is there is kept


def test_a_map_is_made_anew_when_asked(capsys, tmp_path):
    request = ["basins", "impact_oscillator", "--cells", "6", "--quiet", "--out", str(tmp_path)]
    assert said(capsys, *request)[0] == 0
    file = tmp_path / "impact_oscillator_basins.npz"
    first = file.stat().st_mtime_ns
    assert said(capsys, *request, "--resume")[0] == 0 and file.stat().st_mtime_ns == first
    assert said(capsys, *request, "--no-resume")[0] == 0 and file.stat().st_mtime_ns > first


@pytest.mark.parametrize(("arguments", "words"), [
    (["sweep", "pendulum"], ["'pendulum'"]),
    (["sweep", "impact_oscillator", "mass"], ["'mass'"]),
    (["sweep", "impact_oscillator", "--points", "1"], ["--points", "1"]),
    (["sweep", "impact_oscillator", "--samples", "0"], ["--samples", "0"]),
    (["sweep", "impact_oscillator", "--bounds", "1", "1"], ["--bounds", "twice"]),
    (["sweep", "impact_oscillator", "--bounds", "1", "inf"], ["--bounds", "'inf'"]),
    (["sweep", "impact_oscillator", "gap", "--set", "gap=0"], ["--bounds is needed", "gap"]),
])
def test_bad_requests_are_answered_in_one_line_with_code_2(capsys, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    code, out, err = said(capsys, *arguments)
    assert (code, out) == (2, "") and err.startswith("bifurc: error: ") and err.count("\n") == 1
    for word in words:
        assert word in err
    assert list(tmp_path.iterdir()) == []
