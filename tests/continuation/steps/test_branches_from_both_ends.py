"""A branch does not depend on the end and the sense in which it is traced: peaks, folds and changes of stability."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el

STOPPED = bf.System(1.0, 0.1, 1.0, (el.HarmonicForce(1.0), el.RigidStop(0.8, 0.7)), omega=0.75)
SOFT = bf.System(1.0, 0.08, 1.0, (el.HarmonicForce(0.25), el.CubicSpring(0.4)), omega=0.7)
CASES = {"impacts": (STOPPED, None, (0.7, 0.95)), "balance": (SOFT, bf.HarmonicBalance(5), (0.7, 1.6))}


@pytest.mark.parametrize("case", CASES)
def test_both_senses_find_the_same(case):
    system, method, (low, high) = CASES[case]
    own = {} if method is None else {"method": method}
    up, down = (bf.trace(bf.find_orbit(system.with_parameters(omega=omega), **own), "omega", bounds=(low, high), peaks="rms_0",
                         direction=direction)
                for omega, direction in ((low, 1), (high, -1)))
    first, second = (sorted(((str(p.kind), p.parameter, p.status) for p in branch.special_points), key=lambda item: item[1])
                     for branch in (up, down))
    assert [(kind, status) for kind, _, status in first] == [(kind, status) for kind, _, status in second]
    np.testing.assert_allclose([value for _, value, _ in first], [value for _, value, _ in second], rtol=0, atol=1e-8)
    assert case == "impacts" or any("peak" in kind for kind, _, _ in first)
    values, back = up.column("omega"), down.column("omega")
    assert values[0] == back[0] == low and values[-1] == back[-1] == high  # rows in one order
