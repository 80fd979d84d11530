"""Commands and desk with plain functions in the place of what computes: what is asked for, kept, shown and said."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.explore import desk as desks
from bifurc.explore import model
from bifurc.explore.desk import Desk
from bifurc.explore.script import Made, Script
from bifurc.explore.work import Ticket

SYSTEM = bf.systems.impact_oscillator(omega=1.4)


def made(value, kind="orbit", needs=()):
    return Made(value, kind, lambda script, *names: f"{kind}()", needs)


def orbit_of(system=SYSTEM, success=True, message="found", y=None, periods=2):
    y = np.array([[0.5, 3.0], [-1.0, 0.0], [0.25, -2.0]]) if y is None else y
    return SimpleNamespace(system=system, success=success, message=message, state=np.array([0.1, 0.2]), periods=periods,
                           sample=lambda count: (None, y), periodic=True)


def shown_of(**more):
    return model.Shown(SYSTEM, "omega", (1.3, 1.5), **more)


# small things

def test_ranges_that_nobody_gave():
    assert model.reach(2.0) == (1.0, 4.0) and model.reach(-2.0) == (-4.0, -1.0) and model.reach(0.0) == (-1.0, 1.0)
    assert "omega" in model.parameters(SYSTEM) and all(type(SYSTEM.parameters[name]) is float for name in model.parameters(SYSTEM))
    page = model.of_system(SYSTEM)
    assert page.parameter == "omega" and page.bounds == (0.7, 2.8) and page.window == {} and page.system.omega == 1.4
    page = model.of_system(SYSTEM, "omega", (2.0, 3.0), {"q0": (0.0, 1.0)})
    assert page.bounds == (2.0, 3.0) and page.system.omega == 2.0 and page.window == {"q0": (0.0, 1.0)}
    assert model.of_system(SYSTEM, "omega", (0.5, 1.0)).system.omega == 1.0
    for bounds in ((3.0, 2.0), (1.0, 1.0), (1.0, math.inf), (math.nan, 1.0)):
        with pytest.raises(ValueError, match="bounds"):
            model.of_system(SYSTEM, "omega", bounds)
    with pytest.raises(ValueError, match="autonomous"):
        model.of_system(bf.System(1.0, 0.1, 1.0, ()))


def test_a_slice_lies_around_the_coordinate_that_moves_most():
    assert model.around(shown_of()) == {"q0": (-2.0, 2.0), "v0": (-2.0, 2.0)}
    assert model.around(shown_of(orbit=made(orbit_of()))) == {"q0": (-1.6, 1.6), "v0": (-3.0 * 1.6, 3.0 * 1.6)}
    two = bf.System(np.eye(2), np.eye(2), np.eye(2), (bf.elements.HarmonicForce(1.0, dof=0),), omega=1.0)
    y = np.array([[5.0, 1.0, 0.0, 2.0], [5.5, -1.0, 0.0, -3.0]])  # the second moves more, about zero
    found = model.around(model.Shown(two, "omega", (1.0, 2.0), orbit=made(orbit_of(two, y=y))))
    assert found == {"q1": (-1.6, 1.6), "v1": (pytest.approx(-4.8), pytest.approx(4.8))}


def test_steps_are_undone_one_by_one_and_a_drag_at_once():
    session = model.Session(shown_of())
    assert not session.can_go_back and session.back() is session.first
    for k in range(3):
        session.put({"message": f"drag {k}"}, "drag omega")
    session.rest()
    session.put({"message": "again"}, "drag omega")
    session.put({"message": "quiet"})
    session.put({"message": "trace"}, "trace")
    assert session.can_go_back
    assert [session.back().message for _ in range(4)] == ["quiet", "drag 2", "", ""]
    session.put({"message": "x"}, "trace")
    assert session.reset() is session.first and not session.can_go_back


def test_branches_fit_where_only_the_traced_parameter_differs():
    def branch(**changes):
        return made(SimpleNamespace(orbits=[SimpleNamespace(system=SYSTEM.with_parameters(**changes))], parameter="omega"))
    page = shown_of()
    assert page.fits(branch(omega=1.2)) and not page.fits(branch(amplitude=0.1)) and page.fits(branch())


# commands

def test_an_orbit_is_looked_for_from_the_one_that_is_shown_and_then_from_rest(monkeypatch):
    asked = []

    def find(system, guess=None, periods=None):
        asked.append((system.omega, guess, periods))
        if guess is not None and system.omega > 1.45:
            raise ValueError("beyond a stop")
        return orbit_of(system, success=system.omega < 1.6 and (guess is None or system.omega < 1.42), message=f"at {system.omega}")
    monkeypatch.setattr(bf, "find_orbit", find)
    page = shown_of(orbit=made(orbit_of()))
    near = model.change_parameters(page, {"omega": 1.41})
    assert asked == [(1.41, (0.1, 0.2), 2)] and near["orbit"].value.success and near["system"].omega == 1.41
    assert near["message"] == "at 1.41" and near["place"] is None
    text = near["orbit"].write(SimpleNamespace(system=lambda system: "S"))
    assert text == "bf.find_orbit(S, guess=(0.1, 0.2), periods=2)"
    asked.clear()
    for omega in (1.43, 1.5):  # no success; an error
        change = model.change_parameters(page, {"omega": omega})
        assert change["orbit"].value.success and asked[-1] == (omega, None, None)
        assert change["orbit"].write(SimpleNamespace(system=lambda system: "S")) == "bf.find_orbit(S)"
    none = model.change_parameters(page, {"omega": 1.7})
    assert none["orbit"] is None and none["message"] == "at 1.7" and none["system"].omega == 1.7
    asked.clear()
    assert model.begin(shown_of())["orbit"].value.success and asked == [(1.4, None, None)]
    assert model.begin(page) == {}


def test_branches_reach_over_the_bounds_and_the_value(monkeypatch):
    asked = []

    def trace(orbit, parameter, bounds):
        asked.append((parameter, bounds))
        if len(asked) > 3:
            raise ValueError("it ends at once")
        return "a branch"
    monkeypatch.setattr(bf, "trace", trace)
    assert "no orbit" in model.trace_here(shown_of())["message"]
    for omega, want in ((1.4, (1.3, 1.5)), (1.2, (1.2, 1.5)), (1.8, (1.3, 1.8))):
        page = model.Shown(SYSTEM.with_parameters(omega=omega), "omega", (1.3, 1.5), (made("old", "branch"),), made(orbit_of()))
        change = model.trace_here(page)
        assert asked[-1] == ("omega", want)
        assert [item.value for item in change["branches"]] == ["old", "a branch"] and change["message"].startswith("branch 2: ")
        assert change["branches"][1].needs == (page.orbit,)
        assert change["branches"][1].write(None, "name") == f"bf.trace(name, 'omega', bounds={want!r})"
    assert model.trace_here(page) == {"message": "it ends at once"}


def test_branches_are_switched_at_a_special_point(monkeypatch):
    class Switched(list):
        status = "two others"
    point, branch = object(), made(SimpleNamespace(special_points=["p0", object()]), "branch")
    branch.value.special_points[1] = point
    starts = Switched(["s0", "s1", "s2"])
    monkeypatch.setattr(bf, "switch_branch", lambda p: starts if p is point else Switched())
    monkeypatch.setattr(bf, "trace", lambda orbit, parameter, bounds: f"from {orbit}")
    assert "click a special point" in model.switch_here(shown_of(branches=(branch,), place=(0, 3)))["message"]
    page = shown_of(branches=(branch,), place=(0, -2))
    assert page.special_point is point
    change = model.switch_here(page)
    assert [item.value for item in change["branches"][1:]] == ["from s0", "from s1"]  # BOTH of them
    assert change["message"].startswith("two others; branch 2: ") and "branch 3: " in change["message"]
    others = change["branches"][2].needs[0]
    assert others.write(None, "x") == "x[1]" and others.needs[0].write(None, "b") == "bf.switch_branch(b.special_points[1])"
    other = shown_of(branches=(branch,), place=(0, -1))
    assert model.switch_here(other)["message"] == "no other branch here: two others"


def test_a_map_takes_the_attractors_of_the_last_map_of_its_system_that_found_new_ones(monkeypatch):
    asked = {}

    def basins(system, grid, attractors=None, file=None, executor=None):
        asked.update(grid=grid, attractors=attractors, file=file, executor=executor)
        return SimpleNamespace(system=system, grid=grid, attractors=["A", "B"], fractions={0: 0.25, 1: 0.5})
    monkeypatch.setattr(bf, "basins_of_attraction", basins)
    monkeypatch.setattr(bf.plotting, "describe", lambda item: f"<{item}>")
    window = {"q0": (-1.0, 2.0), "v0": (0.0, 4.0)}
    change = model.map_here(shown_of(), window, 8, "f", "e")
    assert asked["grid"].shape == (8, 8) and asked["attractors"] is None and (asked["file"], asked["executor"]) == ("f", "e")
    assert list(asked["grid"].low) == [-1.0, 0.0] and list(asked["grid"].high) == [2.0, 4.0]
    assert change["window"] == window and change["message"] == "<A> 25 %, <B> 50 %" and change["basins"].needs == ()
    first = change["basins"]
    page = shown_of(basins=first, window=window)
    second = model.map_here(page, cells=4)["basins"]
    assert asked["attractors"] == ["A", "B"] and second.needs == (first,) and asked["grid"].shape == (4, 4)
    third = model.map_here(shown_of(basins=second, window=window))["basins"]
    assert third.needs == (first,)  # the second found nothing new
    other = model.Shown(SYSTEM.with_parameters(omega=1.45), "omega", (1.3, 1.5), basins=first, window=window)
    assert model.map_here(other)["basins"].needs == () and asked["attractors"] is None
    monkeypatch.setattr(bf, "basins_of_attraction", lambda *a, **k: SimpleNamespace(system=SYSTEM, attractors=[], fractions={}))
    assert model.map_here(page)["message"] == "no attractor was found"


@pytest.mark.parametrize("value", [
    None, True, 3, 0.1, -1e-300, math.inf, -math.inf, "it's", (), (1.5,), (1, (2,)), [], [0.25], {"a": (1.0,), "b": [None]},
    np.float64(0.3), np.arange(3.0), np.array([[1, 2]]), bf.elements.RigidStop(0.3, 0.7),
    bf.elements.LinearSpring(2.0, row=(1.0, -1.0))])
def test_values_are_written_as_text_that_gives_them_back(value):
    again = eval(Script([]).literal(value), {"bf": bf})
    plain = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    assert again == plain and type(again) is type(plain)


def test_a_map_over_the_components_of_the_last_one_lies_in_the_same_slice(monkeypatch):
    """Values of the other components stay, an angle is one while all of it is mapped; the line of the script says both."""
    monkeypatch.setattr(bf, "basins_of_attraction", lambda system, grid, **options: SimpleNamespace(
        system=system, grid=grid, attractors=[], fractions={}))
    saved = bf.Grid(at={"q1": 0.25}, periodic=("q0",), q0=(0.0, 6.0, 9), v0=(-1.0, 1.0, 9))
    whole = {"q0": (0.0, 6.0), "v0": (-1.0, 1.0)}
    page = shown_of(basins=made(SimpleNamespace(system=SYSTEM, grid=saved, attractors=[])), window=whole)
    closer = {"q0": (0.0, 3.0), "v0": (-1.0, 1.0)}
    for window, periodic in ((None, ("q0",)), (closer, ()), ({"q0": (0.0, 6.0), "v0": (0.0, 1.0)}, ("q0",))):
        item = model.map_here(page, window, 4)["basins"]
        assert item.value.grid.at == {"q1": 0.25} and item.value.grid.periodic == periodic
        line = item.write(Script([]))
        assert eval(line[line.index("bf.Grid"):-1], {"bf": bf}) == item.value.grid
    other = model.map_here(page, {"q1": (0.0, 1.0), "v0": (0.0, 1.0)}, 4)["basins"].value.grid
    assert other.at == {} and other.periodic == ()


def test_a_start_leads_to_the_attractor_of_its_cell():
    grid = bf.Grid(q0=(0.0, 2.0, 2), v0=(0.0, 2.0, 2))
    regular, chaos = orbit_of(), SimpleNamespace(periodic=False, regime="chaotic")
    basins = SimpleNamespace(grid=grid, labels=np.array([[0, 1], [-1, 0]]), attractors=[regular, chaos])
    page = shown_of(basins=made(basins, "basins"))
    assert model.settle_on(page, 0.5, 0.5)["orbit"].value is regular
    assert model.settle_on(page, 1.5, 1.5)["message"] == "attractor 0 of the basin map"
    assert model.settle_on(page, 1.5, 1.5)["place"] is None
    assert "chaotic" in model.settle_on(page, 0.5, 1.5)["message"]
    for place in ((1.5, 0.5), (5.0, 0.5)):
        assert "no attractor is known" in model.settle_on(page, *place)["message"]
    assert "no basin map" in model.settle_on(shown_of(), 0.0, 0.0)["message"]


# the desk

class AtOnce:
    """A worker that works when it is asked."""

    def __init__(self, name, idle):
        self.name, self.busy, self.valid, self.dropped, self.closed = name, False, True, 0, False

    def ask(self, work, done):
        ticket = Ticket()
        ticket.valid = self.valid
        try:
            result = work(ticket)
        except Exception as error:  # as workers do
            result = error
        done(result)

    def drop(self):
        self.dropped += 1

    def close(self):
        self.closed = True


@pytest.fixture
def desk(monkeypatch, tmp_path):
    monkeypatch.setattr(desks, "Worker", AtOnce)
    made_desk = Desk(shown_of(window={"q0": (0.0, 1.0), "v0": (0.0, 2.0)}), tmp_path, workers=3, fine=24, coarse=12)
    yield made_desk
    made_desk.close()


def test_the_first_page_alone_begins_and_is_what_reset_returns_to(desk, monkeypatch):
    monkeypatch.setattr(model, "begin", lambda shown: {"orbit": "o"})
    monkeypatch.setattr(model, "trace_here", lambda shown: {"branches": (*shown.branches, "b")})
    told = []
    desk.attach(lambda: told.append(desk.now))
    assert desk.now.orbit == "o" and desk.now.branches == ("b",) and told[-1] is desk.now
    first = desk.session.first
    assert first is desk.now and not desk.session.can_go_back
    second = [].append
    desk.attach(second)
    assert desk.now.branches == ("b",)  # not again
    desk.detach(second)
    desk.detach(second)
    desk.trace()
    assert desk.now.branches == ("b", "b") and desk.session.can_go_back
    desk.back()
    assert desk.now.branches == ("b",) and desk.orbits.dropped == desk.branches.dropped == desk.maps.dropped == 1
    desk.trace()
    desk.trace()  # each is a step of its own
    desk.back()
    assert desk.now.branches == ("b", "b")
    desk.reset()
    assert desk.now is first and desk.maps.dropped == 3


def test_maps_are_coarse_and_then_fine_and_errors_are_said(desk, monkeypatch):
    asked = []

    def mapped(shown, ranges, cells, file, executor):
        asked.append((ranges, cells, file.name, executor._max_workers))
        return {"basins": made(SimpleNamespace(system=SYSTEM, attractors=[], cells=cells), "basins"), "window": ranges,
                "message": str(cells)}
    monkeypatch.setattr(model, "map_here", mapped)
    window = {"q0": (0.0, 1.0), "v0": (0.0, 2.0)}
    desk.map()
    assert [(ranges, cells, workers) for ranges, cells, _, workers in asked] == [(window, 12, 3), (window, 24, 3)]
    assert asked[0][2] != asked[1][2] and desk.now.message == "24"
    desk.back()
    assert desk.now.basins is None  # both are one step
    asked.clear()
    desk.map(window, fine=False)
    assert [cells for _, cells, *_ in asked] == [12] and desk.now.message == "12"
    asked.clear()
    desk.zoom({"q0": (0.0, 1.0 + 1e-10), "v0": (0.0, 2.0)})  # it has not moved
    assert not asked
    desk.zoom({"q0": (0.0, 1.0), "v0": (0.1, 2.0)})
    assert [cells for _, cells, *_ in asked] == [12, 24] and desk.now.window["v0"] == (0.1, 2.0)
    asked.clear()
    desk.zoom({"q0": (0.0, 1.0), "v1": (0.1, 2.0)})
    assert len(asked) == 2
    asked.clear()
    desk.maps.valid = False  # a newer request came
    desk.map(window)
    assert not asked
    desk.maps.valid = True
    monkeypatch.setattr(model, "trace_here", lambda shown: 1 / 0)
    before = desk.now
    desk.trace()
    assert desk.now.message == "ZeroDivisionError: division by zero" and desk.now.basins is before.basins


def test_a_drag_is_one_step_and_the_slice_follows(desk, monkeypatch):
    asked = []
    monkeypatch.setattr(model, "change_parameters", lambda shown, values: {"message": str(values)})
    monkeypatch.setattr(model, "map_here", lambda shown, ranges, cells, file, executor: asked.append(cells) or {})
    desk.change("omega", 1.41)
    desk.change("omega", 1.42, done=True)
    assert not asked  # no slice is shown
    assert desk.now.message == "{'omega': 1.42}"
    desk.change("omega", 1.43)
    desk.back()
    assert desk.now.message == "{'omega': 1.42}"
    desk.back()
    assert desk.now.message == ""
    desk.session.put({"basins": made(SimpleNamespace(system=SYSTEM, attractors=[]), "basins")})
    desk.change("omega", 1.41)
    assert asked == [12]
    desk.change("omega", 1.42, done=True)
    assert asked == [12, 12, 24]


def test_what_is_asked_of_the_desk_goes_to_its_command(desk, monkeypatch):
    said = []
    for name in ("pick", "settle_on", "switch_here"):
        monkeypatch.setattr(model, name, lambda shown, *rest, name=name: said.append((name, *rest)) or {"message": name})
    desk.pick(1.0, 2.0, (3.0, 4.0))
    desk.settle_on(5.0, 6.0)
    desk.switch()
    assert said == [("pick", 1.0, 2.0, (3.0, 4.0)), ("settle_on", 5.0, 6.0), ("switch_here",)]
    desk.show_measure("max_0")
    assert desk.now.measure == "max_0"
    desk.back()
    assert desk.now.message == "settle_on"
    monkeypatch.setattr(model, "save", lambda shown, out: [desk.out / "a.py", desk.out / "b.npz"])
    desk.save()
    assert desk.now.message == f"saved a.py, b.npz in {desk.out.resolve()}"
    assert desk.busy == []
    desk.maps.busy = True
    assert desk.busy == ["map"]
    desk.close()
    assert desk.orbits.closed and desk.branches.closed and desk.maps.closed


def test_a_slice_has_one_file_as_long_as_system_window_cells_and_attractors_are_the_same(desk):
    window = {"q0": (0.0, 1.0), "v0": (0.0, 2.0)}
    known = SimpleNamespace(to_record=lambda: ({"kind": "orbit"}, {}))

    def page(**more):
        basins = made(SimpleNamespace(system=SYSTEM, attractors=[known] * more.pop("count", 0)), "basins")
        return shown_of(basins=basins, **more)
    names = [desk._file(page(), window, 12), desk._file(page(), window, 24), desk._file(page(count=1), window, 12),
             desk._file(page(), {**window, "q0": (0.0, 1.1)}, 12)]
    assert len(set(names)) == 4 and desk._file(page(), dict(window), 12) == names[0] == desk._file(shown_of(), window, 12)
    other = model.Shown(SYSTEM.with_parameters(omega=1.45), "omega", (1.3, 1.5), basins=page(count=1).basins)
    bare = model.Shown(SYSTEM.with_parameters(omega=1.45), "omega", (1.3, 1.5))
    assert desk._file(other, window, 12) == desk._file(bare, window, 12) != names[0]  # attractors of another system
