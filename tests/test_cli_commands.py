"""Commands from their arguments to what they ask for and print, with stand-ins for the computations."""

import argparse
import math
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc import cli
from bifurc.cli import atlas, branches, certify, common, explore, frf, maps, sweeps
from bifurc.cli.common import STORIES, UsageError, check_measure, number, range_of, set_values, window_of


@pytest.fixture(autouse=True)
def no_warming(monkeypatch):
    for module in (frf, atlas, explore, branches, maps, sweeps):
        monkeypatch.setattr(module, "warm_up", lambda: None)


def options_of(*arguments):
    return cli._parser().parse_args(arguments)


# arguments


def test_ranges_of_a_parameter():
    story, system = STORIES["impact_oscillator"], bf.systems.impact_oscillator(gap=0.0, amplitude=0.6)
    given = SimpleNamespace(bounds=None)
    assert range_of(given, system, story, "omega") == (0.5, 2.0)
    assert range_of(given, system, story, "amplitude") == (0.3, 1.2)
    assert range_of(given, system.with_parameters(amplitude=-0.6), story, "amplitude") == (-1.2, -0.3)
    assert range_of(SimpleNamespace(bounds=[3.0, 1.0]), system, story, "omega") == (1.0, 3.0)
    with pytest.raises(UsageError, match="gap is 0, which tells no range"):
        range_of(given, system, story, "gap")


def test_measures_windows_values_and_numbers():
    one, chain = bf.systems.impact_oscillator(), bf.systems.impact_chain(n=3)
    assert check_measure("rms_0", one) == "rms_0" and check_measure("h1_2", chain) == "h1_2"
    assert check_measure("period", one, ("period",)) == "period"
    for wrong, system in (("rms_1", one), ("h1_3", chain), ("max_00", one), ("mean_0", one), ("period", one), ("max_0x", one)):
        with pytest.raises(UsageError, match="is unknown; there are max_0"):
            check_measure(wrong, system)
    with pytest.raises(UsageError, match=r"max_0 \.\. max_2, min_0 \.\. min_2"):
        check_measure("x", chain)
    story = STORIES["impact_oscillator"]
    assert window_of(SimpleNamespace(window=None), story) is story.window
    assert window_of(SimpleNamespace(window=[("v0", "-2", "1e1"), ("q0", "0", "1")]), story) == {
        "v0": (-2.0, 10.0),
        "q0": (0.0, 1.0),
    }
    assert set_values("impact_oscillator", ["omega=0.75", "gap=2"]) == {"omega": 0.75, "gap": 2.0}
    assert set_values("impact_chain", ["n=4"]) == {"n": 4}
    assert number("-1e-3") == -1e-3
    for wrong in ("nan", "-inf", "x"):
        with pytest.raises(UsageError, match="a finite number is needed"):
            number(wrong)
    branch = SimpleNamespace(stop_reason=("bound", "max_steps"))
    assert common.reason(branch) == "bound and max steps"


def test_defaults_of_the_commands():
    for command in ("trace", "basins", "frf", "atlas", "sweep"):
        found = options_of(command, "impact_oscillator")
        assert (found.out, found.format, found.cells, found.workers, found.quiet, found.set) == (
            "bifurc-results",
            "png",
            None,
            None,
            False,
            [],
        )
    found = options_of(
        "frf",
        "jenkins_oscillator",
        "--bounds",
        "2",
        "1",
        "--vary",
        "limit",
        "1",
        "3",
        "--harmonics",
        "7",
        "--set",
        "zeta=1",
        "--set",
        "omega=2",
    )
    assert (found.bounds, found.vary, found.harmonics, found.measure, found.set) == (
        [2.0, 1.0],
        ["limit", "1", "3"],
        7,
        "max_0",
        ["zeta=1", "omega=2"],
    )
    found = options_of("atlas", "impact_oscillator")
    assert (found.samples, found.periods, found.measure, found.resume) == (1000, 8, None, True)
    assert not options_of("atlas", "impact_oscillator", "--no-resume").resume
    found = options_of("sweep", "impact_oscillator", "gap")
    assert (found.parameter, found.points, found.samples, found.branches, found.resume) == ("gap", 100, 1000, True, True)
    found = options_of("certify", "x.npz")
    assert (found.file, found.precision, found.rows_only) == ("x.npz", None, False)
    found = options_of("explore", "impact_oscillator")
    assert found.browser and not options_of("explore", "x", "--no-browser").browser


# frequency responses


@pytest.mark.parametrize(
    ("text", "points"),
    [
        ("omega,amplitude\n1, 2\n3;4\n", [[1, 2], [3, 4]]),
        ("1 2 7\n\n# more\n3 4 # here\n", [[1, 2], [3, 4]]),
        ("\ufeff1e-1\t2", [[0.1, 2]]),
    ],
)
def test_measured_points_are_read(text, points, tmp_path):
    file = tmp_path / "data.csv"
    file.write_text(text, encoding="utf-8")
    np.testing.assert_allclose(frf.read_points(str(file)), points)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("names only\n", "holds no points"),
        ("1 2\nx y\n", "line 2 is not two numbers: 'x y'"),
        ("1 2\n3\n", "line 2 is not two finite numbers"),
        ("1 nan\n", "line 1 is not two finite numbers"),
        ("", "holds no points"),
    ],
)
def test_points_that_cannot_be_read_are_told(text, words, tmp_path):
    file = tmp_path / "data.csv"
    file.write_text(text)
    with pytest.raises(UsageError, match=words):
        frf.read_points(str(file))


def test_what_is_compared():
    name, system = "jenkins_oscillator", bf.systems.jenkins_oscillator()
    assert frf._compared(name, system, SimpleNamespace(vary=None)) is frf._COMPARISONS[name]
    plain = frf._compared("duffing_oscillator", system, SimpleNamespace(vary=None))
    assert plain.name == "" and plain.values == (0.0,) and plain.variants == ("", ("",))
    given = frf._compared(name, system, SimpleNamespace(vary=["limit", "3", "1", "2"]))
    assert (given.name, given.values, given.span) == ("limit", (1.0, 2.0, 3.0), (1.0, 3.0))
    damped = frf._compared(
        "friction_damped_oscillator", bf.systems.friction_damped_oscillator(), SimpleNamespace(vary=["normal_load", "1", "2"])
    )
    assert damped.variants == ("damper", ("macro", "micro"))
    with pytest.raises(UsageError, match="two or more values, got 'limit 3'"):
        frf._compared(name, system, SimpleNamespace(vary=["limit", "3"]))
    assert (
        frf.rebuilt("friction_damped_oscillator", bf.systems.friction_damped_oscillator(), "damper", "micro").parameters
        == bf.systems.friction_damped_oscillator(damper="micro").parameters
    )


def peak(at, height, success=True, stable=True, load=0.0):
    true = SimpleNamespace(
        success=success,
        stable=stable,
        maximum=lambda dof: height + 0.25 + dof,
        minimum=lambda dof: -height,
        rms=lambda dof: 0.5 * height,
        harmonic=lambda k, dof: 1j * height * k,
    )
    solution = SimpleNamespace(system="S", stable=False, true=true)
    return SimpleNamespace(
        kind="peak",
        parameter=at,
        measures={"max_0": height, "limit": load},
        solution=solution,
        name="max_0",
        parameters={"limit": load},
    )


class Points(list):
    def of(self, kind):
        return [point for point in self if point.kind == kind]


def response(*peaks, stop=("bound", "bound")):
    saved = []
    return SimpleNamespace(special_points=Points(peaks), stop_reason=stop, saved=saved, save=lambda path: saved.append(path.name))


def test_lines_of_peaks(monkeypatch):
    monkeypatch.setattr(bf, "find_orbit", lambda system, guess: guess.true)
    lines = frf.peak_lines(
        response(peak(1.25, 3.0), peak(2.0, 1.0, stable=False), peak(2.5, 1.5, success=False), peak(3.0, 1.0, stable=None)),
        "max_0",
        "7",
    )
    assert lines[0].split() == ["7", "1.25000000", "3.000000", "3.250000", "yes"]
    assert lines[1].split()[-1] == "no" and lines[2].split()[-3:] == ["not", "found", "no"] and lines[3].split()[-1] == "unknown"
    assert frf.peak_lines(response(), "max_0", "7") == ["           7no peak in the range"]
    assert frf.highest(response(peak(1.0, 3.0), peak(2.0, 5.0), peak(3.0, 4.0)), "max_0") == 5.0
    assert frf.highest(response(), "max_0") is None
    orbit = peak(1.0, 3.0).solution.true
    assert [frf._height(orbit, name) for name in ("max_1", "min_0", "rms_0", "h1_0")] == [4.25, -3.0, 1.5, 3.0]


def test_the_highest_peak_of_a_response_in_the_middle_is_followed(monkeypatch):
    asked = []
    monkeypatch.setattr(bf, "trace_curve", lambda *arguments, **more: asked.append((arguments, more)) or "curve")
    compared = frf.Comparison("limit", (1.0, 2.0), (0.5, 4.0))
    rows = [
        response(peak(1.0, 1.0)),
        response(),
        response(peak(1.1, 2.0), peak(1.9, 5.0), peak(2.2, 3.0)),
        response(peak(3.0, 9.0)),
    ]
    assert frf.followed(rows, "omega", compared, (0.1, 3.0), "max_0") == "curve"
    (((point, names), more),) = asked
    assert point.parameter == 1.9 and names == ("limit", "omega") and more == {"bounds": {"limit": (0.5, 4.0), "omega": (0.1, 3.0)}}
    assert frf.followed([response()], "omega", compared, (0.1, 3.0), "max_0") is None
    assert frf.followed(rows[:1] + rows[3:], "omega", compared, (0.1, 3.0), "max_0") and asked[-1][0][0].parameter == 1.0


def test_responses_behind_the_end_of_a_curve_of_peaks(monkeypatch):
    asked = []

    class System:
        def with_parameters(self, **values):
            asked.append(values)
            return values

    monkeypatch.setattr(bf, "find_orbit", lambda system, method: SimpleNamespace(success=system["limit"] < 7.0, at=system))
    monkeypatch.setattr(bf, "trace", lambda orbit, parameter, bounds, peaks: response(peak(1.0, orbit.at["limit"])))
    curve = SimpleNamespace(column=lambda name: np.array([0.5, 2.0, 1.5]))
    compared = frf.Comparison("limit", (1.0, 2.0), (0.5, 8.0))
    found = frf.further(System(), "omega", compared, (0.1, 3.0), curve, None, SimpleNamespace(measure="max_0"))
    values = np.geomspace(2.0, 8.0, 13)[1:]
    np.testing.assert_allclose([values["limit"] for values in asked], values)
    assert all(values["omega"] == 0.1 for values in asked)
    np.testing.assert_allclose([v for v, _ in found], values[values < 7.0])
    assert [height for _, height in found] == [value for value, _ in found]
    assert (
        frf.further(System(), "omega", compared, (0.1, 3.0), SimpleNamespace(column=lambda name: np.array([8.0])), None, None) == []
    )


def test_a_run_of_responses(monkeypatch, tmp_path, capsys):
    started, traced, drawn = [], [], []

    def find_orbit(system, method=None, guess=None):
        if guess is not None:
            return guess.true
        started.append((system.parameters["limit"], system.parameters["omega"], method.harmonics))
        return SimpleNamespace(success=True, load=system.parameters["limit"])

    def trace(orbit, parameter, bounds, peaks, progress=True):
        traced.append((parameter, bounds, peaks, progress))
        return response(peak(1.5, orbit.load, load=orbit.load))

    extreme = peak(1.7, 0.125, load=2.5)
    extreme.kind = "extremum"
    curve = SimpleNamespace(
        special_points=[extreme, peak(1.0, 9.0)], column=lambda name: np.array([3.0]), save=lambda path: drawn.append(path.name)
    )
    monkeypatch.setattr(bf, "find_orbit", find_orbit)
    monkeypatch.setattr(bf, "trace", trace)
    monkeypatch.setattr(bf, "trace_curve", lambda *arguments, **more: curve)
    monkeypatch.setattr(frf, "draw", lambda *arguments: drawn.append(arguments))
    code = cli.main(
        [
            "frf",
            "jenkins-oscillator",
            "--bounds",
            "2",
            "1",
            "--vary",
            "limit",
            "3",
            "1",
            "--harmonics",
            "5",
            "--quiet",
            "--out",
            str(tmp_path / "r"),
        ]
    )
    assert code == 0
    assert started == [(1.0, 1.0, 5), (3.0, 1.0, 5)] and traced == [("omega", (1.0, 2.0), "max_0", False)] * 2
    out = capsys.readouterr().out
    assert "omega from 1 to 2, 5 harmonics" in out and "peak at omega" in out
    assert "extreme peak: 0.125 at limit = 2.5" in out and out.count("extreme") == 1
    name, (drawn_, compared, system, folder, _, measured) = drawn
    assert (
        name == "jenkins_oscillator_peaks.npz" and folder == tmp_path / "r" and measured is None and system == "jenkins_oscillator"
    )
    rows, found, peaks = drawn_[""]
    assert [row.saved for row in rows] == [["jenkins_oscillator_frf_1.npz"], ["jenkins_oscillator_frf_3.npz"]]
    assert found is curve and peaks == [(1.0, 1.0), (3.0, 3.0)] and compared.values == (1.0, 3.0)
    monkeypatch.setattr(bf, "trace", lambda *arguments, **more: response(stop=("interrupted", "bound")))
    assert cli.main(["frf", "jenkins-oscillator", "--vary", "limit", "3", "1", "--out", str(tmp_path)]) == 130
    monkeypatch.setattr(bf, "find_orbit", lambda system, method: SimpleNamespace(success=False, message="why"))
    assert cli.main(["frf", "jenkins-oscillator", "--vary", "limit", "3", "1", "--out", str(tmp_path)]) == 2
    assert "no response at limit = 1: why" in capsys.readouterr().err


# other commands


def test_a_run_of_an_atlas(monkeypatch, tmp_path, capsys):
    asked, forgotten = [], []
    found = SimpleNamespace(report=lambda: "the report", plot=lambda ax, measure: asked.append(("plot", measure)), failures=())
    monkeypatch.setattr(bf, "atlas", lambda *arguments, **more: asked.append((arguments, more)) or found)
    monkeypatch.setattr(atlas, "forget", lambda file, kind: forgotten.append(file))
    monkeypatch.setattr(bf.plotting, "save_figure", lambda figure, path: path)
    arguments = [
        "atlas",
        "impact-oscillator",
        "--bounds",
        "2",
        "1",
        "--samples",
        "30",
        "--periods",
        "3",
        "--workers",
        "2",
        "--measure",
        "max_0",
        "--out",
        str(tmp_path),
        "--format",
        "svg",
    ]
    assert cli.main(arguments) == 0 and forgotten == []
    (system, name, bounds, region), more = asked[0]
    assert (
        name == "omega"
        and bounds == (1.0, 2.0)
        and region == STORIES["impact_oscillator"].window
        and system == bf.systems.impact_oscillator()
    )
    file = tmp_path / "impact_oscillator_omega_atlas.npz"
    assert more == {"samples": 30, "periods": 3, "workers": 2, "file": file} and asked[1] == ("plot", "max_0")
    assert "the report" in (out := capsys.readouterr().out) and f"picture: {file.with_suffix('.svg')}" in out
    found.failures = ("one",)
    assert cli.main([*arguments, "--no-resume", "--parameter", "gap"]) == 1
    assert forgotten == [tmp_path / "impact_oscillator_gap_atlas.npz"]


def test_a_run_of_a_proof(monkeypatch, tmp_path, capsys):
    class Proof:
        proved, message = True, "all is proved"
        points, stretches = ("point",), (SimpleNamespace(proved=True), SimpleNamespace(proved=False))

        def save(self, path):
            self.path = path

        def __repr__(self):
            return "Proof()"

    proof, asked = Proof(), []

    class Branch(bf.Branch):
        def __init__(self):
            pass

        def certify(self, precision, stretches):
            asked.append((precision, stretches))
            return proof

    class Orbit(bf.PeriodicOrbit):
        def __init__(self):
            pass

        def certify(self, precision):
            asked.append(precision)
            return proof

    file = str(tmp_path / "b.npz")
    monkeypatch.setattr(bf, "load", lambda path: Branch())
    assert certify.run_certify(argparse.Namespace(file=file, precision=128, rows_only=True)) == 0
    assert asked == [(128, False)] and proof.path == tmp_path / "b.certificate.npz"
    out = capsys.readouterr().out
    assert (
        out.splitlines()[:3] == ["Proof()", "  'point'", "  namespace(proved=False)"] and "all is proved" in out and "saved" in out
    )
    certify.run_certify(argparse.Namespace(file=file, precision=None, rows_only=False))
    assert asked[-1] == (None, True)
    monkeypatch.setattr(bf, "load", lambda path: Orbit())
    proof.proved = False
    assert certify.run_certify(argparse.Namespace(file=file, precision=None, rows_only=False)) == 1
    assert asked[-1] is None and "point" not in capsys.readouterr().out.splitlines()[-3]

    def missing(self, precision):
        raise ImportError("install it")

    monkeypatch.setattr(Orbit, "certify", missing)
    with pytest.raises(ValueError, match="install it"):
        certify.run_certify(argparse.Namespace(file=file, precision=None, rows_only=False))
    monkeypatch.setattr(bf, "load", lambda path: 3)
    with pytest.raises(ValueError, match="holds a int; orbits and branches can be proved"):
        certify.run_certify(argparse.Namespace(file=file, precision=None, rows_only=False))


def test_a_run_of_the_explorer(monkeypatch, tmp_path, capsys):
    asked = []
    found = {"bokeh"}  # whether bokeh is installed is not what is asked
    util = SimpleNamespace(find_spec=lambda name: name if name in found else None)
    monkeypatch.setattr(explore, "importlib", SimpleNamespace(util=util))
    monkeypatch.setattr(bf.explore, "serve", lambda *arguments, **more: asked.append((arguments, more)))
    assert cli.main(["explore", "impact-oscillator", "--set", "gap=2", "--no-browser", "--workers", "3", "--out", "o"]) == 0
    (system, parameter, bounds), more = asked.pop()
    assert system.parameters["gap"] == 2.0 and (parameter, tuple(bounds)) == ("omega", (0.5, 2.0))
    assert (more["window"], more["out"], more["workers"], more["browser"]) == (STORIES["impact_oscillator"].window, "o", 3, False)
    cli.main(["explore", "impact-oscillator", "--parameter", "gap"])
    assert asked.pop()[0][1:] == ("gap", None)
    cli.main(["explore", "impact-oscillator", "--parameter", "gap", "--bounds", "1", "3"])
    assert asked.pop()[0][1:] == ("gap", [1.0, 3.0])
    cli.main(["explore", "impact-oscillator", "--bounds", "3", "1"])  # a range on the command line is one in whichever order
    assert asked.pop()[0][1:] == ("omega", [1.0, 3.0])
    file = tmp_path / "b.npz"
    file.write_text("")
    monkeypatch.setattr(bf, "load", lambda path: ("loaded", path))
    assert cli.main(["explore", str(file)]) == 0
    arguments, more = asked.pop()
    assert arguments == (("loaded", str(file)), None, None) and more["window"] is None and more["path"] == str(file.resolve())
    capsys.readouterr()
    for extra in (["--set", "gap=1"], ["--parameter", "gap"], ["--bounds", "1", "2"]):
        assert cli.main(["explore", str(file), *extra]) == 2
        assert "belong to a system" in capsys.readouterr().err
    assert cli.main(["explore", "macro_slip_contact"]) == 2 and "driven by a displacement" in capsys.readouterr().err
    found.clear()
    assert cli.main(["explore", "impact-oscillator"]) == 2 and "the explorer needs bokeh" in capsys.readouterr().err and not asked


def test_starts_of_systems_without_a_clock(monkeypatch):
    rest = SimpleNamespace(success=True)
    orbit = SimpleNamespace(success=True, message="none")
    hopf = SimpleNamespace(kind="hopf")
    monkeypatch.setattr(bf, "find_equilibrium", lambda system: rest)
    monkeypatch.setattr(bf, "find_orbit", lambda system, guess: orbit)
    traced = SimpleNamespace(special_points=Points([hopf, SimpleNamespace(kind="fold"), hopf]))
    monkeypatch.setattr(bf, "trace", lambda start, parameter, bounds: traced)
    monkeypatch.setattr(bf, "switch_branch", lambda point: [point.kind])
    assert branches.free_starts("S", "p", (0.0, 1.0)) == ([orbit, "hopf", "hopf"], [traced])
    orbit.success = False
    assert branches.free_starts("S", "p", (0.0, 1.0)) == (["hopf", "hopf"], [traced])
    rest.success = False
    with pytest.raises(UsageError, match="no orbit to start from: none"):
        branches.free_starts("S", "p", (0.0, 1.0))
    orbit.success = True
    assert branches.free_starts("S", "p", (0.0, 1.0)) == ([orbit], [])


def test_a_concentric_rotor_is_traced_in_the_turning_frame(capsys):
    rotor = bf.systems.jeffcott_rotor(nu=1.5)
    made = branches.turning(rotor, "nu")
    shared = set(made.parameters) & set(rotor.parameters)
    assert "nu" in shared and all(made.parameters[name] == rotor.parameters[name] for name in shared)
    assert "concentric: traced in the frame" in capsys.readouterr().out
    missing = next(iter(set(rotor.parameters) - set(made.parameters)))
    with pytest.raises(UsageError, match=f"which has no {missing}"):
        branches.turning(rotor, missing)


def test_branches_as_json_and_as_a_table():
    def point(kind, at, **more):
        return SimpleNamespace(
            **{"kind": kind, "name": "n", "parameter": at, "error": 1e-9, "reverses": True, "status": "located", **more}
        )

    def branch(*points):
        columns = {"s": [0, 1, 2], "p": np.array([3.0, 1.0, 2.0])}
        return SimpleNamespace(column=lambda name: columns[name], stop_reason=("bound", "closed"), special_points=points)

    made = [branch(point("fold", 1.5), point("period_doubling", 2.5)), branch(point("fold", 1.5 * (1 + 1e-10)), point("fold", 1.7))]
    found = branches.record(SimpleNamespace(to_record=lambda: {"x": 1}), "p", made, ["a", "b"])
    assert found["system"] == {"x": 1} and found["parameter"] == "p" and [row["file"] for row in found["branches"]] == ["a", "b"]
    first = found["branches"][0]
    assert (first["rows"], first["from"], first["to"], first["ends"]) == (3, 1.0, 3.0, ["bound", "closed"])
    assert first["special_points"][0] == {
        "kind": "fold",
        "name": "n",
        "parameter": 1.5,
        "error": 1e-9,
        "reverses": True,
        "status": "located",
    }
    lines = branches.special_point_table("p", made).splitlines()
    assert len(lines) == 5 and [line.split()[-1] for line in lines[2:]] == ["1", "1", "2"]
    assert lines[3].startswith("period doubling") and "2.500000000000" in lines[3] and "1.0e-09" in lines[3]
    assert branches.special_point_table("p", [branch()]) == "no special points"


def test_branches_of_the_largest_families_are_traced(monkeypatch):
    from bifurc.continuation import ContinuationError

    def track(number, share, *orbits):
        return SimpleNamespace(number=number, fractions=np.array([share]), attractors=orbits)

    def orbit(name, periodic=True):
        return SimpleNamespace(name=name, periodic=periodic)

    tracks = [
        track(k, share, orbit(f"bad{k}"), orbit("chaos", False), orbit(f"good{k}"))
        for k, share in enumerate((0.1, 0.5, 0.2, 0.3, 0.4, 0.05))
    ]
    found = SimpleNamespace(tracks=tracks, families=[(k,) for k in range(6)], parameter="p")
    asked = []

    def trace(item, parameter, bounds, progress):
        asked.append((item.name, parameter, bounds, progress))
        if item.name.startswith("bad"):
            raise ContinuationError("superstable")
        return item.name

    monkeypatch.setattr(bf, "trace", trace)
    assert sweeps.traced(found, (0.0, 1.0), True) == ["good1", "good4", "good3", "good2"]
    assert asked[0] == ("bad1", "p", (0.0, 1.0), False)


def test_basins_as_a_table(monkeypatch):
    monkeypatch.setattr(bf.plotting, "describe", lambda item: item.words)
    attractors = [
        SimpleNamespace(words="one", multipliers=np.array([0.5 + 0.25j, 0.5 - 0.25j])),
        SimpleNamespace(words="chaos", multipliers=None),
        SimpleNamespace(words="many", multipliers=np.array([0.9, -0.5, 0.25, 0.125, 0.0625])),
    ]
    entropy = SimpleNamespace(mixed=3, basin=0.25, boundary=0.5, side=5)
    basins = SimpleNamespace(
        attractors=attractors,
        fractions={0: 0.5, 1: 0.25, -1: 0.125},
        reliability=SimpleNamespace(statement="trust me"),
        entropy=lambda: entropy,
    )
    lines = maps.basin_table(basins).splitlines()
    assert lines[2].split() == ["0", "one", "0.500000", "0.500000+0.250000i,", "0.500000-0.250000i"]
    assert lines[3].split() == ["1", "chaos", "0.250000"] and lines[4].split() == [
        "2",
        "many",
        "0.000000",
        "0.900000,",
        "-0.500000,",
        "0.250000,",
        "0.125000",
    ]
    assert lines[5].split() == ["-1", "unresolved", "0.125000"] and lines[6] == "trust me"
    assert lines[7] == "basin entropy 0.2500, boundary entropy 0.5000 (boxes of 5 x 5 cells)"
    entropy.mixed = 0
    assert len(maps.basin_table(basins).splitlines()) == 7
    monkeypatch.setattr(bf, "edge_state", lambda basins, pair: pair)
    basins.reliability.kind = "cells"
    assert maps.saddles(basins) == [(0, 1), (0, 2), (1, 2)]
    basins.attractors = attractors + attractors
    assert maps.saddles(basins) == [(0, 1), (0, 2), (1, 2)]
    basins.reliability.kind = "fractions"
    assert maps.saddles(basins) == [] and math.isclose(maps.LARGEST, 3)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_offers_the_shells_the_systems_and_the_options(shell, capsys):
    assert cli.main(["completion", shell]) == 0
    text = capsys.readouterr().out
    assert "impact-oscillator" in text.replace("_", "-") and "--workers" in text.replace("-l workers", "--workers")
    line = next(line for line in text.splitlines() if "bash" in line and "zsh" in line)
    assert "fish" in line and "completion" in line


class Seen(Exception):
    """What a command would start from."""


@pytest.mark.parametrize("bounds, start", [(("2.1", "2.3"), 2.1), (("0.2", "0.4"), 0.4), (("0.2", "2.3"), None)])
def test_branches_start_within_their_bounds(bounds, start, tmp_path, monkeypatch):
    """At the parameter's own value, or where that lies outside at the nearer bound."""
    def found(system, story, options):
        raise Seen(system.parameter("omega"))
    monkeypatch.setattr(branches, "forced_start", found)
    monkeypatch.setattr(branches, "warm_up", lambda: None)
    with pytest.raises(Seen) as seen:
        cli.main(["trace", "impact_oscillator", "--parameter", "omega", "--bounds", *bounds, "--out", str(tmp_path)])
    own = bf.systems.impact_oscillator().parameter("omega")
    assert seen.value.args[0] == (own if start is None else start) and (start is None or start != own)
