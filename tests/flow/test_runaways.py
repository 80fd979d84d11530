"""A motion that grows without limit is told as such, whichever way it goes."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from bifurc.flow.status import Status


@pytest.mark.parametrize("elements", [(), (el.RigidStop(1.0, 0.5),), (el.HarmonicForce(0.1), el.RigidStop(1.0, 0.5))])
def test_a_mass_that_falls_away_from_its_stop_diverges(elements):
    """x'' = 25 x to the side of no stop: e^(5 t)."""
    system = bf.System(1.0, 0.0, -25.0, elements, omega=1.0)
    away = bf.simulate(system, (-0.5, -2.0), duration=200.0)
    assert away.status is Status.DIVERGED
    other = bf.System(1.0, 0.0, -25.0, tuple(el.RigidStop(1.0, 0.5, side=-1) if isinstance(item, el.RigidStop) else item
                                             for item in elements), omega=1.0)
    assert bf.simulate(other, (0.5, 2.0), duration=200.0).status is Status.DIVERGED
    short = bf.simulate(system, (-0.5, -2.0), duration=2.0)
    assert short.success
    if not any(isinstance(item, el.HarmonicForce) for item in elements):
        assert short(2.0)[0] == pytest.approx(-0.5 * np.cosh(10.0) - 0.4 * np.sinh(10.0), rel=1e-9)


@pytest.mark.parametrize("side", [1, -1])
def test_whole_periods_see_it_too(side):
    """They end with whole steps, behind which no event has to be looked for; the mass leaves 1e200 behind it after 14.7 periods."""
    system = bf.System(1.0, 0.0, -25.0, (el.RigidStop(1.0, 0.5, side=side),), omega=1.0)
    for periods in (12, 14, 15, 16, 21):
        motion = bf.simulate(system, (-0.5 * side, -2.0 * side), periods=periods)
        assert motion.success == (periods < 15) and (motion.status is Status.DIVERGED) == (periods >= 15)
