"""Branches through births and deaths of stick, slip and separation, against closed forms."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from bifurc.system import System
from tests.reference.coulomb import SlipOnly, interior_limit

STICK = [(1.0, 0.1), (0.5, 0.1), (0.6, 0.05), (0.8, 0.0), (0.8, 0.1), (1.0, 0.01), (1.2, 0.1), (2.0, 0.1)]


def traced(parameter, bounds, guess=(0.0, 0.0), touching=(), **parameters):
    orbit = bf.find_orbit(bf.systems.dry_friction_oscillator(**parameters), guess)
    branch = bf.trace(orbit, parameter, bounds=bounds)
    assert branch.audit.ok or touching, branch.audit
    assert not (branch.audit.violations or branch.audit.resimulated.not_repeated or branch.audit.resimulated.unexplained)
    assert [kind for kind, *_ in branch.audit.unresolved] == list(touching)
    assert sorted(branch.column(parameter)[[0, -1]]) == pytest.approx(sorted(bounds), abs=0)
    return branch


@pytest.mark.parametrize("omega, zeta", STICK)
@pytest.mark.parametrize("side", [0.9, 1.1], ids=["sticking", "slipping"])
def test_stick_onset_against_the_closed_form(omega, zeta, side):
    want = SlipOnly(omega, zeta, 100.0).alpha_stick
    touching = ["fold"] if (omega, zeta) == (0.8, 0.0) else []  # dp/ds falls to nothing there: two folds or none is rounding
    branch = traced("amplitude", (0.8 * float(want), 1.2 * float(want)), omega=omega, zeta=zeta, amplitude=side * float(want),
                    touching=touching)
    (point,) = branch.special_points.of("stick_onset")
    assert abs(point.parameter - float(want)) < 1e-12 * float(want)
    assert abs(point.parameter - float(want)) <= point.error + 2e-15 * float(want)


def test_stick_onset_in_friction():
    """beta = 1.07512236765223493 at alpha = 1.6."""
    (point,) = traced("friction", (0.5, 1.5), amplitude=1.6).special_points.of("stick_onset")
    assert point.parameter == pytest.approx(1.07512236765223493, abs=1e-13)


@pytest.mark.parametrize("start", [8.0, 9.2, 11.0])
@pytest.mark.parametrize("zeta", [0.1, 0.05])
def test_interior_limit_governs_at_low_frequency(start, zeta):
    """The speed touches zero inside the half cycle above alpha_stick: that is where the slip-only orbit ends."""
    want = float(interior_limit(0.4, zeta))
    assert want > float(SlipOnly(0.4, zeta, 40.0).alpha_stick)
    branch = traced("amplitude", (0.85 * want, 1.25 * want), omega=0.4, zeta=zeta, amplitude=start / 9.25 * want)
    point = max(branch.special_points.of("stick_onset"), key=lambda p: p.parameter)
    assert point.parameter == pytest.approx(want, abs=1e-11)


@pytest.mark.parametrize("zeta", [0.0, 0.1])
def test_right_next_to_the_onset(zeta):
    """(1 +- 1e-6) of the boundary: two sticks below, none above."""
    want = float(SlipOnly(0.8, zeta, 100.0).alpha_stick)
    for factor, sticks in ((1.0 - 1e-6, 2), (1.0 + 1e-6, 0)):
        orbit = bf.find_orbit(bf.systems.dry_friction_oscillator(omega=0.8, zeta=zeta, amplitude=factor * want), (0.5, 0.0))
        assert orbit.success and sum(event.kind == "slip" for event in orbit.events) == sticks
        near = float(SlipOnly(0.8, zeta, factor * want).x_max)  # sticks of 1e-6 periods change x by the square
        assert orbit.maximum() == pytest.approx(near, abs=1e-10 if sticks else 1e-13)


def test_from_rest_through_stick_slip_to_slip():
    branch = traced("amplitude", (0.5, 2.0), amplitude=0.9)
    assert [str(point.kind) for point in branch.special_points] == ["slip_onset", "stick_onset"]
    first, second = branch.special_points
    assert first.parameter == pytest.approx(1.0, abs=1e-14) and second.parameter == pytest.approx(1.48820269035416898, abs=1e-13)
    alpha, top = branch.column("amplitude"), branch.column("max_0")
    rising = np.diff(top[alpha > 1.0])
    assert np.all(np.abs(top[alpha < 1.0]) < 1e-30) and np.all(rising > -1e-14)  # the two rows of a change are one orbit


def test_sticks_come_and_go_with_frequency():
    """At xi = .02 up to eight sticks a period near Omega = .05; every change is a special point, every part is admissible."""
    branch = traced("omega", (0.05, 2.0), omega=0.06, zeta=0.02, amplitude=2.0)
    kinds = [str(point.kind) for point in branch.special_points]
    assert set(kinds) == {"stick_onset", "slip_onset"} and len(kinds) == 7
    for index in np.linspace(0, len(branch) - 1, 12).astype(int):
        orbit = branch.orbits[index]
        assert orbit.success
        again = bf.simulate(orbit.system, orbit.state, periods=1)
        assert again.final == pytest.approx(orbit.state, abs=1e-9)


def test_separation_is_where_the_load_vanishes():
    branch = traced("load_amplitude", (0.1, 1.9), amplitude=1.4, load_amplitude=0.5, load_phase=0.7)
    (point,) = branch.special_points.of("separation")
    assert point.parameter == pytest.approx(1.0, abs=1e-12)
    assert [str(p.kind) for p in branch.special_points] == ["stick_onset", "separation", "slip_onset"]


def test_a_slider_begins_to_slip_where_the_linear_response_reaches_its_limit():
    """k |X| = limit, |X| = F / |1 + k - omega^2 + 2 i zeta omega|."""
    zeta, omega, k = 0.05, 1.1, 1.0
    orbit = bf.find_orbit(bf.systems.jenkins_oscillator(zeta=zeta, omega=omega, amplitude=0.2), (0.0, 0.0))
    branch = bf.trace(orbit, "amplitude", bounds=(0.1, 3.0))
    assert branch.audit.ok
    (point,) = branch.special_points.of("slip_onset")
    want = abs(1.0 + k - omega**2 + 2j * zeta * omega)
    assert point.parameter == pytest.approx(want, abs=1e-13)
    again = bf.trace(branch.orbits[-1], "amplitude", bounds=(0.1, 3.0))
    assert again.special_points.of("slip_onset")[0].parameter == pytest.approx(want, abs=1e-13)


def test_static_friction_above_kinetic_ends_a_branch_honestly():
    """With a jump of the force a touched limit has no orbit next to it: the branch stops there and says so."""
    system = System(1.0, 0.2, 1.0, [el.HarmonicForce(2.0, phase=-np.pi / 2), el.Coulomb(1.0, static_ratio=1.2)], omega=1.0)
    orbit = bf.find_orbit(system, (0.0, 0.0))
    assert orbit.success
    branch = bf.trace(orbit, "amplitude", bounds=(0.5, 2.5))
    assert branch.audit.ok and all(branch.orbits[i].success for i in range(len(branch)))


def test_a_branch_with_friction_is_saved_and_extended(tmp_path):
    branch = traced("amplitude", (1.2, 1.6), amplitude=1.4)
    branch.save(tmp_path / "branch.npz")
    loaded = bf.load(tmp_path / "branch.npz")
    longer = loaded.extend(bounds=(1.05, 2.0))
    assert longer.special_points.of("stick_onset")[0].parameter == pytest.approx(1.48820269035416898, abs=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("parameter, bounds", [("omega", (0.08, 2.5)), ("amplitude", (1.02, 6.0))])
def test_random_branches_reach_their_bounds(parameter, bounds, rng):
    for _ in range(20):
        values = dict(omega=rng.uniform(0.08, 2.5), zeta=rng.uniform(0.01, 0.2), amplitude=10.0 ** rng.uniform(0.03, 0.7))
        orbit = bf.find_orbit(bf.systems.dry_friction_oscillator(**values), (0.0, 0.0))
        branch = bf.trace(orbit, parameter, bounds=bounds)
        assert sorted(branch.column(parameter)[[0, -1]]) == pytest.approx(sorted(bounds), abs=0), values
        assert all(point.error < 1e-9 for point in branch.special_points), branch.special_points
        for i in (0, len(branch) // 2, len(branch) - 1):
            assert branch.orbits[i].success
