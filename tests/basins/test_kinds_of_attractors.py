"""What a motion without a return is called, what a creeping one rests at, and which unions of boxes prove a label: on stand-ins."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.basins.attractors import attractors as rules
from bifurc.basins.attractors.attractors import ChaoticAttractor, QuasiperiodicAttractor

SCALE = np.array([2.0, 0.5])


class Scene:
    closed_form, period, ns, n = True, 3.0, 2, 1


@pytest.fixture
def world(monkeypatch):
    """Return what the parts of the decision answer; every motion is a cloud of points."""
    points = np.random.default_rng(3).normal(size=(rules.SAMPLE + rules.PROBE, 2))
    told = {"exponent": 0.01, "error": 1e-4, "attracts": True, "curve": True, "points": points, "lean": True, "trapping": None}
    asked = []
    scene = Scene()
    monkeypatch.setattr(rules, "scene_of", lambda system: scene)
    monkeypatch.setattr(rules, "Integrator", lambda scene, most: SimpleNamespace(lean=told["lean"]))
    monkeypatch.setattr(rules, "lyapunov_exponents", lambda system, y, periods, transient: asked.append(periods) or SimpleNamespace(
        values=np.array([told["exponent"], -1.0]), errors=np.array([told["error"], 0.0])))
    monkeypatch.setattr(rules, "largest_exponent", lambda lean, y, scale: (told["exponent"], told["error"]))
    monkeypatch.setattr(rules, "attracts", lambda system, y: told["attracts"])
    monkeypatch.setattr(rules, "settled", lambda lean, y, scale: told["points"])
    monkeypatch.setattr(rules, "followed", lambda system, y, count: None if told["points"] is None else told["points"][:count])
    monkeypatch.setattr(rules, "on_curve", lambda points: told["curve"])
    monkeypatch.setattr(rules, "filled", lambda points, scale, follow: points)
    monkeypatch.setattr(rules, "box_width", lambda points: float(np.abs(points[0]).sum()))
    monkeypatch.setattr(rules, "trapping", lambda lean, points, scale, width: told["trapping"])
    told["asked"], told["scene"] = asked, scene
    return told


def made(told, **changes):
    told.update(changes)
    return rules.sampled("system", np.zeros(2), SCALE)


def test_a_motion_is_chaotic_where_neighbours_separate_surely_and_by_much(world):
    """4000 periods of length 3: ten factors e are an exponent of 8.3e-4 per time."""
    found = made(world)
    assert isinstance(found, ChaoticAttractor) and found.exponent == 0.01 and found.exponent_error == 1e-4
    assert len(found.points) == rules.SAMPLE and found.cover is None and world["asked"] == [rules.EXPONENT_PERIODS]
    assert found.width == np.abs(world["points"][0] / SCALE).sum()
    limit = rules.FOLDS / (3.0 * rules.EXPONENT_PERIODS)
    assert isinstance(made(world, exponent=1.01 * limit, error=0.0), ChaoticAttractor)
    assert isinstance(made(world, exponent=0.99 * limit), QuasiperiodicAttractor)
    assert isinstance(made(world, exponent=-0.99 * limit), QuasiperiodicAttractor)
    assert made(world, exponent=-1.01 * limit) is None  # it dies: an orbit that was not found
    assert made(world, exponent=0.01, error=0.0026) is None  # ten factors, but not surely
    assert isinstance(made(world, exponent=0.01, error=0.0024), ChaoticAttractor)


def test_a_motion_that_is_neither_chaotic_nor_on_an_attracting_curve_is_none(world):
    torus = {"exponent": 1e-6, "error": 1e-6}
    found = made(world, **torus)
    assert isinstance(found, QuasiperiodicAttractor) and len(found.points) == rules.ON_CURVE + rules.PROBE
    assert made(world, attracts=False) is None
    assert made(world, attracts=True, curve=False) is None
    returns = world["points"].copy()
    assert made(world, curve=True, points=None) is None
    for count, none in ((rules.LONGEST, True), (rules.LONGEST + 1, False)):
        closed = returns.copy()
        closed[rules.ON_CURVE + rules.PROBE - 1] = closed[rules.ON_CURVE + rules.PROBE - 1 - count] + 0.5e-6 * SCALE * [1.0, 0.0]
        assert (made(world, points=closed) is None) is none  # it was a long transient
    chaos = returns.copy()
    chaos[-1] = chaos[-3]
    assert made(world, exponent=0.1, points=chaos) is None


def test_under_laws_the_exponent_is_that_of_fewer_periods_or_of_motions_side_by_side(world):
    world["scene"].closed_form = False
    span = 3.0 * rules.COMPARED
    assert isinstance(made(world, exponent=1.01 * rules.FOLDS / span), ChaoticAttractor) and not world["asked"]
    assert isinstance(made(world, exponent=0.99 * rules.FOLDS / span), QuasiperiodicAttractor)
    slow = rules.FOLDS / (3.0 * rules.LAW_PERIODS)
    assert isinstance(made(world, lean=False, exponent=1.01 * slow), ChaoticAttractor)
    assert isinstance(made(world, exponent=0.99 * slow), QuasiperiodicAttractor) and set(world["asked"]) == {rules.LAW_PERIODS}


def test_boxes_that_nothing_leaves_come_with_their_own_width(world):
    cover = np.array([[0.1, 0.2]])
    found = made(world, trapping=(cover, 0.25))
    assert np.array_equal(found.cover, cover) and found.width == 0.25
    assert made(world, lean=False).cover is None  # not asked for
    world["scene"].ns = 4
    assert made(world, lean=True).cover is None


@pytest.mark.parametrize("period", [3.0, None])
@pytest.mark.parametrize("value, attracts", [(-1.01, True), (-0.99, False)])
def test_a_torus_attracts_where_what_is_left_beside_it_dies(period, value, attracts, monkeypatch):
    """Along it lies one direction, without a clock two; FOLDS factors in LAW_PERIODS periods are asked for."""
    rate = value * rules.FOLDS / (rules.LAW_PERIODS * 3.0)
    values = np.array([0.0, rate, -5.0]) if period else np.array([0.0, 0.0, rate, -5.0])
    monkeypatch.setattr(rules, "scene_of", lambda system: None)
    monkeypatch.setattr(rules, "slowest", lambda scene: 3.0)
    monkeypatch.setattr(rules, "lyapunov_exponents", lambda system, y, periods, transient: SimpleNamespace(values=values))
    assert rules.attracts(SimpleNamespace(period=period), np.zeros(3)) is attracts
    values = values[:1 if period else 2]
    assert not rules.attracts(SimpleNamespace(period=period), np.zeros(3))


# motions that creep

class Creeping:
    """An orbit whose states lie about a place, with events."""

    events, intervals = ("slip",), {}

    def __init__(self, size):
        t = np.linspace(0.0, 2.0 * np.pi, rules.SEEN)
        self.states = np.column_stack([0.7 + 0.5 * size * np.cos(t), 0.5 * size * np.sin(t)]) * SCALE

    def sample(self, count):
        assert count == rules.SEEN
        return None, self.states


@pytest.fixture
def rests(monkeypatch):
    """Rest is possible at scaled places up to .7, and found where the guess is."""
    tried = []

    def find(system, guess, periods):
        tried.append(guess / SCALE)
        inside = guess[0] / SCALE[0] <= 0.7
        return SimpleNamespace(success=bool(inside), intervals={0: (-1.0, 1.4)} if inside else {}, place=guess)
    monkeypatch.setattr(rules, "find_orbit", find)
    monkeypatch.setattr(rules, "scene_of", lambda system: Scene())
    monkeypatch.setattr(rules, "section_points", lambda orbit: orbit.place[None])
    return tried


def test_what_creeps_is_the_rest_beside_it(rests):
    found = rules.at_rest("system", Creeping(0.9 * rules.CREEPING), SCALE)
    assert found is not None and found.place / SCALE == pytest.approx([0.7 - rules.CREEPING, 0.0], abs=1e-5)
    assert all(guess[1] == pytest.approx(0.0, abs=1e-12) for guess in rests)
    assert rules.at_rest("system", Creeping(1.1 * rules.CREEPING), SCALE) is None  # a motion that is seen
    still, member = Creeping(0.0), Creeping(0.0)
    still.events, member.intervals = (), {0: (0.0, 1.0)}
    assert rules.at_rest("system", still, SCALE) is None and rules.at_rest("system", member, SCALE) is None


def test_a_rest_elsewhere_is_another_motion(rests, monkeypatch):
    monkeypatch.setattr(rules, "section_points", lambda orbit: orbit.place[None] + 4.0 * rules.CREEPING * SCALE)
    assert rules.at_rest("system", Creeping(0.0), SCALE) is None


# continua

def test_members_of_one_continuum_differ_in_their_memory_and_what_follows(monkeypatch):
    def orbit(z, x, family=(2,), events=3):
        return SimpleNamespace(family=list(family), system=SimpleNamespace(n=1), sequence=SimpleNamespace(events=events),
                               state=np.array([x, 0.0, z]))
    scale = np.array([2.0, 0.5, 2.0])
    monkeypatch.setattr(rules, "section_points", lambda orbit: orbit.state[None])
    monkeypatch.setattr(rules, "continuum", lambda a: SimpleNamespace(member=lambda z: orbit(z, 0.3 + 0.5 * z)))
    monkeypatch.setattr(rules, "relabelled", lambda a, values: orbit(values[0], 9.0))
    one, other = orbit(0.0, 0.3), orbit(0.4, 0.5)
    assert rules.one_continuum(one, other, scale) and not rules.one_continuum(one, orbit(0.4, 0.6), scale)
    for changed in (orbit(0.4, 0.5, family=()), orbit(0.4, 0.5, family=(1,))):
        assert not rules.one_continuum(one, changed, scale)
    assert not rules.one_continuum(orbit(0.0, 0.3, events=0), other, scale)
    assert not rules.one_continuum(orbit(0.0, 0.3, family=(1,)), orbit(0.4, 0.5, family=(1,)), scale)  # a place is no memory
    monkeypatch.setattr(rules, "continuum", lambda a: None)
    assert not rules.one_continuum(one, other, scale) and rules.one_continuum(one, orbit(0.4, 9.0), scale)


def test_boxes_prove_a_label_where_all_are_of_one_width_and_hold_no_other_attractor(monkeypatch):
    monkeypatch.setattr(rules, "section_points", lambda item: item.points)

    def chaos(centre, width=0.5, cover=True):
        boxes = (np.array(centre) + 0.5) * width * SCALE
        return ChaoticAttractor("system", boxes[None], 1.0, 0.1, width, boxes[None] if cover else None)
    orbit = SimpleNamespace(points=np.array([[0.6, 0.7]]) * 0.5 * SCALE)  # in the box (0, 0)
    assert rules._proven([chaos((0, 1)), orbit, chaos((3, 3))], 0.5, SCALE)
    assert not rules._proven([chaos((0, 0)), orbit], 0.5, SCALE)
    assert not rules._proven([chaos((0, 1)), chaos((3, 3), cover=False)], 0.5, SCALE)
    assert not rules._proven([chaos((0, 1)), chaos((3, 3), width=0.25)], 0.5, SCALE)
    assert not rules._proven([chaos((3, 3)), chaos((3, 3))], 0.5, SCALE) and rules._proven([orbit], 0.5, SCALE)
