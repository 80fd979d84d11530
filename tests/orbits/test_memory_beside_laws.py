"""Elements with memory beside laws that are not affine: affine scenes, energy, a second implementation, harmonic balance."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from bifurc.orbits.shooting.resting import middle
from tests.hbm.test_examples import three
from tests.reference.sliders import DOWN, UP, Marched, Slider, Stop


def slider(cubic, omega=1.1, limit=1.0, amplitude=1.0, **load):
    law = [] if cubic is None else [el.CubicSpring(cubic)]
    return bf.System(1.0, 0.02, 1.0, [*law, el.Jenkins(1.0, limit, **load), el.HarmonicForce(amplitude)], omega=omega)


def again(cubic, omega=1.1):
    """The same oscillator by the second implementation."""
    return Marched(1.0, 0.02, 1.0, 1.0, omega, lambda q: cubic * q**3, [Slider((1.0,), 1.0, 1.0)])


STIFFNESSES = tuple(np.linspace(0.5, 1.5, 15) / 15.0)
LIMITS = tuple(1.5 * k * turn for k, turn in zip(STIFFNESSES, np.linspace(0.02, 1.2, 15), strict=True))
BESIDE = {
    "slider": [el.Jenkins(1.0, 1.0)],
    "varying": [el.Jenkins(1.0, 0.5, load_amplitude=0.5, load_phase=0.7)],
    "separating": [el.Jenkins(1.0, 0.5, load_amplitude=1.5, load_phase=0.7)],
    "iwan": [el.Iwan(STIFFNESSES, LIMITS)],
    "one row": [el.Jenkins(1.0, 0.5), el.Jenkins(0.5, 0.5)],
    "coulomb": [el.Coulomb(0.2), el.Jenkins(1.0, 0.4)],
    "stop": [el.Jenkins(1.0, 0.5), el.ElasticStop(0.6, 10.0)],
    "micro": [el.MicroSlip(20.0, 1.0, (0.03,) * 8)],
    "loaded": [el.LoadedMicroSlip(3.0, 1.0, (0.2, 0.15, 0.1), (0.5, 0.3, 1.2), (0.0, 1.0, 2.0))],
}


@pytest.mark.parametrize("beside", BESIDE)
def test_a_law_without_force_changes_nothing(beside):
    """The same scene by matrix exponentials and by the steps for laws."""
    plain = bf.System(1.0, 0.02, 1.0, [*BESIDE[beside], el.HarmonicForce(1.0)], omega=1.1)
    lawful = bf.System(1.0, 0.02, 1.0, [*BESIDE[beside], el.HarmonicForce(1.0), el.CubicSpring(0.0)], omega=1.1)
    a, b = (bf.simulate(system, (0.3, 0.2), periods=5.3) for system in (plain, lawful))
    named = [sorted((round(event.time, 9), event.element, event.kind) for event in motion.events) for motion in (a, b)]
    assert named[0] == named[1]  # of stops at one instant either may come first
    assert [event.time for event in b.events] == pytest.approx([event.time for event in a.events], abs=1e-11)
    assert b.final == pytest.approx(a.final, abs=1e-11)
    a, b = bf.find_orbit(plain), bf.find_orbit(lawful)
    assert a.success and b.success and len(a.events) == len(b.events)
    assert b.state == pytest.approx(a.state, abs=1e-11)
    assert b.multipliers == pytest.approx(a.multipliers, abs=1e-9)
    assert [event.time for event in b.events] == pytest.approx([event.time for event in a.events], abs=1e-11)
    assert b.maximum() == pytest.approx(a.maximum(), abs=1e-12) and b.harmonic(1) == pytest.approx(a.harmonic(1), abs=1e-11)


@pytest.mark.parametrize("cubic, omega", [(0.1, 1.1), (0.02, 1.1), (-0.02, 1.1), (0.3, 1.5)])
def test_against_runge_kutta(cubic, omega):
    """State, sliders, instants, energies and multipliers of stiffening and softening springs."""
    orbit = bf.find_orbit(slider(cubic, omega))
    assert orbit.success and len(orbit.events) == 4
    second = again(cubic, omega)
    done = second.run(orbit.state[:2], orbit.state[2:], 0.0, orbit.period)
    assert np.concatenate((done.y, done.w)) == pytest.approx(orbit.state, abs=2e-13)
    assert [event.time for event in orbit.events] == pytest.approx([event[0] for event in done.events], abs=1e-12)
    work, viscous, lost = done.energies
    assert work == pytest.approx(viscous + lost, rel=1e-12)
    assert work == pytest.approx(-np.pi * orbit.harmonic(1).imag, rel=1e-12)  # of the load: pi P b, b the sine part
    motion = bf.simulate(orbit.system, orbit.state, periods=1)
    lengths = [orbit.maximum() - way * motion(time)[0] for time, _, way in done.events if way in (UP, DOWN)]
    assert lost == pytest.approx(sum(lengths), rel=1e-12)  # the limit is 1
    step = 1e-5
    differenced = np.array([second.period(orbit.state + step * e) - second.period(orbit.state - step * e) for e in np.eye(3)]).T
    found = np.linalg.eigvals(differenced / (2.0 * step))
    assert orbit.multipliers[:2] == pytest.approx(found[np.lexsort((-found.imag, -np.abs(found).round(6)))][:2], abs=1e-8)
    assert abs(orbit.multipliers[2]) < 1e-14 and np.abs(found).min() < 1e-9  # the slider that follows


def test_harmonic_balance_converges_to_it():
    """The force has a corner where slip begins: coefficients fall as the power -4, the rest as -3."""
    for cubic in (0.1, -0.02):
        orbit = bf.find_orbit(slider(cubic))
        t, y = orbit.sample(801)
        counts, away = np.array([11, 21, 41, 81]), []
        for count in counts:
            balanced = bf.find_orbit(orbit.system, method=bf.HarmonicBalance(int(count)))
            away.append(np.abs(balanced.sample(801)[1][:, 0] - y[:, 0]).max())
        assert -np.polyfit(np.log(counts), np.log(away), 1)[0] == pytest.approx(3.0, abs=0.3)
        polished = bf.find_orbit(orbit.system, guess=balanced)
        assert polished.state == pytest.approx(orbit.state, abs=1e-12)
        assert polished.how["error of its first harmonic"] < 3e-8
        assert balanced.multipliers == pytest.approx(orbit.multipliers, abs=1e-6)


@pytest.mark.parametrize("beside", BESIDE)
def test_contacts_beside_a_cubic_spring(beside):
    """Orbits close, agree with a balance, and their multipliers with differences of the motion itself."""
    system = bf.System(1.0, 0.02, 1.0, [*BESIDE[beside], el.HarmonicForce(1.0), el.CubicSpring(0.1)], omega=1.1)
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.stable
    assert bf.simulate(system, orbit.state, periods=1).final == pytest.approx(orbit.state, abs=1e-10)
    if beside not in ("micro", "loaded"):  # refused by balances
        balanced = bf.find_orbit(system, method=bf.HarmonicBalance(31))
        assert bf.find_orbit(system, guess=balanced).maximum() == pytest.approx(orbit.maximum(), rel=1e-12)
        assert balanced.maximum() == pytest.approx(orbit.maximum(), abs=2e-3 if beside == "coulomb" else 2e-5)
    zeros = [value for value in orbit.multipliers if abs(value) < 1e-9]
    assert len(zeros) == len(orbit.multipliers) - 2 == orbit.scene.ns - 2 - len(orbit.family)
    step, away = 1e-5, []
    for unit in np.eye(orbit.scene.ns)[:2]:
        both = [bf.simulate(system, orbit.state + way * step * unit, periods=3) for way in (1.0, -1.0)]
        assert all(motion.success for motion in both)
        away.append((both[0].sections[:, :2] - both[1].sections[:, :2]) / (2.0 * step))
    two, three_ = (np.array([column[k] for column in away]).T for k in (2, 3))  # sliders have followed by then
    found = np.linalg.eigvals(three_ @ np.linalg.inv(two))
    assert orbit.multipliers[:2] == pytest.approx(found[np.lexsort((-found.imag, -np.abs(found).round(6)))], abs=1e-6)


def test_a_slider_that_always_sticks_labels_a_family():
    """Its +1 is left out, and the family ends where the slider is about to slip: no constant shift beside a law."""
    orbit = bf.find_orbit(slider(0.1, limit=5.0))
    assert orbit.success and not orbit.events and len(orbit.multipliers) == 2 and orbit.family == [2]
    low, high = orbit.intervals[2]
    assert low == pytest.approx(-high, rel=1e-12)
    assert high == pytest.approx(7.448195449773788, rel=1e-12)
    spring = bf.System(1.0, 0.02, 2.0, [el.CubicSpring(0.1), el.ConstantForce(high), el.HarmonicForce(1.0)], omega=1.1)
    there = bf.find_orbit(spring, guess=(3.1, 0.0))  # the slider as a spring from its place
    assert max(there.maximum() - high, high - there.minimum()) == pytest.approx(5.0, rel=1e-13)
    stuck = bf.find_orbit(bf.System(1.0, 0.02, 1.0, [el.CubicSpring(0.5), el.Coulomb(2.0), el.HarmonicForce(1.0)], omega=1.1))
    rest = np.roots([0.5, 0.0, 1.0, -1.0])  # q + q^3 / 2 = friction - load
    assert stuck.intervals[0][1] == pytest.approx(rest[np.abs(rest.imag) < 1e-9].real[0], rel=1e-11)


def test_the_family_of_a_subharmonic_ends_where_any_of_its_periods_does():
    """Each of three forcing periods has its own farthest point: the ends are those of all of them, whichever comes first."""
    system = bf.System(1.0, 0.02, 1.0, [el.HarmonicForce(4.0), el.CubicSpring(1.0), el.Jenkins(0.5, 0.5)], omega=4.0)
    first = bf.find_orbit(system, guess=(-0.5070839861, -0.7211776763, 0.2), periods=3)
    assert first.success and first.periods == 3 and first.family == [2] and not first.events
    ends = []
    for state in first.sections:  # the phase of a subharmonic is free
        orbit = bf.find_orbit(system, guess=state, periods=3)
        assert orbit.success and orbit.periods == 3
        ends.append(orbit.intervals[2])
    assert np.ptp(ends, axis=0).max() < 1e-11
    for end, way in zip(ends[0], (1.0, -1.0), strict=True):
        spring = bf.System(1.0, 0.02, 1.5, [el.HarmonicForce(4.0), el.CubicSpring(1.0), el.ConstantForce(0.5 * end)], omega=4.0)
        there = bf.find_orbit(spring, guess=first.state[:2], periods=3)  # the slider as a spring from its place
        assert there.periods == 3
        farthest = there.maximum() if way > 0.0 else there.minimum()
        assert 0.5 * way * (farthest - end) == pytest.approx(0.5, rel=1e-10)


@pytest.mark.parametrize("cubic", [None, 0.3])
def test_sliders_that_came_to_stand_by_chance_are_put_in_the_middle(cubic):
    """Without symmetry; in an affine scene a branch of this orbit begins to slip on both sides at once."""
    system = slider(cubic, limit=0.3, amplitude=0.15)
    system = bf.System(1.0, 0.02, 1.0, [*system.elements, el.ConstantForce(0.3)], omega=0.9)
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.family == [2] and "equally near" in orbit.how["note"]
    assert orbit.maximum() - orbit.state[2] == pytest.approx(orbit.state[2] - orbit.minimum(), rel=1e-11)
    if cubic is None:
        assert orbit.state[2] == pytest.approx(np.mean(orbit.intervals[2]), abs=1e-12)
        branch = bf.trace(orbit, "omega", bounds=(0.9, 1.4))
        onset = branch.special_points.of("slip_onset")[0].solution
        assert onset.maximum() - onset.minimum() == pytest.approx(0.6, abs=1e-10)  # twice limit over stiffness
        assert all(str(reason) == "bound" for reason in branch.stop_reason) and branch.column("n_events").max() == 4


@pytest.mark.parametrize("side", [1, -1])
def test_the_middle_of_a_family_is_that_of_its_interval_whatever_ends_it(side):
    """On one side by the first of two events: a stop that is touched before the slider slips."""
    stop = el.ElasticStop(0.21, 3.0, side=side)
    system = bf.System(1.0, 0.02, 1.0, [el.Jenkins(1.0, 0.6), stop, el.HarmonicForce(0.15)], omega=0.9)
    orbit = bf.find_orbit(system, guess=(0.0, 0.0, -0.1 * side))
    assert orbit.success and orbit.family == [2] and not orbit.events
    low, high = orbit.intervals[2]
    spring = bf.find_orbit(bf.System(1.0, 0.02, 2.0, [el.HarmonicForce(0.15)], omega=0.9)).maximum()
    # the slider's place moves the mean by half
    ends = [way * (2.0 * (0.21 - spring) if way == side else 1.2 - 2.0 * spring) for way in (-1, 1)]
    assert (low, high) == pytest.approx(ends, rel=1e-10)
    assert {c: step + orbit.state[c] for c, step in middle(orbit).items()} == {2: pytest.approx(0.5 * (low + high), abs=1e-12)}


@pytest.mark.parametrize("cubic", [0.05, -0.02])
def test_branches_pass_the_onsets_of_slip(cubic):
    """Onsets are where the stuck motion, that of a stiffer spring, reaches the limit."""
    branch = bf.trace(bf.find_orbit(slider(cubic, omega=0.4)), "omega", bounds=(0.4, 2.0))
    assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"] and branch.audit.ok
    onsets = branch.special_points.of("slip_onset")
    assert len(onsets) == 2 and (len(branch.special_points.of("fold")) == 2) == (cubic < 0.0)
    for onset in onsets:
        stuck = bf.System(1.0, 0.02, 2.0, [el.CubicSpring(cubic), el.HarmonicForce(1.0)], omega=onset.parameter)
        orbit = bf.find_orbit(stuck, guess=onset.solution.state[:2])
        assert orbit.maximum() == pytest.approx(1.0, abs=1e-12) and onset.error < 1e-12


class Lagging(el.Element):
    """A memory that follows its row with a delay: z' = u - z."""

    memory = ("lag",)

    def site(self, n):
        return el.Rows.of([[1.0]], n)

    def mode(self, key, core):
        return el.Mode(force=(el.local.z(0),), memory=(el.Rate(el.local.u(0) - el.local.z(0)),))


def test_memory_with_a_rate_is_refused_beside_a_law():
    elements = [Lagging(), el.HarmonicForce(0.1)]
    assert bf.simulate(bf.System(1.0, 0.2, 2.0, elements, omega=1.0), (0.1, 0.0, 0.0), periods=1).success
    with pytest.raises(ValueError, match="lagging: memory with a rate is not integrated together with .*cubic_spring"):
        bf.simulate(bf.System(1.0, 0.2, 2.0, [*elements, el.CubicSpring(0.1)], omega=1.0), (0.1, 0.0, 0.0), periods=1)


def example(omega):
    """Example 07 by the second implementation."""
    def cubes(q):
        one, two = q[1]**3, (q[2] - q[1])**3
        return np.array([0.0, one - two, two])

    K = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    sliders = [Slider((1.0, 0.0, 0.0), 20.0, 1.0), Slider((-1.0, 1.0, 0.0), 20.0, 1.0)]
    return Marched(np.eye(3), 0.02 * K, K, (0.0, 1.0, 0.0), omega, cubes, sliders, [Stop((0.0, 0.0, 1.0), 1.0, 0.25)])


@pytest.mark.slow
@pytest.mark.parametrize("omega, rms, events, zeros", [
    (0.7, 0.0691135947, 0, 0), (1.0, 0.0768120389130, 4, 1), (1.26916735869, 0.2067953698227, 10, 2),
    (1.5, 0.1607682726476, 10, 2)])
def test_example_of_three_masses(omega, rms, events, zeros):
    """Example 07: two sliders on relative rows, two cubic springs, an elastic stop; sqrt(sum q_h^2 / 2) of the second mass."""
    balanced = bf.find_orbit(three(omega), method=bf.HarmonicBalance(31))
    orbit = bf.find_orbit(three(omega), guess=balanced)
    assert orbit.success and orbit.stable and len(orbit.events) == events
    found = [np.sqrt(o.rms(1)**2 - 0.5 * abs(o.harmonic(0, 1))**2) for o in (orbit, balanced)]
    assert found == pytest.approx([rms, rms], rel=1e-4) and found[0] == pytest.approx(rms, rel=1e-9)
    second = example(omega)
    done = second.run(orbit.state[:6], orbit.state[6:], 0.0, orbit.period)
    assert np.concatenate((done.y, done.w)) == pytest.approx(orbit.state, abs=2e-13)
    assert [event.time for event in orbit.events] == pytest.approx([event[0] for event in done.events], abs=1e-12)
    assert done.energies[0] == pytest.approx(done.energies[1:].sum(), rel=1e-12)
    assert np.count_nonzero(np.abs(orbit.multipliers) < 1e-9) == zeros and len(orbit.multipliers) == 6 + zeros
    step, free = 1e-6, [i for i in range(8) if i not in orbit.family]
    M = np.array([second.period(orbit.state + step * e) - second.period(orbit.state - step * e) for e in np.eye(8)[free]]).T[free]
    sizes = np.sort(np.abs(np.linalg.eigvals(M / (2.0 * step))))[::-1]
    assert np.abs(orbit.multipliers) == pytest.approx(sizes, abs=1e-7)


def test_sliders_at_one_distance_from_their_limits_slip_together():
    """A set that stops in the middle of its slip and goes on: all groups reach their limits at one instant."""
    for law in ([], [el.CubicSpring(0.1)]):
        system = bf.System(1.0, 0.02, 1.0, [*BESIDE["iwan"], el.HarmonicForce(3.0), *law], omega=1.1)
        start = np.concatenate(([1.0 - 1e-5, 1.0], 1.0 - np.array(LIMITS) / np.array(STIFFNESSES)))
        motion = bf.simulate(system, start, duration=0.1)
        assert motion.success and len(motion.events) == 1 and motion.modes[-1][0] == "slip+15"
        assert motion.events[0].before[0] == pytest.approx(1.0, abs=1e-14)
