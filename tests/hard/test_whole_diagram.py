"""Hard and bad questions about curves, atlases and feedback: each has a status, a class or an error that names it.

Others stand beside what they are about: grazings on a stick interval, with a multiplier at 1 or near the unit circle, flat and
double ones in ``continuation/grazing/test_classify.py``; atlases that diverge, hold a continuum or are interrupted in
``atlases/test_atlas.py``; maps under feedback in ``control/test_feedback_basins.py``.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.atlases.identity import on_branch, periods_of


@pytest.fixture(scope="module")
def folds():
    """Return a curve of folds of the Duffing oscillator, through its cusp."""
    branch = bf.trace(bf.find_orbit(bf.systems.duffing_oscillator()), "omega", bounds=(0.5, 2.5))
    return bf.trace_curve(branch.special_points.of("fold")[0], ("omega", "zeta"), bounds=((0.5, 2.5), (0.01, 0.4)))


def test_a_curve_goes_through_its_cusp_and_both_parts_are_folds(folds):
    (cusp,) = folds.special_points.of("cusp")
    s = folds.column("s")
    assert s.min() < cusp.s < s.max()
    for side in (np.flatnonzero(s < cusp.s)[-3], np.flatnonzero(s > cusp.s)[2]):
        multipliers = folds.orbits[int(side)].multipliers
        assert np.abs(multipliers - 1.0).min() < 1e-5


@pytest.mark.parametrize("names", [("omega", "zeta"), ("omega", "amplitude")])
def test_a_point_of_codimension_two_is_no_start_of_a_curve(folds, names):
    (cusp,) = folds.special_points.of("cusp")
    with pytest.raises(ValueError, match="a point of a curve in two parameters already; .* switch_branch"):
        bf.trace_curve(cusp, names, bounds={"omega": (0.5, 2.5), names[1]: (0.01, 0.4)})
    assert "no other curve" in bf.switch_branch(cusp).status


def with_feedback(system, **how):
    """Return a system with a feedback of displacement."""
    feedback = bf.elements.DelayedFeedback(0.04, **how)
    return bf.System(system.mass, system.damping, system.stiffness, (*system.elements, feedback), omega=system.omega)


def test_a_delay_that_is_no_multiple_of_the_period_of_the_orbit():
    """One period for an orbit of one impact in three: the feedback does not vanish on it."""
    system = bf.systems.impact_oscillator(zeta=1.25, omega=2.0, amplitude=5.8309519 * 1.0001, restitution=0.7)
    orbit = bf.find_orbit(system, transient=400)
    assert orbit.success and orbit.periods > 1
    for delay in (None, 0.7):
        with pytest.raises(ValueError, match="whole number"):
            bf.control.feedback_basins(with_feedback(system, **({} if delay is None else {"delay": delay})), orbit,
                                       bf.Grid(q0=(-1, 0, 2), v0=(-1, 1, 2)))
    with pytest.raises(ValueError, match="periods"):
        bf.control.feedback_range(orbit, "displacement", (0.0, 0.1), delay=orbit.periods + 0.5)


@pytest.mark.parametrize("bounds", [(-3.0, -1.0), (20.0, 30.0)])
def test_gains_that_destabilise_a_stable_orbit(bounds):
    orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=2.0, amplitude=6.0, zeta=0.1))
    assert orbit.success and orbit.stable
    found = bf.control.feedback_range(orbit, "displacement", bounds, samples=9)
    assert found.status == "never_stable" and found.best_gain is None and found.intervals == ()


def one_impact(omega, n, zeta=0.05, force=0.52, gap=1.0, ratio=0.7):
    """Speeds of the impacts of all motions with one impact in n forcing periods that stay before the stop, in closed form."""
    period, wd = 2.0 * np.pi * n / omega, np.sqrt(1.0 - zeta**2)

    def homogeneous(t):
        c, s, e = np.cos(wd * t), np.sin(wd * t), np.exp(-zeta * t)
        return e * np.array([[c + zeta / wd * s, s / wd], [-s / wd, c - zeta / wd * s]])
    E = homogeneous(period)
    still = np.linalg.solve(np.eye(2) - E, [gap, 0.0] - E @ [gap, 0.0])  # steady response at the impact: still + v speed
    speed = np.linalg.solve(np.eye(2) - E, [0.0, 1.0] - E @ [0.0, -ratio])
    W = np.diag([1.0, omega**-2])
    size = force / np.hypot(1.0 - omega**2, 2.0 * zeta * omega)
    found = []
    for v in np.roots([speed @ W @ speed, 2.0 * still @ W @ speed, still @ W @ still - size**2]):
        if abs(v.imag) > 1e-12 or v.real < 1e-9:
            continue
        p = still + v.real * speed
        t = np.linspace(0.0, period, 2000 * n)[1:-1]
        x = p[0] * np.cos(omega * t) + p[1] / omega * np.sin(omega * t)
        x += np.einsum("it,i->t", homogeneous(t)[0], [gap - p[0], -ratio * v.real - p[1]])
        if x.max() <= gap + 1e-9:
            found.append(v.real)
    return found


@pytest.mark.slow
def test_default_atlas_of_the_impact_oscillator_to_eight_periods():
    """Every motion with one impact in up to 8 periods (closed form) is on a branch, and all that flips and grazings offer."""
    found = bf.atlas(bf.systems.impact_oscillator(), "omega", (0.5, 2.0), {"q0": (-3, 1), "v0": (-4, 4)})
    assert found.status == "nothing_new"
    kinds = {(str(p.kind), round(p.parameter, 9)) for branch in found.branches for p in branch.special_points}
    assert {("period_doubling", 0.824134290), ("period_doubling", 0.923529077), ("fold", 1.527621387),
            ("grazing", 1.226914230)} <= kinds  # those of the README's picture
    rng = np.random.default_rng(1)
    seen = 0
    for omega in [*rng.uniform(0.5, 2.0, 60), *rng.uniform(0.5, 0.9, 60)]:
        closed = [(n, v) for n in range(1, 9) for v in one_impact(omega, n)]
        known = [(orbit.periods, orbit.events[0].speed) for _, orbit in found.orbits_at(omega) if len(orbit.events) == 1]
        for n, v in closed:
            assert any(periods == n and abs(speed - v) < 1e-8 for periods, speed in known), (omega, n, v)
        seen += len(closed)
    assert seen > 60
    offered = 0
    for branch in found.branches:
        for point in branch.special_points:
            if point.kind in ("period_doubling", "grazing", "branch_point"):
                for orbit in bf.switch_branch(point, n_max=max(1, 8 // periods_of(branch))):
                    if orbit.periods <= 8:
                        offered += 1
                        assert any(on_branch(orbit, other) for other in found.branches), (point, orbit)
    assert offered > 20
