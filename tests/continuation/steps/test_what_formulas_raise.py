"""What formulas raise on the way is a step refused, and where none can be refused the rows are kept."""
import math

import numpy as np
import pytest

from bifurc import switch_branch, trace
from bifurc.continuation import Monitor, Problem
from bifurc.continuation.kinds import StopReason
from bifurc.flow.settle import Inconsistent, Penetration


class Mine(Exception):
    """A class of errors that no library knows."""


RAISED = [np.linalg.LinAlgError("singular"), FloatingPointError("overflow"), Penetration("beyond a stop"), Inconsistent("no mode"),
          IndexError("none"), Mine("own")]


class Arch(Problem):
    """u = sin(3 p) with a monitor that is zero at p = .25; ``where`` names the formula that raises beyond p = ``edge``, or now and
    then: in one call of ``every``."""

    def __init__(self, where, error, edge=0.5, every=0):
        self.where, self.error, self.edge, self.every, self.calls = where, error, edge, every, 0
        super().__init__([math.sin(-3.0)], -1.0, scale_u=[1.0], scale_p=1.0)
        self.monitors = (Monitor("user", "quarter"),)

    def raising(self, where, p):
        if where != self.where:
            return
        self.calls += 1
        if self.every and self.calls > 3 and self.calls % self.every == 0 or not self.every and p > self.edge:
            raise self.error

    def residual(self, u, p):
        self.raising("residual", p)
        return np.array([u[0] - math.sin(3.0 * p)])

    def jacobian(self, u, p):
        self.raising("jacobian", p)
        return np.array([[1.0]]), np.array([-3.0 * math.cos(3.0 * p)])

    def monitor_values(self, u, p, tangent):
        self.raising("monitors", p)
        return np.array([p - 0.25])

    def leaves(self, a, b):
        self.raising("leaves", b.p)
        return -1.0

    def named_end(self, x, reason, message):
        self.raising("named_end", 1.0)
        return reason, message

    def end_point(self, x, reason):
        self.raising("end_point", 1.0)
        return None

    def confirm(self, kind, x):
        self.raising("confirm", 1.0)
        return True

    def is_motion(self, x):
        return None


@pytest.mark.parametrize("error", RAISED, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("where", ["residual", "jacobian", "monitors", "leaves", "named_end", "end_point", "confirm"])
def test_no_row_is_lost_to_what_a_formula_raises(where, error):
    branch = trace(Arch(where, error), bounds=(-1.0, 1.0), direction=1)
    p, u = branch.column("p"), branch.column("u_0")
    assert np.allclose(u, np.sin(3.0 * p), atol=1e-12) and (np.diff(p) > 0.0).all()
    end = branch.ends[1]
    assert p[-1] > (0.3 if where in ("residual", "jacobian", "monitors", "leaves") else 0.2)  # rows reach to where it raises
    if where in ("residual", "jacobian", "monitors") and not isinstance(error, Mine):
        assert 0.5 - 1e-6 < p[-1] <= 0.5  # approached as near as steps may be
    if end.reason is StopReason.EXCEPTION:
        assert type(error).__name__ in end.message
    else:
        assert end.reason is StopReason.BOUND


@pytest.mark.parametrize("every", [23, 41])
@pytest.mark.parametrize("where", ["residual", "jacobian", "monitors", "leaves"])
def test_what_raises_now_and_then_costs_steps_alone(where, every):
    branch = trace(Arch(where, FloatingPointError("now and then"), every=every), bounds=(-1.0, 1.0), direction=1)
    assert branch.stop_reason[1] is StopReason.BOUND and branch.audit.ok
    assert [point.parameter for point in branch.special_points.of("user")] == [pytest.approx(0.25, abs=1e-10)]


def test_a_branch_point_beside_which_formulas_raise_gives_the_starts_that_there_are():
    class Pitchfork(Problem):
        """u (p - u^2): beyond |u| = .005 it raises."""

        raising = False

        def residual(self, u, p):
            if self.raising and abs(u[0]) > 5e-3:
                raise FloatingPointError("too far")
            return np.array([u[0] * (p - u[0]**2)])

        def jacobian(self, u, p):
            return np.array([[p - 3.0 * u[0]**2]]), np.array([u[0]])
    problem = Pitchfork([0.0], -1.0, scale_u=[1.0], scale_p=1.0)
    branch = trace(problem, bounds=(-1.0, 1.0))
    (point,) = branch.special_points.of("branch_point")
    Pitchfork.raising = True
    starts = switch_branch(point)
    assert len(starts) == 2 and all(0.0 < abs(start.x0[0]) <= 5e-3 for start in starts)
    assert all(start.x0[-1] == pytest.approx(start.x0[0]**2, abs=1e-12) for start in starts)
    for wrong in ({"n_max": 0}, {"n_max": 2.5}, {"distance": 0.0}, {"distance": math.nan}, {"distance": "far"}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            switch_branch(point, **wrong)
