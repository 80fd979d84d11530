"""What goes on behind an end of a branch, decision by decision, on stand-ins: what is inside, verified, longer, free of events."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.kinds import StopReason
from bifurc.continuation.shooting import (
    signature_change,
    successor,
    train_length,
    vanishing,
)


def test_a_point_ahead_is_inside_also_where_a_guard_is_zero_by_itself():
    zero = successor.ZERO
    further = SimpleNamespace(converged=True, monitors=np.array([0.0, -1.0, 0.0]))
    asked = []

    def correct(x, tangent):
        asked.append(x.tolist())
        return further

    problem = SimpleNamespace(monitors=[SimpleNamespace(name="a", boundary=True),
                                        SimpleNamespace(name=successor.LISTED, boundary=True),
                                        SimpleNamespace(name="t", boundary=False)],
                              scale=np.array([1.0, 2.0]), correct=correct, path=None)

    def inside(*monitors, p=0.5, low=0.0, high=1.0):
        problem.path = SimpleNamespace(low=low, high=high)
        c = SimpleNamespace(monitors=np.array(monitors), p=p)
        return successor.inside_ahead(problem, np.array([1.0, 1.0]), np.array([0.5, 0.25]), 0.1, c)

    assert inside(-1.0, -1.0, 5.0) and not asked
    assert inside(0.5 * zero, -1.0, 0.0) and asked == [[1.0 + 0.05 * successor.FURTHER, 1.0 + 0.05 * successor.FURTHER]]
    assert not inside(2.0 * zero, -1.0, 0.0) and not inside(-1.0, 0.0, 0.0) and inside(zero, -1.0, 0.0)
    for value, good in ((zero, True), (-zero, True), (1.1 * zero, False), (-1.1 * zero, False)):
        further.monitors = np.array([value, -1.0, 99.0])
        assert inside(0.0, -1.0, 0.0) == good
    further.monitors = np.zeros(3)
    further.converged = False
    assert not inside(0.0, -1.0, 0.0)
    for p in (-0.1, 1.1):
        assert not inside(-1.0, -1.0, 0.0, p=p)
    assert inside(-1.0, -1.0, 0.0, p=0.0) and inside(-1.0, -1.0, 0.0, p=1.0)


@pytest.mark.parametrize("back, near, far, comes", [(True, 1.0, 2.0, True), (True, 2.0, 1.0, False), (True, 1.0, 1.0, False),
                                                    (False, 1.0, 2.0, False)])
def test_a_sequence_that_comes_nearer_to_the_old_motion_comes_back(back, near, far, comes, monkeypatch):
    monkeypatch.setattr(successor, "leads_back", lambda point, new, x, tangent: back)
    monkeypatch.setattr(successor, "distance", lambda a, b: {("old", "c"): near, ("old", "x"): far}[a, b])
    old, new = SimpleNamespace(motion=lambda x: "old"), SimpleNamespace(motion=lambda x: x)
    assert successor.comes_back(old, SimpleNamespace(x="p"), new, "x", None, SimpleNamespace(x="c")) is comes


def test_a_successor_is_verified_at_the_first_length_at_which_it_is_repeated(monkeypatch):
    state = {"rebounds": False, "along": [None, "c2", "c3"], "inside": True, "success": True, "repeated": True, "determined": True,
             "retraces": False, "loosens": False}
    asked = []

    def along(new, x, tangent, step):
        asked.append(step)
        c = state["along"][len(asked) - 1] if len(asked) <= 3 else None
        return c and SimpleNamespace(x=c)

    for name, function in {"rebounds": lambda new: state["rebounds"], "along": along,
                           "inside_ahead": lambda new, x, tangent, step, c: state["inside"],
                           "repetition": lambda orbit: SimpleNamespace(repeated=state["repeated"]),
                           "determined": lambda new, c: state["determined"] and c.x == "c2",
                           "retraces": lambda problem, point, new, c: state["retraces"],
                           "loosens": lambda new, x, tangent, step, c: state["loosens"], "INSIDE": (0.1, 0.2, 0.3)}.items():
        monkeypatch.setattr(successor, name, function)
    new = SimpleNamespace(motion=lambda x: SimpleNamespace(success=state["success"]))

    def verified():
        asked.clear()
        return successor.verified(None, None, new, None, None), list(asked)

    assert verified() == (True, [0.1, 0.2])
    for name in ("determined", "retraces", "loosens"):
        state[name] = not state[name]
        assert verified() == (False, [0.1, 0.2])
        state[name] = not state[name]
    for name in ("inside", "success", "repeated"):
        state[name] = False
        assert verified() == (False, [0.1, 0.2, 0.3])
        state[name] = True
    state["rebounds"] = True
    assert verified() == (False, [])


def lengthened(r, monkeypatch, chatters=(0, 1, 0), valid=lambda count: True, longer=True):
    """Return what is found of a train, and what was tried: (longer or not, number of impacts)."""
    tried, ahead = [], []
    nodes = np.array([[0, 1, 0, 0, c] for c in chatters])
    point = SimpleNamespace(x=np.array([1.0, 2.0]), tangent=np.array([0.0, -1.0]))

    def change(name):
        def made(at, x, count):
            tried.append((name, count))
            new = SimpleNamespace(scale=np.array([1.0, 2.0]), correct=correct)
            return (new, np.array([count, 7.0])) if name == longer else None

        def correct(guess, tangent, fixed=False):
            assert not fixed or tangent.tolist() == [0.0, 1.0]
            good = fixed or valid(tried[-1][1])
            if not fixed:
                ahead.append(guess.tolist())
            return SimpleNamespace(converged=True, x=guess, tangent=np.array([0.5, 0.8]),
                                   monitors=np.array([-1.0 if good else 0.0, 9.0]))
        return made

    begun = []
    monkeypatch.setattr(train_length, "begun_at", lambda problem, x, i: (begun.append(i), ("at", x))[1])
    monkeypatch.setattr(train_length, "longer", change(True))
    monkeypatch.setattr(train_length, "shorter", change(False))
    T = SimpleNamespace(ratio=np.array([[0.0, r]]))
    problem = SimpleNamespace(monitors=[SimpleNamespace(boundary=True), SimpleNamespace(boundary=False)],
                              equations=SimpleNamespace(numbers_at=lambda p: T), sequence=SimpleNamespace(nodes=nodes))
    return train_length.relengthened(problem, point), tried, ahead, begun


def test_trains_of_impacts_are_made_longer_or_shorter(monkeypatch):
    """First by as many as rounding lets it be, r to twice that number, then by one; the tangent is turned as that of the point."""
    most = int(train_length.ROOM / (-2.0 * np.log(0.95)))
    assert most > 1
    found, tried, ahead, begun = lengthened(0.95, monkeypatch)
    assert begun == [2] and tried == [(True, most)] and found[1].tolist() == [most, 7.0] and found[2].tolist() == [-0.5, -0.8]
    step = train_length.AHEAD[0]
    assert ahead == [[pytest.approx(most - 0.5 * step), pytest.approx(7.0 - 1.6 * step)]]
    found, tried, ahead, _ = lengthened(0.95, monkeypatch, valid=lambda count: count == 1)
    assert tried == [(True, most), (True, 1)] and found[1].tolist() == [1.0, 7.0] and len(ahead) == len(train_length.AHEAD) + 1
    found, tried, *_ = lengthened(0.95, monkeypatch, longer=False)
    assert tried == [(True, most), (True, 1), (False, most)] and found is not None
    for r in (0.0, 1.0, 1e-300):
        assert lengthened(r, monkeypatch, longer=None)[1] == [(True, 1), (False, 1)]
    assert lengthened(0.95, monkeypatch, chatters=(0, 2, 0))[:2] == (None, [])


@pytest.mark.parametrize("closure, span, tau, wait", [(-1, 0.5, 0.3, 0.7), (1, 3.0, 1.2, 0.8), (1, 3.0, 2.0, 0.0)])
def test_an_orbit_whose_last_event_has_vanished_starts_at_phase_zero(closure, span, tau, wait, monkeypatch):
    """From the event that ends the longer interval, in the mode of that, on to the next whole period."""
    monkeypatch.setattr(vanishing, "sections", lambda mode, span, closure: (mode, span, closure))
    went = []

    def advance(T, mode, joined, t, y):
        went.append((mode, joined.tolist(), t))
        y[:] = [5.0, 6.0]

    T = SimpleNamespace(A=np.zeros((1, 2, 4)), flat=np.array([0.5]))
    kernel = SimpleNamespace(forcing=lambda T_, t, z: z.__setitem__(slice(2, None), [t, 0.0]))
    e = SimpleNamespace(numbers_at=lambda p: T, kernel=kernel, motion=SimpleNamespace(advance=advance))
    s = SimpleNamespace(nodes=np.array([[8, 0, 4, 0, 0], [4, 0, 8, 0, 0]]), span=span, closure=closure)
    problem = SimpleNamespace(scene=SimpleNamespace(ns=2), sequence=s, equations=e)
    x = np.array([tau - 1e-9, 1.0, 2.0, tau, 3.0, 4.0, 9.0])
    signature, found = vanishing.free_of_events(problem, x)
    assert signature == (8, span if closure < 0 else 1.0, closure) and found.tolist() == [0.0, 5.0, 6.0, 9.0]
    assert went == [(8, pytest.approx([1.0, 2.0, (tau - 1e-9) * 4.0 * np.pi, 0.0]), pytest.approx(wait * 4.0 * np.pi, abs=1e-7))]
    x[0], x[3] = tau - 0.9 * span, tau  # the second interval is the longer one: it ends at the second node
    assert vanishing.free_of_events(problem, x)[0][0] == 4 and went[-1][1][:2] == [3.0, 4.0]


def test_behind_the_hopf_point_an_orbit_ends_and_behind_its_section_it_has_another(monkeypatch):
    monkeypatch.setattr(signature_change.autonomous, "small", lambda problem, x: x == "small")
    monkeypatch.setattr(signature_change.autonomous, "changed", lambda change, problem, x: ("sequence", x))
    monkeypatch.setattr(signature_change, "admissible_side", lambda new, x: side)
    new = SimpleNamespace(x0="x0")
    problem = SimpleNamespace(with_sequence=lambda *made: new if made == ("sequence", "wide") else None)
    side = "tangent"
    assert signature_change.beyond_section(problem, SimpleNamespace(x="small")) is StopReason.HOPF
    assert signature_change.beyond_section(problem, SimpleNamespace(x="wide")) == (new, "x0", "tangent")
    side = None
    assert signature_change.beyond_section(problem, SimpleNamespace(x="wide")) is StopReason.NO_SUCCESSOR
