"""Single decisions of tracing, on stand-ins: steps onto bounds, rows inside a step, callbacks, what runs and what ends it."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation import tracing
from bifurc.continuation.kinds import SpecialPointKind as Kind
from bifurc.continuation.kinds import StopReason
from bifurc.continuation.steps import arclength, detect, inside
from bifurc.continuation.steps.arclength import Half


def stepped(p, ds, low=0.0, high=1.0, lands=None, given=None, direction=(0.5, 2.0), error=None, ends=False):
    """Return what a step from the parameter ``p`` gives, and what was corrected: (x, parameter kept)."""
    asked = []

    class Failed(ArithmeticError):
        pass

    def correct(x, tangent, fixed=False):
        assert tangent == "tangent"
        asked.append((x.tolist(), fixed))
        if error:
            raise Failed("no")
        return SimpleNamespace(p=x[-1] if lands is None else lands)

    row = SimpleNamespace(x=np.array([3.0, p]), p=p, direction=np.array(direction), tangent="tangent",
                          part=SimpleNamespace(problem=SimpleNamespace(correct=correct, errors=(Failed,))))
    half = SimpleNamespace(options=SimpleNamespace(low=low, high=high), judge=lambda row, c, ds, fixed: (c, ("judged", ds, fixed)),
                           onto_bound=lambda row, new: ("onto", new.p))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arclength, "outward", lambda new, options: ends)
        return Half.attempt(half, row, ds, given), asked


def test_a_step_goes_straight_to_a_bound_that_it_would_pass():
    """Shortened so that the parameter is that of the bound, which is kept; from a bound itself nothing is shortened."""
    (new, cause), asked = stepped(0.4, 0.1)
    assert asked == [([3.05, pytest.approx(0.6)], False)] and cause == ("judged", 0.1, False) and new.p == pytest.approx(0.6)
    for ds, bound in ((0.7, 1.0), (-0.5, 0.0)):
        (new, cause), asked = stepped(0.4, ds)
        length = (bound - 0.4) / 2.0
        assert asked == [([pytest.approx(3.0 + 0.5 * length), bound], True)] and cause == ("judged", pytest.approx(length), True)
    for p, ds in ((1.0, 0.1), (0.0, -0.1)):
        (new, cause), asked = stepped(p, ds)
        assert asked[0][1] is False and new is None and cause[:2] == (StopReason.BOUND, 0.5)


def test_a_corrected_row_beyond_a_bound_is_put_onto_it():
    assert stepped(0.4, 0.1, lands=1.2)[0] == ("onto", 1.2) and stepped(0.4, 0.1, lands=-0.2)[0] == ("onto", -0.2)
    assert stepped(0.4, 0.1, lands=1.0)[0][0].p == 1.0 and stepped(0.4, 0.1, lands=0.0)[0][0].p == 0.0
    assert stepped(0.4, 0.1, ends=True)[0] == ("onto", pytest.approx(0.6))  # nothing goes on beside the bound
    assert stepped(0.4, 0.1, lands=1.0, ends=True)[0][0].p == 1.0
    given = SimpleNamespace(p=0.7)
    assert stepped(0.4, 0.1, given=given) == ((given, ("judged", 0.1, False)), [])
    assert stepped(0.4, 0.5, given=given)[1] == [([3.15, 1.0], True)]  # what was corrected before is not at the bound
    (new, cause), _ = stepped(0.4, 0.1, error=True)
    assert new is None and cause == (StopReason.EXCEPTION, 0.25, "Failed: no")


@pytest.mark.parametrize("s, beyond, fails", [(0.5, False, False), (0.5, False, True), (1.0, False, True), (0.5, True, True),
                                              (1.5, False, True), (1.5, True, False)])
def test_a_row_inside_a_step_takes_the_place_of_one_that_lies_behind_it(s, beyond, fails):
    row, before = SimpleNamespace(s=1.0, part="part", signs=[1, -1]), SimpleNamespace(s=0.0, part="other")
    inner, found = SimpleNamespace(s=s, p=9.0), [1, 2]
    told = []

    def taken(name):
        def take(row, inner):
            told.append((name, row))
            return "cause" if fails else None
        return take

    def back():
        half.rows.pop()
        half.found, half.signs = [1], [0, 0]
        return before

    half = SimpleNamespace(rows=[before, row], found=found, signs=[0, 0], steps=5, take_back=back, accept=taken("accept"),
                           accept_bound=taken("bound"), beyond_bounds=lambda p, part: beyond and p == 9.0)
    assert Half.accept_inner(half, row, inner) == ("cause" if fails else None)
    behind = s <= 1.0
    assert told == [("bound" if beyond else "accept", before if behind else row)]
    if behind and fails:
        assert half.rows == [before, row] and half.found is found and half.signs == [1, -1] and half.signs is not row.signs
        assert half.steps == 6
    else:
        assert half.rows == ([before] if behind else [before, row]) and half.steps == 5


def test_callbacks_of_a_row():
    """Recorded, asked whether to stop unless the branch stops anyway, shown; what they raise ends the branch."""
    stopped, shown, part = [], [], SimpleNamespace(problem=SimpleNamespace(parameter="p"))
    row = SimpleNamespace(p=0.3, recorded=None, part=part, x=np.zeros(2))

    def half(reason=None, **callbacks):
        stopped.clear()
        options = SimpleNamespace(**{**dict.fromkeys(("record", "stop", "progress")), **callbacks})
        return SimpleNamespace(options=options, reason=reason, rows=[1, 2, 3], stop=lambda *args: stopped.append(args))

    Half.ask_user(half(), row)
    assert not stopped and row.recorded is None
    Half.ask_user(half(record=lambda point: {"a": 1}, stop=lambda point: True, progress=lambda p, n: shown.append((p, n))), row)
    assert row.recorded == {"a": 1} and stopped == [(StopReason.STOPPED,)] and shown == [(0.3, 3)]
    Half.ask_user(half(stop=lambda point: False), row)
    Half.ask_user(half(StopReason.BOUND, stop=lambda point: True), row)
    assert not stopped
    Half.ask_user(half(progress=lambda p, n: 1 / 0), row)
    assert stopped == [(StopReason.CALLBACK_FAILED, "progress= raised ZeroDivisionError: division by zero (at p = 0.3)")]


def test_points_are_recorded_once():
    stopped = []

    def half(record, reason=None):
        stopped.clear()
        found = [SimpleNamespace(recorded=None, as_point=lambda: "a"), SimpleNamespace(recorded="old", as_point=lambda: "b")]
        return SimpleNamespace(options=SimpleNamespace(record=record), reason=reason, found=found,
                               stop=lambda *a: stopped.append(a))

    def recorded(*args):
        one = half(*args)
        Half.record_points(one)
        return [special.recorded for special in one.found]

    assert recorded(lambda point: {point: 2}) == [{"a": 2}, "old"] and recorded(None) == [None, "old"]
    for reason in (StopReason.INTERRUPTED, StopReason.EXCEPTION, StopReason.CALLBACK_FAILED):
        assert recorded(lambda point: {point: 2}, reason) == [None, "old"]
    assert recorded(lambda point: {point: 2}, StopReason.BOUND) == [{"a": 2}, "old"] and not stopped

    def interrupted(point):
        raise KeyboardInterrupt
    assert recorded(interrupted) == [None, "old"] and stopped == [(StopReason.INTERRUPTED,)]
    assert recorded(lambda point: 1 / 0) == [None, "old"] and stopped[0][0] is StopReason.CALLBACK_FAILED


@pytest.mark.parametrize("touch, size, rounding, test, band", [
    (0.1, 0.1, 0.0, 0.0, 0.1), (0.1, 0.05, 0.0, 0.0, 0.1), (0.1, 0.2, 1e-3, 0.0, 1e-3), (0.1, 0.2, 0.3, 0.0, 0.1),
    (np.inf, 5.0, 1e-3, 0.0, 1e-3), (np.inf, np.inf, 1e-3, 0.0, 1e-3), (np.inf, 5.0, 0.0, -100.0, 100.0 * detect.MONITOR_BAND)])
def test_the_band_in_which_a_boundary_counts_as_zero(touch, size, rounding, test, band, monkeypatch):
    monkeypatch.setattr(detect, "rounding", lambda half, j: rounding if j == 1 else 9.0)
    half = SimpleNamespace(rows=[None, SimpleNamespace(part=SimpleNamespace(touch=touch))], sizes=[9.0, size])
    assert detect.zero_band(half, SimpleNamespace(tests=[9.0, test]), 1) == band


@pytest.mark.parametrize("stands, test, clear, outside, last", [
    (False, 1.0, "clear", (0.2,), "cut"), (False, 1e-30, "clear", (0.2,), "clear"), (True, 1.0, "clear", (0.2,), "clear"),
    (True, 1.0, None, (0.2,), None), (False, 1e-30, None, (0.2,), "cut"), (False, 1e-30, None, (), None)])
def test_the_last_row_of_a_part(stands, test, clear, outside, last, monkeypatch):
    """The boundary itself where the slope is clear there, else the clear row before it; places are seen from the other end."""
    asked = []
    monkeypatch.setattr(inside, "known_to", lambda special: 0.01)
    monkeypatch.setattr(inside, "stands", lambda row, new, other, reach: stands and reach == 0.01)
    monkeypatch.setattr(inside, "outside_of", lambda reach, row, new, j: outside)
    monkeypatch.setattr(inside, "clear_inside", lambda half, row, new, j, places, looked: (asked.append(places), clear)[1])
    cut = SimpleNamespace(inside={}, row=SimpleNamespace(tests=[test, 0.0]), special=None, looked=None)
    found = inside.ending(None, None, cut, 0)
    assert found is (cut.row if last == "cut" else last) and inside.ending(None, None, cut, 0) is found
    assert asked == ([] if not stands and test == 1.0 else [tuple(1.0 - t for t in outside)])
    if not stands and test == 1.0:
        assert inside.ending(None, None, cut, 1) is clear  # of another test nothing is told by its size


# ---- both halves ---------------------------------------------------------------------------------------------------------------


def halves(direction=0, lost=False, plus=None, minus=None, ends=None):
    made = []
    for name, first in (("plus", plus), ("minus", minus)):
        half = SimpleNamespace(reason=first, message=f"message of {name}", told=[])

        def stop(reason, *message, half=half):
            half.reason = reason
            half.told.append((reason, *message))

        def run(half=half, name=name):
            reason = (ends or {}).get(name, StopReason.BOUND)
            if reason is KeyboardInterrupt:
                raise KeyboardInterrupt
            half.reason = reason
            half.told.append("ran")
        half.stop, half.run = stop, run
        made.append(half)
    tracing.run_halves(*made, direction, lost)
    return [half.told for half in made]


def test_which_halves_run():
    none, closed, cut = (StopReason.NOT_STARTED,), (StopReason.CLOSED,), (StopReason.INTERRUPTED,)
    assert halves() == [["ran"], ["ran"]] and halves(1) == [["ran"], [none]] and halves(-1) == [[none], ["ran"]]
    assert halves(plus=StopReason.BOUND) == [[], ["ran"]] and halves(minus=StopReason.BOUND) == [["ran"], []]
    lost = halves(lost=True)
    assert [told[0][0] for told in lost] == [StopReason.SINGULAR] * 2 and halves(1, lost=True)[1] == [none]
    assert halves(ends={"plus": StopReason.CLOSED}) == [["ran", (StopReason.CLOSED, "message of plus")], [closed]]
    assert halves(ends={"minus": StopReason.CLOSED}) == [["ran", (StopReason.CLOSED, "message of plus")], ["ran"]]
    assert halves(ends={"plus": KeyboardInterrupt}) == [[cut], [cut]]
    assert halves(ends={"minus": KeyboardInterrupt}) == [["ran"], [cut]]


def test_points_at_the_first_row(monkeypatch):
    found = [SimpleNamespace(kind=kind) for kind in (Kind.FOLD, Kind.GRAZING)]
    monkeypatch.setattr(detect, "at_end", lambda half, row: list(found))
    part = SimpleNamespace(boundary=(1,), scale=np.array([5.0, 2.0]),
                           problem=SimpleNamespace(own_directions=lambda directions: directions[:own]))
    row, own = SimpleNamespace(part=part, tests=[0.0, -1.0], tangent="t"), 2
    assert tracing.start_points(None, row, None) == found
    for test in (0.0, tracing.ON_BOUNDARY, -tracing.ON_BOUNDARY):
        row.tests[1] = test
        assert tracing.start_points(None, row, None) == [special for special in found if special.kind not in tracing.STABILITY]
    row.tests[1] = -1.01 * tracing.ON_BOUNDARY
    crossing = SimpleNamespace(error=1e-3, x="x", directions=["d1", "d2"])
    *rest, point = tracing.start_points(None, row, crossing)
    assert rest == found and point.kind is Kind.BRANCH_POINT and (point.s, point.low, point.high) == (0.0, -1e-3, 1e-3)
    assert float(point.bound) == pytest.approx(2e-3) and point.directions == ["d1", "d2"] and point.x == "x"
    crossing.error = 0.0
    assert tracing.start_points(None, row, crossing)[-1].high == 1e-15
    own = 1
    assert tracing.start_points(None, row, crossing) == found
