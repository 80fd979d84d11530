"""Gains of delayed feedback: closed forms, two methods against each other, limits that are named."""
import itertools

import numpy as np
import pytest
from scipy.linalg import expm

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.compose.writer import kernels
from bifurc.control.characteristic import Characteristic
from bifurc.control.collocated import Collocated
from bifurc.control.impact_order import ImpactOrder
from bifurc.control.linearization import _after, linearized
from bifurc.elements import CubicFriction, HarmonicForce
from tests.reference.impacting_orbit import FORCE, GAP, RATIO, ZETA, closed_form, impacting


@pytest.fixture(scope="module")
def orbit():
    return impacting()


def test_the_orbit_is_that_of_the_closed_form(orbit):
    v, _ = closed_form()
    assert orbit.events[0].speed == pytest.approx(v, rel=1e-13)
    np.testing.assert_allclose(orbit.multipliers.real, (-1.16885409830315, -0.326051098548087), rtol=1e-11)


def test_displacement_gains_end_where_the_two_by_two_equation_says(orbit):
    found = bf.control.feedback_range(orbit, "displacement", (-2.0, 0.5))
    np.testing.assert_allclose([end.gain for end in found.ends], (0.00889700738219574, 0.112742011752238), atol=1e-12)
    assert [end.kind for end in found.ends] == ["period_doubling", "neimark_sacker"]
    assert abs(np.angle(found.ends[1].multiplier)) == pytest.approx(1.9659569822698, abs=1e-11)
    assert found.intervals == ((found.ends[0].gain, found.ends[1].gain),)
    assert found.status == "found" and found.success


def own_equation(orbit, lam, gain):
    """h(lambda) = lambda^2 - lambda tr(E S) + r^2 exp(-2 zeta T) with the flight of stiffness 1 + K (1 - 1/lambda)."""
    v, t = closed_form()
    T = orbit.period
    push = FORCE * np.cos(2.5 * t) - GAP
    S = np.array([[-RATIO, 0.0], [(1.0 + RATIO) * push / v, -RATIO]])
    E = expm(np.array([[0.0, 1.0], [-1.0 - gain * (1.0 - 1.0 / lam), -2.0 * ZETA]]) * T)
    return lam**2 - lam * np.trace(E @ S) + RATIO**2 * np.exp(-2.0 * ZETA * T)


@pytest.mark.parametrize("gain", [0.004, 0.03, 0.2, -0.7])
def test_multipliers_solve_the_equation_of_the_single_flight(orbit, gain):
    found = bf.control.controlled_multipliers(orbit, "displacement", gain)
    for value in found:
        assert abs(own_equation(orbit, value, gain)) < 1e-11 * max(1.0, abs(value) ** 2)


def test_slow_growth_below_the_first_gain(orbit):
    assert bf.control.controlled_multipliers(orbit, "displacement", 0.004)[0] == pytest.approx(-1.099036, abs=1e-6)
    assert bf.control.controlled_multipliers(orbit, "displacement", 0.0089)[0] == pytest.approx(-0.999933, abs=1e-6)


def test_the_best_gain_lies_where_two_multipliers_meet_or_none_is_better(orbit):
    found = bf.control.feedback_range(orbit, "displacement", (0.0, 0.2))
    around = [abs(bf.control.controlled_multipliers(orbit, "displacement", found.best_gain * q)[0]) for q in (0.98, 1.0, 1.02)]
    assert around[1] == pytest.approx(found.best_modulus, abs=1e-9)
    assert around[1] < min(around[0], around[2])


def test_argument_principle_counts_what_collocation_finds_in_fifty_random_cases():
    rng = np.random.default_rng(4)
    cases = [(bf.systems.impact_oscillator(omega=w, amplitude=F), (-2.0, 1.0)) for w, F in
             ((2.5, 11.0), (2.5, 12.0), (0.8, 0.52), (0.75, 0.52))]
    cases.append((bf.systems.bilinear_oscillator(omega=1.29), (0.0, 0.0)))
    cases.append((bf.systems.two_sided_impact_oscillator(amplitude=3.0), (0.0, 0.0)))
    cases.append((bf.systems.duffing_oscillator(omega=1.0, amplitude=0.3), (0.5, 0.0)))
    done = counted = 0
    while done < 50:
        system, guess = cases[done % len(cases)]
        orbit = bf.find_orbit(system, guess=guess)
        assert orbit.success, system
        of = "displacement" if orbit.events or done % 2 else "velocity"
        memory = float(rng.choice([0.0, rng.uniform(0.1, 0.6)]))
        gain = float(rng.uniform(-1.0, 1.0))
        linear = linearized(orbit, of, 0, 1.0)
        values = np.abs(Collocated(linear, memory).multipliers(gain))
        if np.abs(values - 1.0).min() < 1e-6:
            continue
        count = Characteristic(linear, memory).count(gain)
        assert count == np.count_nonzero(values > 1.0), (system, of, memory, gain)
        counted += count > 0
        done += 1
    assert counted >= 10  # the draw holds stable and unstable cases


def test_collocation_and_equation_give_the_same_multipliers(orbit):
    for memory in (0.0, 0.35):
        for gain in (0.05, -0.4):
            exact = bf.control.controlled_multipliers(orbit, "displacement", gain, memory=memory, least=0.4)
            rough = Collocated(linearized(orbit, "displacement", 0, 1.0), memory).multipliers(gain)
            np.testing.assert_allclose(np.sort(np.abs(rough[:len(exact)])), np.sort(np.abs(exact)), rtol=1e-10)


def test_the_transition_without_feedback_is_the_monodromy():
    for system in (bf.systems.bilinear_oscillator(omega=1.29), bf.systems.duffing_oscillator(omega=1.3),
                   bf.systems.dry_friction_oscillator(), bf.systems.jenkins_oscillator(),
                   bf.System(1.0, 0.1, 1.0, [CubicFriction(0.3, 0.1, 0.02), HarmonicForce(1.5)], omega=0.8)):
        orbit = bf.find_orbit(system)
        linear = linearized(orbit, "displacement")
        np.testing.assert_allclose(linear.transition(np.zeros(1))[0], orbit.monodromy, atol=1e-11)


# velocity at a rigid stop

def test_velocity_gain_at_a_rigid_stop(orbit):
    found = bf.control.feedback_range(orbit, "velocity", (0.0, 0.8), samples=17)
    assert [end.gain for end in found.ends] == pytest.approx([0.11974245320865], abs=1e-12)
    assert found.ends[0].pattern == ((1,), (-1,))
    assert found.intervals == ((found.ends[0].gain, 0.8),)


@pytest.mark.parametrize("ratio, growth", [(0.9, 1.00929), (0.97, 1.00265), (1.03, 0.99746), (1.1, 0.99194)])
def test_growth_a_period_near_the_velocity_gain(orbit, ratio, growth):
    order = ImpactOrder(linearized(orbit, "velocity", 0, 0.2))
    gain = ratio * 0.11974245320865
    (top, pattern), = order.growths(gain)
    assert np.sqrt(top) == pytest.approx(growth, abs=6e-6) and pattern == ((1,), (-1,))
    assert order.iterated(gain) == pytest.approx(np.sqrt(top), abs=1e-9)


@pytest.mark.parametrize("gain", [-0.3, 0.3])
def test_impacts_that_come_earlier_and_earlier_grow_otherwise_than_later_ones(gain):
    """Of a saddle, against the delay equation: the pulses of the feedback lie before later impacts, and behind earlier ones."""
    system = bf.systems.impact_oscillator(omega=1.52446)
    saddle = bf.find_orbit(system, (-1.53703, 1.30947), transient=0)
    assert saddle.success and saddle.multipliers.real == pytest.approx([1.1315, 0.2868], abs=1e-3)
    order = ImpactOrder(linearized(saddle, "velocity", 0, 0.5))
    found = order.growths(gain)
    assert order.iterated(gain) == pytest.approx(np.sqrt(found[0][0]), abs=1e-9)
    held = bf.System(system.mass, system.damping, system.stiffness,
                     [*system.elements, bf.elements.DelayedFeedback(gain, of="velocity")], omega=system.omega)
    seen = set()
    for side in (1e-7, -1e-7):
        motion = bf.simulate(held, saddle.state + side * saddle.weights, periods=16, history=saddle)
        away = motion.sections[:, 0] - saddle.state[0]
        sign = int(np.sign(away[14] * away[12]) * np.sign(np.diff([event.time for event in motion.events])[-1] - system.period))
        largest = next(growth for growth, pattern in found if pattern == ((sign,), (sign,)))
        assert away[14] / away[12] == pytest.approx(largest, rel=2e-3)
        seen.add(sign)
    assert seen == {-1, 1}


@pytest.mark.parametrize("impacts, patterns", [(1, 3), (2, 10), (3, 36)])
def test_every_pattern_of_signs_is_asked_for_once(impacts, patterns):
    """Of 4^m pairs of periods those in which the two have changed places are the same motion."""
    order = ImpactOrder.__new__(ImpactOrder)
    order.count = impacts
    found = order.patterns
    assert len(found) == patterns and len({frozenset((pair, pair[::-1])) for pair in found}) == patterns
    every = set(itertools.product(itertools.product((1, -1), repeat=impacts), repeat=2))
    assert every == {*found, *(pair[::-1] for pair in found)}


def test_one_characteristic_equation_would_give_wrong_velocity_gains(orbit):
    equation = Characteristic(linearized(orbit, "velocity", 0, 0.8))
    assert all(equation.count(gain) > 0 for gain in (0.02, 0.12, 0.3, 0.8))


# a rotor that rubs: both velocities are fed back

@pytest.fixture(scope="module")
def rotor():
    """The rub orbit of one turn at nu = 1.28, unstable by a flip."""
    system = bf.systems.jeffcott_rotor(zeta=0.05, nu=1.28, eccentricity=0.2, offset=0.6, stiffness=30.0, friction=0.02,
                                       disk_radius=20.0)
    found = bf.find_orbit(system, guess=(1.435757840528465, -0.348039325418749, 0.455604609814722, 0.667747833906096))
    assert found.success and len(found.events) == 4
    return found


BOTH = ((1.0, 0.0), (0.0, 1.0))


@pytest.mark.slow
def test_both_velocities_of_a_rotor_that_rubs(rotor):
    assert rotor.multipliers[0].real == pytest.approx(-1.630858324397, rel=1e-9)
    found = bf.control.feedback_range(rotor, "velocity", (0.05, 4.55), row=BOTH, samples=5)
    np.testing.assert_allclose([end.gain for end in found.ends], (0.12145044680, 4.23886999450), rtol=1e-9)
    assert [end.kind for end in found.ends] == ["period_doubling", "neimark_sacker"]
    assert abs(np.angle(found.ends[1].multiplier)) == pytest.approx(0.52006738, abs=1e-8)
    assert abs(bf.control.controlled_multipliers(rotor, "velocity", 0.2, row=BOTH)[0]) == pytest.approx(0.7647, abs=5e-5)


def test_several_rows_are_each_fed_back_to_itself():
    """Rows turned by an angle feed back the same force; impulses of several rows are refused by name."""
    chain = bf.find_orbit(bf.systems.impact_chain(n=2, omega=0.8))
    assert chain.success and chain.events
    c, s = np.cos(0.4), np.sin(0.4)
    for memory in (0.0, 0.3):
        straight, turned = (bf.control.controlled_multipliers(chain, "displacement", 0.1, row=rows, memory=memory, least=0.4)
                            for rows in (BOTH, ((c, s), (-s, c))))
        assert straight.size
        np.testing.assert_allclose(np.sort_complex(straight), np.sort_complex(turned), atol=1e-11)
    with pytest.raises(ValueError, match="independent"):
        bf.control.feedback_range(chain, "displacement", (0.0, 1.0), row=((1.0, 0.0), (2.0, 0.0)))
    with pytest.raises(bf.control.NotSupported, match="velocity feedback of 2 rows"):
        bf.control.feedback_range(chain, "velocity", (0.0, 1.0), row=BOTH)


# limits, named

def test_an_odd_number_of_multipliers_above_one_is_told():
    orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=1.52446), (-1.53703, 1.30947), transient=0)
    assert orbit.success and complex(orbit.multipliers[0]).real > 1.1 > abs(orbit.multipliers[1])
    found = bf.control.feedback_range(orbit, "displacement", (-1.0, 1.0))
    assert found.status == "odd_number" and "Nakajima" in found.message and not found.intervals
    equation = Characteristic(linearized(orbit, "displacement", 0, 1.0))
    for gain in (-0.9, -0.1, 0.1, 0.9):  # F(0) = 1, F(1) < 0 whatever the gain: a real multiplier above 1 is left
        assert equation(1.0, gain)[0].real == pytest.approx(equation(1.0, 0.0)[0].real) and equation(1.0, gain)[0].real < 0.0
        found = bf.control.controlled_multipliers(orbit, "displacement", gain, least=0.9)
        assert any(abs(value.imag) < 1e-12 and value.real > 1.0 for value in found)


def test_bad_arguments_are_named(orbit):
    with pytest.raises(ValueError, match="delay = 0.5 periods"):
        bf.control.feedback_range(orbit, "displacement", (0.0, 1.0), delay=0.5)
    with pytest.raises(ValueError, match="memory = 1.0"):
        bf.control.feedback_range(orbit, "displacement", (0.0, 1.0), memory=1.0)
    with pytest.raises(ValueError, match="of = 'acceleration'"):
        bf.control.feedback_range(orbit, "acceleration", (0.0, 1.0))
    with pytest.raises(ValueError, match="low gain must be below"):
        bf.control.feedback_range(orbit, "displacement", (1.0, 0.0))
    with pytest.raises(bf.control.NotSupported, match="'rigid_stop'"):
        bf.control.controlled_multipliers(orbit, "velocity", 0.1)
    with pytest.raises(bf.control.NotSupported, match="memory 0.3"):
        bf.control.feedback_range(orbit, "velocity", (0.0, 1.0), memory=0.3)
    with pytest.raises(ValueError, match="row = 1 is not allowed"):
        bf.control.feedback_range(orbit, "displacement", (0.0, 1.0), row=1)


def test_gains_that_destabilise_are_told(orbit):
    found = bf.control.feedback_range(orbit, "displacement", (-2.0, 0.0), samples=17)
    assert found.status == "never_stable" and found.best_gain is None


@pytest.mark.parametrize("omega", [0.7, 2.3])
def test_states_between_events_are_those_of_the_exponential(omega):
    """The joined state (q, v, 1, cos, sin) follows one linear system; its forcing turns by the angle of the excitation."""
    scene = scene_of(bf.System(1.0, 0.3, 1.7, [bf.elements.HarmonicForce(0.8, phase=0.4)], omega=omega))
    whole = np.zeros((5, 5))
    whole[:2] = scene.tables.A[0]
    whole[3, 4], whole[4, 3] = -omega, omega
    x = np.array([0.4, -0.9, 1.0, np.cos(0.8), np.sin(0.8)])
    for time in (0.05, 1.1):
        assert _after(kernels(scene), scene.tables, 0, x, time) == pytest.approx(expm(whole * time) @ x, abs=1e-13)


@pytest.mark.slow
def test_stated_errors_of_gains_hold_the_closed_form():
    """Motions with one impact a period a little past their flips, in 30 digits; det(lambda I - E_lambda S) = 0 at the ends."""
    mp = pytest.importorskip("mpmath")
    checked = 0
    with mp.workdps(30):
        for seed in range(12):
            rng = np.random.default_rng(seed)
            zeta, omega, ratio, gap = (float(v) for v in (rng.uniform(0.02, 0.2), rng.uniform(2.1, 2.9), rng.uniform(0.4, 0.85),
                                                          10**rng.uniform(-2.0, 2.0)))
            z, w, r, period = mp.mpf(zeta), mp.mpf(omega), mp.mpf(ratio), 2 * mp.pi / mp.mpf(omega)

            def flight(stiffness, z=z, t=period):
                d = mp.sqrt(mp.mpc(z * z - stiffness))
                s, c, e = mp.sinh(d * t) / d, mp.cosh(d * t), mp.exp(-z * t)
                return mp.matrix([[e * (c + z * s), e * s], [-stiffness * e * s, e * (c - z * s)]])
            E, D = flight(mp.mpf(1)).apply(mp.re), mp.exp(-2 * z * period)
            trace = E[0, 0] + E[1, 1]
            lam, gam = (1 + r) * E[0, 1] / (trace - 1 - D), 1 - (1 + r) * (E[1, 1] - D) / (trace - 1 - D)
            K = -r * trace + (1 + r) * E[0, 1] * (2 * z * gam - (1 - w * w) * lam)
            v = mp.mpf("0.93") * (1 + r) * E[0, 1] * w * w * gap / (K + 1 + r * r * D)
            load = mp.sqrt((gap - lam * v)**2 + (gam * v / w)**2) * mp.sqrt((1 - w * w)**2 + (2 * z * w)**2)
            time = float((mp.atan2(-gam * v / w, gap - lam * v) + mp.atan2(2 * z * w, 1 - w * w)) / w) % float(period)
            system = bf.systems.impact_oscillator(zeta=zeta, omega=omega, amplitude=float(load), gap=gap, restitution=ratio)
            start = bf.simulate(system, (gap, -ratio * float(v)), t0=time, duration=float(period) - time).final
            orbit = bf.find_orbit(system, guess=start)
            if v <= 0 or not orbit.success or len(orbit.events) != 1:
                continue
            S = mp.matrix([[-r, 0], [(1 + r) * (-w * w * gap / v - (1 - w * w) * lam + 2 * z * gam), -r]])

            def equation(value, gain, S=S, r=r, D=D, flight=flight):
                M = flight(1 + gain * (1 - 1 / value)) * S
                return value**2 - value * (M[0, 0] + M[1, 1]) + r * r * D
            for end in bf.control.feedback_range(orbit, "displacement", (0.0, 0.6)).ends:
                gain, angle = mp.mpf(end.gain), mp.mpf(float(abs(np.angle(end.multiplier))))
                if end.kind == "period_doubling":
                    exact = mp.findroot(lambda k, h=equation: mp.re(h(mp.mpf(-1), k)), gain)
                else:
                    exact = mp.findroot(lambda k, a, h=equation: [part(h(mp.exp(mp.mpc(0, mp.re(a))), mp.re(k)))
                                                                  for part in (mp.re, mp.im)], (gain, angle))[0]
                assert abs(float(exact - gain)) <= end.error < 1e-12
                checked += 1
    assert checked > 12

@pytest.mark.parametrize("unit", [1e-8, 1.0, 1e8])
@pytest.mark.parametrize("of", ["displacement", "velocity"])
def test_a_feedback_pushes_by_one_over_the_mass_in_any_unit_of_time(unit, of):
    """To rounding, however slow or stiff the system is: the push is what a unit gain changes, over the mass."""
    system = bf.System(2.3, 0.1 / unit, 3.1 / unit**2, [bf.elements.HarmonicForce(0.7 / unit**2), bf.elements.RigidStop(5.0, 0.5)],
                       omega=0.7 / unit)
    for piece in linearized(bf.find_orbit(system), of).pieces:
        np.testing.assert_allclose(piece.b.ravel(), [0.0, -1.0 / 2.3], rtol=1e-12)


def test_orbits_without_a_clock_are_refused_by_every_method_of_control():
    """One multiplier is 1 for every gain: a verdict "odd number" from the rounding of det(I - M) = 0 would be none."""
    orbit = bf.find_orbit(bf.systems.belt_oscillator())
    assert orbit.autonomous and orbit.success
    for control in (lambda: bf.control.feedback_range(orbit), lambda: bf.control.controlled_multipliers(orbit, "velocity", 0.1),
                    lambda: bf.control.ogy(orbit, "kinetic", section=0.3)):
        with pytest.raises(bf.control.NotSupported, match="no clock"):
            control()
