"""What simulations beyond a grazing are read by: periods, impacts, speeds, and whether they agree with a verdict."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.grazing import confirm
from bifurc.continuation.grazing.confirm import FAR, RECORDED, Seen, agrees, confirmed, settled
from bifurc.continuation.grazing.verdicts import GrazingVerdict
from bifurc.elements import EventKind
from bifurc.flow.status import Status

V = GrazingVerdict


def events(*told):
    return [SimpleNamespace(kind=kind, element=element, speed=speed) for kind, element, speed in told]


@pytest.fixture
def motions(monkeypatch):
    """What `simulate` gives in turn: events and sections of the second motion."""
    made = SimpleNamespace(events=[], sections=np.zeros((RECORDED + 1, 2)), states=[], statuses=[Status.COMPLETED] * 2)

    def simulate(system, state, periods):
        made.states.append((state, periods))
        return SimpleNamespace(status=made.statuses[len(made.states) - 1], final="later", events=made.events,
                               sections=made.sections)
    monkeypatch.setattr(confirm, "simulate", simulate)
    return made


def touch(symmetric=False, weights=(1.0, 1.0)):
    return SimpleNamespace(element="stop", symmetric=symmetric, problem=SimpleNamespace(weights=np.array(weights)))


def seen(motions, first=0.1, **more):
    return settled("system", "start", touch(**more), 1e-5, 1.5, first, 700)


def test_events_at_the_touched_element_are_counted_a_period(motions):
    motions.events = events(*[(EventKind.IMPACT, "stop", 0.2)] * 40, *[(EventKind.CHATTER, "stop", 0.9)] * 8,
                            (EventKind.IMPACT, "other", 50.0), (EventKind.STICK, "stop", 70.0))
    found = seen(motions)
    assert motions.states == [("start", 700), ("later", RECORDED)]
    assert found.impacts == 0.5 and found.speed == 0.9 and found.small and found.completed  # 48 in 96 periods
    assert (found.eps, found.parameter, found.first) == (1e-5, 1.5, 0.1)
    motions.states.clear()
    assert seen(motions, symmetric=True).speed == 50.0  # the other stop answers it
    for top, small in ((0.99 * FAR * 0.1, True), (1.01 * FAR * 0.1, False)):
        motions.states.clear()
        motions.events = events((EventKind.CONTACT, "stop", top))
        assert seen(motions).small is small


@pytest.mark.parametrize("period", [1, 3, 48])
def test_a_period_is_after_how_many_sections_a_motion_returns_in_natural_sizes(motions, period):
    """Displacements of a micrometre beside speeds of a thousand: both return."""
    sizes = np.array([1e-6, 1e3])
    turns = np.arange(RECORDED + 1) % period
    motions.sections = sizes * np.column_stack([np.cos(turns), np.sin(turns)])
    assert seen(motions, weights=sizes).period == period
    motions.states.clear()
    motions.sections = sizes * np.column_stack([np.cos(turns) + 1e-4 * np.arange(RECORDED + 1), np.zeros(RECORDED + 1)])
    assert seen(motions, weights=sizes).period == 0  # the displacement drifts, by little of the speed


def test_a_motion_that_does_not_complete_is_said_to(motions):
    for broken in (0, 1):
        motions.states.clear()
        motions.statuses = [Status.TOO_MANY_EVENTS if k == broken else Status.COMPLETED for k in range(2)]
        found = seen(motions)
        assert not found.completed and not found.small and found.period == 0 and np.isnan(found.speed)


def told(small, speed=1.0, completed=True, eps=1e-5):
    return Seen(eps, 1.0, 1, 1.0, speed, 0.1, small, completed)


def grazing(verdict, *seen, expected=None):
    return SimpleNamespace(verdict=verdict, confirmation=seen, expected=lambda eps: expected and expected(eps))


@pytest.mark.parametrize("verdict", [V.PERIOD_ADDING, V.WINDOWS_AND_CHAOS, V.IMMEDIATE_CHAOS, V.PERSISTENCE])
def test_a_small_attractor_must_be_small_at_every_distance(verdict):
    assert agrees(grazing(verdict, told(True), told(True))) is True
    assert agrees(grazing(verdict, told(True), told(False))) is False
    assert agrees(grazing(verdict, told(True), told(False, completed=False))) is True  # not seen
    assert agrees(grazing(verdict)) is None and agrees(grazing(verdict, told(True, completed=False))) is None


@pytest.mark.parametrize("verdict", [V.UNSTABLE, V.DEGENERATE])
def test_a_verdict_that_foretells_nothing_cannot_be_contradicted(verdict):
    assert agrees(grazing(verdict, told(True))) is None and verdict.small is None


def test_a_jump_is_seen_from_where_its_map_says_so():
    """At 1e-6 the map has thrown the motion out (speed 3 of .1), at 1e-4 not yet (.5); between it may be either."""
    def expected(eps):
        speed = {1e-6: 3.0, 1e-5: 1.2, 1e-4: 0.5}[eps]
        return SimpleNamespace(speed=speed, small=speed <= FAR * 0.1)
    for at, small, good in ((1e-6, False, True), (1e-6, True, False), (1e-4, True, True), (1e-4, False, False),
                            (1e-5, True, True), (1e-5, False, True)):
        assert agrees(grazing(V.JUMP, told(small, eps=at), expected=expected)) is good
    assert agrees(grazing(V.JUMP, told(True), told(False))) is True  # nothing is expected
    assert V.JUMP.small is False


@pytest.mark.parametrize("growth, p, scale", [(2.0, 0.5, 9.0), (-2.0, 0.5, 9.0), (2.0, -0.5, 9.0), (-2.0, 0.0, 0.25)])
def test_the_side_beyond_is_where_the_depth_grows(monkeypatch, growth, p, scale):
    asked = []
    monkeypatch.setattr(confirm, "apex_growth", lambda touch: growth)
    monkeypatch.setattr(confirm, "settled", lambda system, state, touch, eps, value, first, periods: asked.append(
        (system, state, eps, value, first, periods)))
    system = SimpleNamespace(with_parameters=lambda **given: given)
    problem = SimpleNamespace(parameter="load", parameter_scale=scale, system=system,
                              solution=lambda x: SimpleNamespace(state=x))
    found = SimpleNamespace(verdict=V.JUMP, multiplier=0.5, touch=SimpleNamespace(x=np.array([7.0, p]), problem=problem, apex=-8.0))
    confirmed(found, beyond=(1e-4,))
    ((given, state, eps, value, first, periods),) = asked
    size = abs(p) or scale
    assert value == pytest.approx(p + np.sign(growth) * 1e-4 * size) and given == {"load": value} and eps == 1e-4
    assert first == pytest.approx(np.sqrt(2.0 * 8.0 * 2.0 * 1e-4 * size)) and periods == confirm.PERIODS  # w = sqrt(2 |A| depth)
    asked.clear()
    found.multiplier = 0.999  # slow: twenty times the decay to 1e-9
    confirmed(found, beyond=(1e-4,))
    assert asked[0][-1] == 20000
    found.verdict = V.DEGENERATE
    assert confirmed(found) == ()
