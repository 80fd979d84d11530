"""Boundaries whose tests are zero with some power of the way: their place is known as well as that of others, and alone there."""
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import fsolve

import bifurc as bf
from bifurc.continuation import StopReason
from bifurc.elements import ConstantForce, Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop
from bifurc.orbits.orbit import PeriodicOrbit

PRESSED, LOAD = 2.0, 1.0


@pytest.fixture(scope="module")
def branch():
    """A mass pressed on a plastic stop, which it leaves where the load pulls it off: the gap at which that begins is the difference
    of both forces over a stiffness of 1.  The release, and the impact behind it, are born with the cube of the way."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(LOAD), ConstantForce(PRESSED), RigidStop(1.1, 0.0)], omega=1.5)
    return bf.trace(bf.find_orbit(system), "rigid_stop.gap", bounds=(0.8, 1.3))


def test_a_release_begins_where_the_forces_balance_seen_from_anywhere(branch):
    """All that begins there is the release: no fold, and no multiplier of a mass that every impact stops."""
    for orbit in branch.orbits[::2]:
        other = bf.trace(orbit, "rigid_stop.gap", bounds=(0.8, 1.3))
        (point,) = other.special_points
        assert point.kind.value == "grazing", other.special_points
        assert abs(point.parameter - (PRESSED - LOAD)) <= point.error + 1e-15 < 1e-8
        assert other.stop_reason == (StopReason.BOUND, StopReason.BOUND) and other.audit.ok


def test_no_steps_creep_up_to_it(branch):
    assert len(branch) < 40


# a mass that a stop and friction hold by turns

PULL, STIFFNESS, GAP, FRICTION = 0.566, 1.37, 0.133, 0.0474
HELD = PULL - STIFFNESS * GAP  # what presses the mass on its stop, without the load


def held_by_turns(amplitude, restitution):
    """Return a mass pressed on a stop, where friction acts on it as well."""
    return bf.System(1.0, 0.05, STIFFNESS, [HarmonicForce(amplitude), ConstantForce(PULL), RigidStop(GAP, restitution),
                                            Coulomb(FRICTION)], omega=1.287)


@pytest.mark.parametrize("share", [-0.9, 0.0, 0.9])
@pytest.mark.parametrize("restitution", [0.0, 0.667])
def test_a_mass_that_friction_holds_while_its_stop_does_not_stands_still(restitution, share):
    """The stop lets go while the load leaves less than the friction, which is at its limit before and after: no slip is one."""
    orbit = bf.find_orbit(held_by_turns(HELD + share * FRICTION, restitution))
    assert orbit.success and orbit.stable and [str(event.kind) for event in orbit.events] == ["release", "slip"]
    _, y = orbit.sample(50)
    assert abs(y[:, 0] - GAP).max() < 1e-15 and abs(y[:, 1]).max() < 1e-15


@pytest.mark.parametrize("start", [0.3, 0.4, 0.6])
@pytest.mark.parametrize("restitution", [0.0, 0.3])
def test_it_begins_to_be_held_by_turns_and_to_slip_where_the_forces_balance(restitution, start):
    branch = bf.trace(bf.find_orbit(held_by_turns(start, restitution)), "harmonic_force.amplitude", bounds=(0.25, 0.65))
    assert [end.reason for end in branch.ends] == [StopReason.BOUND, StopReason.BOUND] and branch.audit.ok
    turns, slips = branch.special_points[:2]
    for point, force in ((turns, HELD - FRICTION), (slips, HELD + FRICTION)):
        assert abs(point.parameter - force) <= point.error + 1e-15 < 1e-8
    assert (turns.kind.value, slips.kind.value) == ("stick_onset", "grazing") and len(branch.special_points) == 3


# a mass that begins to slip to and fro: what the two slips move it is of fourth order in their durations

MASS, DAMPING, SPRING, JOINT, DASHPOT, FORCE, ROOM, BOUNCE, HOLDING = 1.31, 0.1004, 1.673, 0.673, 0.0404, 1.3, 0.278, 0.543, 0.212


def limits_of_standing(unknowns):
    """Return what is zero where the second mass begins to slip both ways: it stands at ``y``, the first one is an oscillator with
    one impact a period, of which the motion is known, and what it pulls has its greatest and least value at ``t1`` and ``t2``."""
    omega, y, begin, speed, t1, t2 = unknowns
    wave, free = FORCE / (SPRING - omega**2 + 1j * DAMPING * omega), complex(-0.5 * DAMPING, np.sqrt(SPRING - 0.25 * DAMPING**2))
    behind = -BOUNCE * speed - (1j * omega * wave * np.exp(1j * omega * begin)).real
    aside = ROOM - (wave * np.exp(1j * omega * begin)).real - JOINT * y / SPRING
    swing = complex(aside, (aside * free.real - behind) / free.imag)

    def moved(t, order):
        forced, own = (1j * omega)**order * wave * np.exp(1j * omega * t), free**order * swing * np.exp(free * (t - begin))
        return (forced + own).real + (JOINT * y / SPRING if order == 0 else 0.0)

    def pull(t, order):
        return JOINT * moved(t, order) + DASHPOT * moved(t, order + 1) - (SPRING * y if order == 0 else 0.0)
    end = begin + 2.0 * np.pi / omega
    return [moved(end, 0) - ROOM, moved(end, 1) - speed, pull(t1, 0) - HOLDING, pull(t1, 1), pull(t2, 0) + HOLDING, pull(t2, 1)]


def rounded_otherwise(monkeypatch, count):
    """Yield ``count`` times, each time with other last digits of the states that simulations begin with."""
    states = PeriodicOrbit._states
    for seed in range(count):
        rng = np.random.default_rng(seed)

        def rounded(self, at, rng=rng):
            found = states(self, at)
            return found * (1.0 + 1e-15 * rng.normal(size=found.shape))
        monkeypatch.setattr(PeriodicOrbit, "_states", rounded)
        yield


def test_two_slips_that_are_born_at_once_are_followed_however_states_are_rounded(monkeypatch):
    """Where they begin, all short durations solve the equations to rounding: only a branch of durations that are told from none
    leads away.  The frequency there is that of the mass which stands."""
    damping, spring = [[DAMPING, -DASHPOT], [-DASHPOT, DAMPING]], [[SPRING, -JOINT], [-JOINT, SPRING]]
    system = bf.System(np.diag([1.0, MASS]), damping, spring, [HarmonicForce(FORCE), RigidStop(ROOM, BOUNCE),
                                                               Coulomb(HOLDING, dof=1)], omega=2.44)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(1.708, 3.172))
    onset = fsolve(limits_of_standing, [2.51, -0.01, 6.2, 0.1, 8.7, 7.4], xtol=1e-13)[0]
    kinds = [(point.kind.value, point.parameter) for point in branch.special_points][-3:]
    assert [kind for kind, _ in kinds] == ["stick_onset", "slip_onset", "grazing"]
    assert kinds[1][1] == pytest.approx(onset, abs=1e-8)
    for _ in rounded_otherwise(monkeypatch, 16):
        other = bf.trace(branch.orbits[-3], "omega", bounds=(1.708, 3.172))
        found = [(point.kind.value, point.parameter) for point in other.special_points][-3:]
        assert [kind for kind, _ in found] == ["stick_onset", "slip_onset", "grazing"]
        np.testing.assert_allclose([value for _, value in found], [value for _, value in kinds], atol=1e-8)


# a friction that all but stops just behind its reversals

CHAIN, LOSS, PUSH, RATE = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]]), 0.05, 0.969, 0.544


def behind_reversal(friction, begin):
    """Return speed and further derivatives of the third mass behind its reversal, where it slips all the time: the answer to the
    load, and to a friction that turns round every half period."""
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-CHAIN, -LOSS * CHAIN]])
    wave = np.linalg.solve(CHAIN - RATE**2 * np.eye(3) + 1j * RATE * LOSS * CHAIN, [PUSH, 0.0, 0.0])[2] * np.exp(1j * RATE * begin)
    moved = np.append(np.linalg.solve(CHAIN, [0.0, 0.0, friction]), np.zeros(3))
    free, found = np.linalg.solve(expm(np.pi / RATE * A) + np.eye(6), -2.0 * moved), []
    for order in range(1, 7):
        found.append(free[5] + ((1j * RATE)**order * wave).real)
        free = A @ free
    return found


def touching_zero(unknowns):
    """Return what is zero where the third mass comes to rest for an instant behind its reversal: its speed over the time."""
    friction, begin, later = unknowns
    rates = np.array(behind_reversal(friction, begin)) / [1.0, 1.0, 2.0, 6.0, 24.0, 120.0]
    return [rates[0], sum(rate * later**k for k, rate in enumerate(rates[1:])),
            sum(k * rate * later**(k - 1) for k, rate in enumerate(rates[1:]))]


def test_a_stick_just_behind_a_reversal_is_followed_however_states_are_rounded(monkeypatch):
    """The sequence between the birth of the stick and that of a stick from the reversal on lives for 3e-8 of the friction."""
    stops = [ElasticStop(gap, 9.43, row=row) for gap, row in ((0.264, (1.0, -1.0, 0.0)), (0.473, (0.0, 1.0, -1.0)))]
    system = bf.System(np.eye(3), LOSS * CHAIN, CHAIN, [HarmonicForce(PUSH), *stops, Coulomb(0.12, dof=2)], omega=RATE)
    stick, slip = fsolve(touching_zero, [0.13332, 0.2166, 3e-4], xtol=1e-12)[0], fsolve(
        lambda unknowns: behind_reversal(*unknowns)[:2], [0.13332, 0.2166], xtol=1e-12)[0]
    start = bf.find_orbit(system)
    for _ in rounded_otherwise(monkeypatch, 6):
        branch = bf.trace(start, "coulomb.friction", bounds=(0.1, 0.16))
        first, second = branch.special_points
        assert (first.kind.value, second.kind.value) == ("stick_onset", "slip_onset") and branch.audit.ok
        assert (first.parameter, second.parameter) == (pytest.approx(stick, abs=1e-12), pytest.approx(slip, abs=1e-12))


# a mass on a slider and under friction, whose reversals last for no time: at a limit of the load it begins to stick in them

BODY, DAMPER, COIL, SLIDER = 1.2722, 0.2789, 2.8221, 1.88


def stick_onset(load, limit, friction, guess):
    """Return the frequency at which a motion with two reversals a period, symmetric, begins to stick in them: from its largest
    displacement, at the phase ``phi`` of the load, the mass begins to move with no acceleration."""
    def missed(unknowns):
        top, phi, slips, omega = unknowns

        def moved(z, time, stiffness, force):
            A = np.zeros((5, 5))
            A[0, 1], A[2, 3], A[3, 2] = 1.0, -omega, omega
            A[1] = np.array([-stiffness, -DAMPER, load, 0.0, force]) / BODY
            return expm(A * time) @ z
        z = np.array([top, 0.0, np.cos(phi), np.sin(phi), 1.0])
        pressed = COIL * top + limit - friction - load * np.cos(phi)
        z = moved(z, slips, COIL + SLIDER, SLIDER * top - limit + friction)
        length = z[0] - (top - 2.0 * limit / SLIDER)
        z = moved(z, np.pi / omega - slips, COIL, limit + friction)
        return [length, z[0] + top, z[1], pressed]
    return fsolve(missed, guess, xtol=1e-14)[-1]


@pytest.mark.parametrize("load, limit, friction, near", [
    (0.736, 0.298, 0.086, 0.8133), pytest.param(0.736, 0.298, 0.1, 0.8393, marks=pytest.mark.slow)])
def test_a_stick_begins_where_its_reaction_has_a_maximum_at_all(load, limit, friction, near):
    """From above the reaction has no maximum in the reversal before, and one that is zero with the square of the way behind: its
    zero is where it comes into being.  The slider is at its limit by itself."""
    system = bf.System(BODY, DAMPER, COIL, [HarmonicForce(load), Jenkins(SLIDER, limit), Coulomb(friction)], omega=near + 1e-3)
    orbit, bounds = bf.find_orbit(system), (near - 0.05, near + 0.08)
    top = next(event for event in orbit.events if event.kind.value == "stick" and event.before[0] > 0.0)
    onset = stick_onset(load, limit, friction, [top.before[0], orbit.system.omega * top.time, 3.0, near])
    assert abs(onset - near) < 1e-3
    branch = bf.trace(orbit, "omega", bounds=bounds)
    assert branch.audit.ok
    for start in (branch.orbits[0], branch.orbits[-1]):
        other = bf.trace(start, "omega", bounds=bounds)
        (point,) = other.special_points.of("stick_onset")
        assert abs(point.parameter - onset) <= point.error + 1e-14 < 1e-9
        assert other.stop_reason == (StopReason.BOUND, StopReason.BOUND)
