"""The command line: one-line errors, what is followed and printed, and the whole default job."""
import os
import subprocess
import sys
from types import SimpleNamespace

import matplotlib.image
import numpy as np
import pytest

import bifurc as bf
from bifurc import cli, io
from bifurc.cli import branches as cli_branches
from bifurc.cli import common
from bifurc.cli.common import STORIES
from bifurc.elements import RigidStop
from tests.plotting import fakes


def said(capsys, *arguments):
    """Run the program; return its code, output and error lines."""
    code = cli.main(arguments)
    streams = capsys.readouterr()
    return code, streams.out, streams.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["trace", "pendulum"], ["'pendulum'", "impact_oscillator", "duffing_oscillator"]),
        (["trace"], ["SYSTEM", "--help"]),
        (["follow", "impact_oscillator"], ["'follow'"]),
        (["trace", "impact_oscillator", "--set", "omega"], ["NAME=VALUE", "'omega'"]),
        (["trace", "impact_oscillator", "--set", "omega=fast"], ["omega", "float", "'fast'"]),
        (["trace", "impact_oscillator", "--set", "mass=1"], ["'mass'", "zeta, omega, amplitude"]),
        (["trace", "impact_oscillator", "--set", "restitution=1.5"], ["restitution", "1.5"]),
        (["trace", "impact_oscillator", "--set", "omega=nan"], ["omega", "nan"]),
        (["trace", "impact_oscillator", "--parameter", "mass"], ["'mass'", "zeta, omega, amplitude"]),
        (["trace", "impact_oscillator", "--bounds", "1", "x"], ["--bounds", "'x'"]),
        (["trace", "impact_oscillator", "--bounds", "1", "inf"], ["--bounds", "'inf'"]),
        (["trace", "impact_oscillator", "--format", "docx"], ["--format", "png"]),
        (["trace", "impact_oscillator", "--set", "gap=0", "--parameter", "gap"], ["--bounds", "gap"]),
        (["trace", "moving_frame_impact_oscillator", "--parameter", "damper"], ["damper"]),
        (["basins", "impact_oscillator", "--cells", "1"], ["--cells", "1"]),
        (["basins", "impact_oscillator", "--window", "q0", "-1", "1"], ["--window", "twice"]),
        (["basins", "impact_oscillator", "--window", "q0", "a", "1", "--window", "v0", "-1", "1"], ["'a'"]),
        (["info", "pendulum"], ["'pendulum'"]),
        (["trace", "impact_oscillator", "--measure", "rms_1"], ["'rms_1'", "max_0, min_0, rms_0, h1_0, period"]),
        (["trace", "impact_chain", "--measure", "speed"], ["'speed'", "max_0 .. max_7"]),
        (["trace", "impact_oscillator", "--start", "1"], ["--start", "2 numbers"]),
        (["trace", "impact_oscillator", "--bounds", "1", "1"], ["--bounds", "twice"]),
        (["trace", "impact_oscillator", "--periods", "0"], ["--periods"]),
        (["trace", "impact_oscillator", "--ds-max", "0"], ["--ds-max"]),
        (["trace", "impact_oscillator", "--workers", "0"], ["--workers"]),
        (["trace", "impact_oscillator", "--save", "nowhere/x.npz"], ["--save", "nowhere/x.npz"]),
        (["trace", "impact_oscillator", "--out", "/dev/null/x"], ["--out", "/dev/null"]),
        (["frf", "jenkins_oscillator", "--data", "missing.csv"], ["missing.csv"]),
        (["frf", "jenkins_oscillator", "--measure", "max_3"], ["'max_3'"]),
        (["frf", "jenkins_oscillator", "--harmonics", "0"], ["--harmonics"]),
        (["explore", "pendulum"], ["'pendulum'"]),
        (["explore", "none/branch.npz"], ["there is no file none/branch.npz"]),
        (["basins", "belt_oscillator"], ["no excitation", "--section v0"]),
        (["basins", "belt_oscillator", "--section", "q7"], ["section: component 'q7' is unknown"]),
        (["basins", "belt_oscillator", "--section", "v0", "0", "up"], ["rising, falling or both, got v0 0 up"]),
        (["basins", "belt_oscillator", "--section", "v0", "x"], ["finite number", "'x'"]),
        (["basins", "impact_oscillator", "--section", "v0"], ["--section is for systems without excitation"]),
        (["completion", "tcsh"], ["bash", "zsh", "fish"]),
        (["explore", "oil_film_rotor"], ["oil_film_rotor has no ready story"]),
        (["explore", "micro_slip_ring"], ["bifurc hysteresis micro_slip_ring"]),
        (["hysteresis", "micro_slip_strip", "--out", "/dev/null/x"], ["--out", "/dev/null"]),
        (["hysteresis", "micro_slip_strip", "--set", "loads=1,x"], ["loads", "numbers with commas", "'1,x'"]),
        (["hysteresis", "micro_slip_strip", "--set", "load_amplitude=x"], ["load_amplitude", "float", "'x'"]),
        (["basins", "impact_oscillator", "--window", "q0", "0", "1", "--window", "q0", "0", "2"], ["once a component"]),
        (["frf", "friction_damped_oscillator", "--vary", "n", "1", "2"], ["'n' = 15 cannot vary continuously"]),
        (["frf", "jenkins_oscillator", "--parameter", "mass"], ["'mass'", "zeta, omega"]),
        (["frf", "impact_oscillator", "--set", "gap=0", "--parameter", "gap"], ["--bounds", "gap"]),
        (["atlas", "impact_oscillator", "--measure", "speed"], ["'speed'", "max_0"]),
    ],
)
def test_bad_requests_are_answered_in_one_line_with_code_2(capsys, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    code, out, err = said(capsys, *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("bifurc: error: ")
    assert err.count("\n") == 1
    for word in words:
        assert word in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "file"),
    [
        (["trace", "impact_oscillator"], "impact_oscillator_omega_3.npz"),
        (["trace", "impact_oscillator"], "impact_oscillator_basins.npz"),
        (["trace", "impact_oscillator", "--no-basins", "--save", "{}/mine.npz"], "mine.npz"),
        (["frf", "jenkins_oscillator"], "jenkins_oscillator_frf_1.npz"),
        (["frf", "friction_damped_oscillator"], "friction_damped_oscillator_peaks_micro.npz"),
        (["basins", "impact_oscillator"], "impact_oscillator_basins.npz"),
        (["basins", "impact_oscillator", "--no-resume"], "impact_oscillator_basins.npz"),
        (["sweep", "impact_oscillator", "--no-resume"], "impact_oscillator_omega_sweep.npz"),
        (["atlas", "impact_oscillator", "--no-resume"], "impact_oscillator_omega_atlas.npz"),
    ],
)
def test_foreign_files_are_left_alone_and_told_before_the_work(capsys, tmp_path, monkeypatch, arguments, file):
    for name in ("trace", "find_orbit", "sweep", "atlas", *(["basins_of_attraction"] if arguments[2:] else [])):
        monkeypatch.setattr(bf, name, None, raising=False)  # a map that goes on is told by its function
    place = tmp_path / file
    place.write_text("notes of somebody")
    code, _, err = said(capsys, *(item.format(tmp_path) for item in arguments), "--quiet", "--out", str(tmp_path))
    assert code == 2 and file in err and "It is left alone" in err and err.count("\n") == 1
    assert place.read_text() == "notes of somebody" and [*tmp_path.iterdir()] == [place]


def test_values_that_are_none_by_default_can_be_set(capsys, tmp_path):
    """Two blocks joined by a spring so weak that the second feels nothing: 4 F (A - F/k) of a single contact."""
    numbers = ("n=2", "loads=1,4", "friction=0.5", "amplitude=2", "area=1", "modulus=1e-9", "length=2", "width=1", "contact=1")
    code, out, _ = said(capsys, "hysteresis", "micro_slip_strip", "--set", *numbers, "--out", str(tmp_path))
    assert code == 0
    assert float(out.split("work a period ")[1].split(",")[0]) == pytest.approx(4.0 * 0.5 * (2.0 - 0.5), rel=1e-6)
    assert cli.main(["hysteresis", "macro_slip_contact", "--set", "load=40", "load_phase=None", "--out", str(tmp_path)]) == 0
    loops = bf.hysteresis(bf.systems.macro_slip_contact(load=40.0)).loops
    assert f"work a period {loops[0].work:.9g}" in capsys.readouterr().out


@pytest.mark.parametrize("name", bf.systems.__all__)
def test_what_info_prints_can_be_set(name):
    """The lines of ``bifurc info`` are arguments."""
    for parameter, value in getattr(bf.systems, name)().parameters.items():
        assert common.set_values(name, [f"{parameter}={value}"]) == {parameter: value}


def test_info_lists_versions_folder_and_systems(capsys):
    code, out, _ = said(capsys, "info")
    assert code == 0
    assert f"bifurc {bf.__version__}" in out
    for word in ("numpy", "numba", "compiled kernels: ", *bf.systems.__all__):
        assert word in out


@pytest.mark.parametrize("name", bf.systems.__all__)
def test_info_tells_equation_and_defaults(capsys, name):
    code, out, _ = said(capsys, "info", name.replace("_", "-"))
    assert code == 0
    for parameter, value in getattr(bf.systems, name)().parameters.items():
        assert f"--set {parameter}={value}" in out


def test_systems_without_a_story_are_driven_by_a_displacement(capsys):
    left = set(bf.systems.__all__) - set(STORIES)
    driven = {"macro_slip_contact", "micro_slip_ring", "micro_slip_strip"}
    assert driven <= left
    for name in left:
        code, _, error = said(capsys, "trace", name)
        assert code == 2 and (f"bifurc hysteresis {name}" if name in driven else f"bf.systems.{name}()") in error


def test_hysteresis_prints_work_and_events_and_draws(capsys, tmp_path):
    code, out, _ = said(capsys, "hysteresis", "macro_slip_contact", "--out", str(tmp_path))
    assert code == 0 and "work a period 40.529433" in out and "0.4858075299" in out
    assert (tmp_path / "macro_slip_contact_loops.png").exists()


@pytest.mark.parametrize("name", STORIES)
def test_every_story_can_be_told(name):
    story = STORIES[name]
    system = getattr(bf.systems, name)()
    assert story.bounds[0] < story.bounds[1]
    for value in story.bounds:
        system.with_parameters(**{story.parameter: value})
    system.with_parameters(**story.basin)
    assert len(story.window) == 2


def test_version(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"bifurc {bf.__version__}\n"


class StandInBranch(fakes.FakeBranch):
    """A branch of stand-in orbits, one a row, that knows why it stopped."""

    stop_reason = ("bound", "bound")

    def __init__(self, rows, points, orbits):
        super().__init__(rows, points)
        self.orbits = orbits

    def save(self, path):
        io.write(path, {"kind": "branch"}, self.columns)


def stand_in_branch(offset, points=()):
    x = np.linspace(0.5, 2.0, 4)
    rows = {"s": x, "omega": x, "rms_0": x + offset, "n_events": np.zeros(4, int), "stable": np.ones(4)}
    return StandInBranch(rows, list(points), [stand_in_orbit(value, value + offset) for value in x])


def stand_in_orbit(omega, state, periods=1):
    return fakes.motion(parameters={"omega": omega}, state=np.array([state, 0.0]), periods=periods,
                        system=SimpleNamespace(omega=omega, elements=(RigidStop(),)), success=True)


@pytest.fixture
def layers(monkeypatch):
    """Stand-ins for tracing: lines rms = omega + offset; a grazing offers known lines again and a longer period."""
    traced = []

    def trace(orbit, parameter, bounds, progress, **options):
        offset = round(orbit.state[0] - orbit.parameters["omega"], 12)
        traced.append((offset, options))
        point = SimpleNamespace(kind="grazing", name="", parameter=1.0 + offset, s=1.0 + offset, error=1e-14, reverses=False,
                                status="located", measures={})
        return stand_in_branch(offset, [point] if offset < 0.3 else [])

    def switch_branch(point):
        return [stand_in_orbit(1.1, state) for state in (1.1, 1.4, 1.2)] + [stand_in_orbit(1.1, 2.0, periods=2)]

    def find_orbit(system, guess=None, periods=1):
        if guess is None:
            return stand_in_orbit(0.5, 0.5)
        offset = guess.state[0] - guess.parameters["omega"]
        return stand_in_orbit(system.omega, system.omega + offset)

    for function in (trace, switch_branch, find_orbit):
        monkeypatch.setattr(bf, function.__name__, function)
    return traced


def test_each_branch_is_followed_once_and_longer_periods_are_left(layers):
    branches = list(cli_branches.follow([stand_in_orbit(0.5, 0.5)], "omega", (0.5, 2.0), ds_max=0.1))
    assert [offset for offset, _ in layers] == [0.0, 0.3, 0.1]
    assert all(options == {"ds_max": 0.1} for _, options in layers)
    assert len(branches) == 3
    table = cli_branches.special_point_table("omega", branches)
    assert table.splitlines()[2:] == [
        "grazing                 1.000000000000       1.0e-14       1",
        "grazing                 1.100000000000       1.0e-14       3",
    ]
    assert cli_branches.special_point_table("omega", []) == "no special points"


def test_a_point_where_two_branches_meet_is_listed_once():
    points = [[SimpleNamespace(kind="grazing", parameter=value, error=0.0)] for value in (1.0, 1.0 + 1e-12, 1.0 + 1e-6)]
    table = cli_branches.special_point_table("omega", [SimpleNamespace(special_points=some) for some in points])
    assert len(table.splitlines()) == 4


def test_trace_saves_every_branch_and_the_picture(layers, capsys, tmp_path):
    code, out, _ = said(capsys, "trace", "impact_oscillator", "--no-basins", "--quiet", "--out", str(tmp_path))
    assert code == 0
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {f"impact_oscillator_omega_{k}.npz" for k in (1, 2, 3)} | {"impact_oscillator_omega.png"}
    assert "omega from 0.5 to 2" in out
    assert "branch 3: 4 orbits, ends: bound and bound" in out


def test_an_interrupt_keeps_the_finished_branches_and_draws_them(layers, capsys, tmp_path, monkeypatch):
    trace = bf.trace

    def interrupted(*arguments, **options):
        branch = trace(*arguments, **options)
        if len(layers) == 2:
            branch.stop_reason = ("bound", "interrupted")
        return branch

    monkeypatch.setattr(bf, "trace", interrupted)
    code, _, err = said(capsys, "trace", "impact_oscillator", "--quiet", "--out", str(tmp_path))
    assert code == 130
    assert err == "bifurc: interrupted; what was finished is on disk\n"
    assert {path.name for path in tmp_path.iterdir()} == {
        "impact_oscillator_omega_1.npz", "impact_oscillator_omega_2.npz", "impact_oscillator_omega.png"}


def test_no_orbit_to_start_from_is_said(capsys, tmp_path, monkeypatch):
    failed = SimpleNamespace(success=False, message="the motion did not settle; try more periods")
    monkeypatch.setattr(bf, "find_orbit", lambda system, guess, periods: failed)
    code, _, err = said(capsys, "trace", "impact_oscillator", "--out", str(tmp_path))
    assert code == 2
    assert err == "bifurc: error: no orbit to start from: the motion did not settle; try more periods\n"


def test_basin_command_prints_fractions_trust_and_saddle_and_draws(capsys, tmp_path):
    code, out, _ = said(capsys, "basins", "impact_oscillator", "--window", "q0", "-2", "1", "--window", "v0", "-3", "3",
                        "--cells", "50", "--workers", "1", "--quiet", "--out", str(tmp_path))
    assert code == 0
    assert "basins of 50 x 50 starts" in out and "omega=1.4" in out
    assert "period 1, 1 impact" in out and "-0.182163+0.777953i, -0.182163-0.777953i" in out
    assert "Every label can be trusted" in out and "boundary entropy 0." in out
    assert "saddle: period 1, 1 impact, multipliers 2.720790, 0.114971" in out
    assert {path.name for path in tmp_path.iterdir()} == {
        "impact_oscillator_basins.npz", "impact_oscillator_basins.png", "impact_oscillator_motions.png"}
    assert bf.load(tmp_path / "impact_oscillator_basins.npz").grid.names == ("q0", "v0")


# points of the default branch in closed form: omega^2 = (1 - 2 zeta^2) -+ sqrt((1 - 2 zeta^2)^2 - 1 + (F/gap)^2), and
# the one-impact orbits' trace of the monodromy, which is affine in 1 / impact speed
DEFAULT_POINTS = {"grazing": (0.696191, 1.226914), "period doubling": (0.710690, 0.824134, 0.923529),
                  "fold": (1.527621,)}


def test_the_default_job(capsys, tmp_path):
    code, out, err = said(capsys, "trace", "impact_oscillator", "--cells", "60", "--quiet", "--out", str(tmp_path))
    assert (code, err) == (0, "")
    found: dict[str, list[float]] = {}
    for line in out.splitlines():
        for kind in ("grazing", "period doubling", "fold", "branch point", "neimark sacker"):
            if line.startswith(kind + " "):
                found.setdefault(kind, []).append(float(line[len(kind):].split()[0]))
    assert set(found) == set(DEFAULT_POINTS)
    for kind, values in DEFAULT_POINTS.items():
        np.testing.assert_allclose(sorted(found[kind]), values, rtol=0, atol=6e-7)
    for name in ("omega.png", "basins.png", "motions.png"):
        picture = matplotlib.image.imread(tmp_path / f"impact_oscillator_{name}")
        assert picture.shape[1] >= 1800
        assert picture[..., :3].std() > 0.05
    branch = bf.load(tmp_path / "impact_oscillator_omega_1.npz")
    assert branch.parameter == "omega"
    assert bf.load(tmp_path / "impact_oscillator_basins.npz").labels.shape == (60, 60)


@pytest.mark.slow
def test_the_story_of_a_rotor(capsys, tmp_path):
    """The whirl without rub touches where its radius is the clearance that the offset leaves, 1 - .6."""
    code, out, err = said(capsys, "trace", "jeffcott_rotor", "--no-basins", "--quiet", "--out", str(tmp_path))
    assert (code, err) == (0, "")
    first = next(line for line in out.splitlines() if line.startswith("grazing "))
    assert float(first.split()[1]) == pytest.approx(0.8206310877120871, abs=1e-11)
    assert all(f"{kind} " in out for kind in ("fold", "period doubling", "neimark sacker"))
    branch = bf.load(tmp_path / "jeffcott_rotor_nu_1.npz")
    signatures = {orbit.signature for orbit in (branch.orbits[0], branch.orbits[len(branch.orbits) - 1])}
    assert signatures == {"free / 1 T", "in contact / 1 T"}


def test_the_program_is_installed():
    done = subprocess.run([sys.executable, "-m", "bifurc", "info", "pendulum"], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith("bifurc: error: ")


def test_without_a_command_help_is_printed(capsys):
    """As pip does, with code 0; `python -m bifurc` is the command."""
    code, out, err = said(capsys)
    assert (code, err) == (0, "") and out.startswith("usage: bifurc ") and "trace" in out and "certify" in out
    done = subprocess.run([sys.executable, "-m", "bifurc"], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, out, "")


@pytest.mark.parametrize("arguments", [["info"], ["info", "impact_oscillator"], ["--help"], ["trace", "--help"], ["--version"],
                                       ["completion", "bash"], [], ["trace", "pendulum"]])
def test_who_has_read_enough_is_told_nothing_more(arguments):
    """The reader has gone before anything is printed, of errors too: no traceback, the code of a shell for a broken pipe."""
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run([sys.executable, "-m", "bifurc", *arguments], stdout=write, stderr=subprocess.PIPE, text=True)
    failed = arguments == ["trace", "pendulum"]
    quiet = (0, 141) if any(word in ("--help", "--version") for word in arguments) else (141,)  # argparse may give up
    assert done.returncode in ((2,) if failed else quiet) and done.stderr.startswith("bifurc: error: ") == failed
    assert "Broken pipe" not in done.stderr and "Traceback" not in done.stderr and done.stderr.count("\n") == failed
    done = subprocess.run([sys.executable, "-m", "bifurc", *arguments], stdout=write, stderr=write)
    os.close(write)
    assert done.returncode in quiet


def test_a_pipe_that_is_read_in_part_ends_quietly():
    """`bifurc info | head -1`, in a shell."""
    line = f"set -o pipefail; {sys.executable} -m bifurc info | head -1"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True)
    assert done.stdout.count("\n") == 1 and done.stdout.startswith("bifurc ") and done.stderr == "" and done.returncode in (0, 141)


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("arguments", [["info"], ["info", "impact_oscillator"], ["completion", "bash"], []])
def test_output_that_finds_no_room_is_an_error_in_one_line(arguments, unbuffered):
    """Written at once, or from a buffer at the end of the process."""
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-m", "bifurc", *arguments], stdout=full, stderr=subprocess.PIPE, text=True,
                              env=os.environ | {"PYTHONUNBUFFERED": unbuffered})
    assert done.returncode == 2 and done.stderr == "bifurc: error: [Errno 28] No space left on device\n"


def test_trace_starts_from_a_state_saves_and_prints_json(capsys, tmp_path, monkeypatch):
    import json

    monkeypatch.chdir(tmp_path)
    code, out, err = said(capsys, "trace", "impact_oscillator", "--set", "omega=1.4", "--bounds", "1.35", "1.45",
                          "--start", "-0.2", "2.4", "--no-basins", "--quiet", "--json", "--save", "first.npz")
    result = json.loads(out)
    assert code == 0 and "branch 1" in err
    assert result["parameter"] == "omega" and result["branches"][0]["rows"] == len(bf.load("first.npz"))
    assert bf.System.from_record(result["system"]).omega == 1.4
    branch = bf.load(result["branches"][0]["file"])
    assert branch.column("n_events").min() == 1  # the impacting motion, not the one from rest
    assert result["branches"][0]["special_points"] == []


def test_completion_knows_commands_systems_and_options(capsys, tmp_path):
    for shell in ("bash", "zsh", "fish"):
        code, out, _ = said(capsys, "completion", shell)
        assert code == 0 and "friction_damped_oscillator" in out and "harmonics" in out
    script = said(capsys, "completion", "bash")[1]
    ask = 'COMP_WORDS=(bifurc trace imp) COMP_CWORD=2; _bifurc; echo "${COMPREPLY[@]}"'
    done = subprocess.run(["bash", "-c", f"{script}\n{ask}"], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == {"impact_oscillator", "impact_chain"}
    ask = 'COMP_WORDS=(bifurc fr) COMP_CWORD=1; _bifurc; echo "${COMPREPLY[@]}"'
    assert subprocess.run(["bash", "-c", f"{script}\n{ask}"], capture_output=True, text=True, check=True).stdout.split() == ["frf"]


def test_measured_points_are_read_or_refused(tmp_path):
    from bifurc.cli.common import UsageError
    from bifurc.cli.frf import read_points

    file = tmp_path / "points.csv"
    file.write_text("omega; amplitude\n1.0, 2.5\n# a remark\n1.5;\t3.5 ; 9\n\n")
    assert np.array_equal(read_points(file), [[1.0, 2.5], [1.5, 3.5]])
    for text, words in (("a b\n", "no points"), ("1 2\nx 3\n", "line 2"), ("1\n", "line 1"), ("1 nan\n", "line 1")):
        file.write_text(text)
        with pytest.raises(UsageError, match=words):
            read_points(file)


def test_bounds_are_a_range_in_whichever_order_they_are_given():
    """The story's own, or half to twice the value of another parameter."""
    system, story = bf.systems.impact_oscillator(gap=-0.4), STORIES["impact_oscillator"]
    options = SimpleNamespace(bounds=(2.0, 1.0))
    assert common.range_of(options, system, story, "omega") == (1.0, 2.0)
    assert common.range_of(SimpleNamespace(bounds=None), system, story, "gap") == (-0.8, -0.2)
