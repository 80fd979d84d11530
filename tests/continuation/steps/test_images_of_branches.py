"""A branch in other units, mirrored in its parameter or shifted along it is the same branch, row by row: the algebra is exact."""
import copy
import math
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation import Monitor, Problem, SpecialPointKind, trace
from tests.continuation.problems import Free, Scalar, circle, hysteresis, near_miss, parabola, pitchfork, transcritical


class Image(Problem):
    """The equations of ``inner`` for u' = a u and p' = b p + c, with sizes that go with it; b below zero mirrors the branch."""

    def __init__(self, inner, a=1.0, b=1.0, c=0.0):
        self.inner, self.a, self.b, self.c = inner, a, b, c
        self.size, self.scale = inner.size, inner.scale * np.append(np.full(inner.size, a), abs(b))
        self.x0 = np.append(a * inner.x0[:-1], b * inner.x0[-1] + c)
        self.monitors, self.corner, self.signature = inner.monitors, inner.corner, inner.signature

    def own(self, u, p):
        return u / self.a, (p - self.c) / self.b

    def residual(self, u, p):
        return self.inner.residual(*self.own(u, p))

    def jacobian(self, u, p):
        fu, fp = self.inner.jacobian(*self.own(u, p))
        return fu / self.a, fp / self.b

    def turned(self, tangent):
        return np.append(tangent[:-1], math.copysign(1.0, self.b) * tangent[-1])

    def monitor_values(self, u, p, tangent):
        return self.inner.monitor_values(*self.own(u, p), self.turned(tangent))

    def switch(self, point, monitor):
        u, p = self.own(point.x[:-1], point.p)
        answer = self.inner.switch(SimpleNamespace(x=np.append(u, p), p=p, tangent=self.turned(point.tangent)), monitor)
        return answer and self.of(answer[0], answer[1], answer[2])

    def of(self, inner, x, tangent):
        return Image(inner, self.a, self.b, self.c), np.append(self.a * x[:-1], self.b * x[-1] + self.c), self.turned(tangent)

    def beyond_corner(self, row):
        answer = self.inner.beyond_corner(SimpleNamespace(x=np.append(*self.own(row.x[:-1], row.p)), p=self.own(row.x, row.p)[1],
                                                          tangent=self.turned(row.tangent), direction=None))
        return answer and (Image(answer[0], self.a, self.b, self.c), self.turned(answer[1]))


class Edge(Scalar):
    """u = sqrt(1 - p), which has no value behind p = 1."""

    def __init__(self):
        super().__init__(lambda u, p: u - math.sqrt(1.0 - p), lambda u, p: (1.0, 0.5 / math.sqrt(max(1.0 - p, 1e-300))), 1.0, 0.0,
                         scale_u=1.0, scale_p=1.0)


class Wavy(Scalar):
    """u = p^2 with zeros of a monitor at .3, .35 and .9, and a fold of u beside them that is none of the parameter."""

    monitors = (Monitor(SpecialPointKind.USER, "wave"),)

    def __init__(self):
        super().__init__(lambda u, p: u - p * p, lambda u, p: (1.0, -2.0 * p), 1.0, -1.0, scale_u=1.0, scale_p=1.0)

    def monitor_values(self, u, p, tangent):
        return np.array([(p - 0.3) * (p - 0.35) * (p - 0.9)])


def with_scale(made):
    made.scale[-1] = 1.0 if math.isnan(made.scale[-1]) else made.scale[-1]
    return made


PROBLEMS = {
    "fold": (lambda: parabola(scale_u=0.7), (-1.0, 0.5), {}),
    "two folds": (hysteresis, (-1.0, 1.0), {}),
    "bound before a fold": (hysteresis, (-1.0, 0.3845), {"ds": 0.3, "ds_max": 0.5}),
    "bound in the first step": (lambda: hysteresis().restarted([0.0, 0.0]), (-0.05, 0.3), {"ds": 0.2}),
    "edge": (Edge, (-2.0, 1.0), {"ds_max": 0.4}),
    "branch point": (pitchfork, (-1.0, 1.0), {"ds_max": 0.3}),
    "transcritical": (transcritical, (-1.0, 1.0), {}),
    "closed": (circle, (-2.0, 2.0), {}),
    "closed and cut": (circle, (-0.8, 0.9), {}),
    "near miss": (lambda: near_miss(1e-4), (-1.0, 1.0), {}),
    "zeros": (Wavy, (-1.0, 1.0), {"ds_max": 0.5}),
    "boundary": (lambda: Free(0.0, 0.0, (0.5, -1.0, 0.8)), (-0.5, 1.0), {}),
    "parameter turns on a boundary": (lambda: Free(0.0, 0.0, (-0.5, 0.4, 0.0)), (-0.5, 1.0), {}),
    "parameter stands still on a boundary": (lambda: Free(0.0, 0.0, (0.0, 0.9, -0.5)), (-0.5, 1.0), {}),
}


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("a, b, c", [(1.0, -1.0, 0.0), (1.0, 1.0, 0.25), (64.0, 1.0, 0.0), (1.0, 0.03125, 0.0),
                                     (0.125, -16.0, 8.0)],
                         ids=["mirrored", "shifted", "unknowns", "parameter", "all"])
def test_an_image_of_a_branch_has_the_same_rows_points_and_ends(name, a, b, c):
    make, bounds, more = PROBLEMS[name]
    if name == "closed":
        b = abs(b)  # it begins with the parameter growing
    problem = with_scale(copy.copy(make()))
    there = Image(problem, a, b, c)
    branch = trace(problem, bounds=bounds, **more)
    image = trace(there, bounds=tuple(b * bound + c for bound in bounds), **more)
    assert len(image) == len(branch)
    x = np.column_stack([branch.column("p"), branch.column("u_0")])
    own = np.column_stack([(image.column("p") - c) / b, image.column("u_0") / a])
    way = slice(None, None, -1) if np.abs(own[0] - x[0]).max() > 1e-6 else slice(None)  # both list the direction of growing p first
    np.testing.assert_allclose(own[way], x, atol=1e-7)
    sign = 1.0 if way == slice(None) else -1.0
    np.testing.assert_allclose(sign * image.column("s")[way], branch.column("s"), atol=1e-7)
    assert np.abs(image.column("iterations")[way] - branch.column("iterations")).max() <= 1  # rounding may ask for one more
    assert [end.reason for end in image.ends][way] == [end.reason for end in branch.ends]
    points = list(image.special_points)[way]
    assert [(p.kind, p.name, p.reverses, p.status) for p in points] == [
        (p.kind, p.name, p.reverses, p.status) for p in branch.special_points]
    for one, other in zip(points, branch.special_points, strict=True):
        assert (one.parameter - c) / b == pytest.approx(other.parameter, abs=1e-9)
        assert one.error / abs(b) <= 8.0 * other.error + 1e-13 and other.error <= 8.0 * one.error / abs(b) + 1e-13
        assert sorted(sign * np.array(one.bracket)) == pytest.approx(other.bracket, abs=1e-6)
