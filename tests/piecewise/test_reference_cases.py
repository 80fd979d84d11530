"""Systems of first order with numbers that two independent computations agree on: orbits, multipliers, bifurcation values."""
import math

import numpy as np
import pytest

import bifurc as bf

F, S, R = bf.AffineField, bf.AffineSurface, bf.AffineReset


def after(orbit, place, t):
    """Return the state of an orbit at a time after one of its events."""
    event = orbit.events[place]
    return bf.simulate(orbit.system, event.after, t0=event.time, duration=t, mode=event.mode_after).final


def test_relay_feedback_up_to_where_its_flights_end():
    """R1, R2; at s = 0 the field of the slide is a centre, and slides of any size are orbits of the period 2 pi."""
    orbit = bf.find_orbit(bf.systems.relay_feedback(), (0.1, -1.0, -3.0))
    assert orbit.success and orbit.period == pytest.approx(7.785215102286, abs=1e-10)
    np.testing.assert_allclose(sorted(abs(orbit.multipliers)), [0.0, 0.135173539938**2], atol=1e-9)
    begin, end = orbit.events[:2]
    assert end.time - begin.time == pytest.approx(0.134674009630, abs=1e-10)
    np.testing.assert_allclose(np.abs(end.after), [0.0, 1.0, 4.033213556319], atol=1e-10)
    assert orbit.events[2].time - end.time == pytest.approx(3.757933541513, abs=1e-10) and begin.kind == "slide_begin"
    branch = bf.trace(orbit, "s", bounds=(-3.0, -0.9), max_steps=120)
    [point] = branch.special_points
    assert point.kind == "crossing_sliding" and branch.audit.ok and point.parameter == pytest.approx(-2.406514503378, abs=1e-11)
    assert 0.5 * point.solution.period == pytest.approx(4.227298881471, abs=1e-9)
    assert abs(point.solution.events[0].after[2]) == pytest.approx(7.617060479486, abs=1e-9)
    branch = bf.trace(orbit, "s", bounds=(-1.0, 0.5))
    assert branch.column("s").max() == pytest.approx(0.0, abs=1e-10) and branch.audit.ok
    assert "no_successor" in branch.stop_reason and branch.column("period").min() == pytest.approx(2.0 * math.pi, abs=1e-6)
    assert bf.simulate(bf.systems.relay_feedback(s=0.0), (0.0, 0.5, -0.2), duration=20.0).modes[-1] == ("slide",)


def test_friction_on_a_belt_at_its_grazing_sliding():
    """F1: free multipliers exp((-z +- i sqrt(1 - z^2)) T); F2: a slide at 0.99 of the belt's speed."""
    def system(V):
        M, load = [[0.0, 1.0], [-1.0, -0.1]], {1: [0.0, 1.0]}
        return bf.PiecewiseSystem("x v", {"-": F(M, [0.0, 0.3], cos=load), "+": F(M, [0.0, -0.3], cos=load)},
                                  [bf.Switch(S([0.0, 1.0], lambda V: -V))], omega=1.6, V=V)
    graze = 1.6 / math.hypot(1.0 - 1.6**2, 0.16)
    assert graze == pytest.approx(1.020288654986, abs=1e-12)
    free = bf.find_orbit(system(graze * (1.0 + 1e-9)))
    np.testing.assert_allclose(sorted(free.multipliers, key=np.imag), -0.583894263574 + 0.578186298369j * np.array([-1.0, 1.0]),
                               atol=1e-11)
    orbit = bf.find_orbit(system(0.99 * graze))
    np.testing.assert_allclose(orbit.sample(5)[1][0], [-0.337921152130, 0.112527262930], atol=1e-11)
    np.testing.assert_allclose([event.time for event in orbit.events], [0.800231643, 0.917182327], atol=1e-9)
    np.testing.assert_allclose(np.sort(orbit.multipliers.real), [-0.676583426638, 0.0], atol=1e-9)


def test_parts_of_chuas_cycle_and_of_a_thermostats():
    orbit = bf.find_orbit(bf.systems.chua_circuit(), (1.0, -0.353564617790, -1.339863032722))
    inner, outer = sorted(np.diff([*(event.time for event in orbit.events), orbit.events[0].time + orbit.period]))
    assert (inner, outer) == (pytest.approx(0.945904002867, abs=1e-10), pytest.approx(1.337496897630, abs=1e-10))
    orbit = bf.find_orbit(bf.systems.thermostat(), (20.0,))
    assert orbit.events[1].time - orbit.events[0].time == pytest.approx(0.5 * orbit.period) and not orbit.multipliers.size


def test_a_driven_neuron_locks_one_spike_to_two_periods():
    """v(T) = 1 from v = 0 in two periods; the multiplier is e^-2 (I + c)/(I + c - 1) with c the load at the spike."""
    neuron = bf.HybridSystem("v", {"rise": F([[-1.0]], lambda I: [I], cos={1: [0.3]})}, [
        bf.Jump("rise", S([1.0], -1.0), to="rise", reset=R([[0.0]]))], omega=2.0 * math.pi, I=1.15)
    orbit = bf.find_orbit(neuron)
    [spike] = orbit.events
    assert orbit.periods == 2 and spike.time % 1.0 == pytest.approx(0.996949957203, abs=1e-11)
    load = 1.15 + 0.3 * math.cos(2.0 * math.pi * spike.time)
    assert orbit.multipliers == pytest.approx([math.exp(-2.0) * load / (load - 1.0)], abs=1e-11) == [pytest.approx(0.436117177517)]


def test_a_ball_on_a_shaken_table_is_a_reset_that_depends_on_time():
    """One impact a period: cos(phase) = g pi (1 - r)/((1 + r) A w^2); its fold and its period doubling have closed forms."""
    w, r = 2.0, 0.8
    table = bf.HybridSystem("x v", {"fly": F([[0.0, 1.0], [0.0, 0.0]], [0.0, -1.0])}, [
        bf.Jump("fly", S([-1.0, 0.0], sin={1: lambda A: A}), to="fly",
                reset=R([[1.0, 0.0], [0.0, -r]], cos={1: lambda A: [0.0, (1.0 + r) * A * w]}))], omega=w, A=0.15)
    fold = math.pi * (1.0 - r) / ((1.0 + r) * w * w)
    phase, rise = math.acos(fold / 0.15), math.pi - math.acos(fold / 0.15) / w  # time since the last impact
    orbit = bf.find_orbit(table, (0.15 * math.sin(phase) + 0.5 * math.pi * rise - 0.5 * rise**2, 0.5 * math.pi - rise))
    [impact] = orbit.events
    assert w * impact.time == pytest.approx(0.949885259506, abs=1e-11)
    assert sum(orbit.multipliers.real) == pytest.approx(0.058850016722, abs=1e-10)
    np.testing.assert_allclose(sorted(orbit.multipliers.imag), [-0.799458672405, 0.799458672405], atol=1e-10)
    branch = bf.trace(orbit, "A", bounds=(0.06, 0.3))
    assert branch.audit.ok and [point.kind for point in branch.special_points] == ["fold", "period_doubling"]
    flip = math.hypot(fold, 2.0 * (1.0 + r * r) / ((1.0 + r)**2 * w * w))
    np.testing.assert_allclose([point.parameter for point in branch.special_points], [fold, flip], rtol=1e-11)
    assert (fold, flip) == (pytest.approx(0.087266462600), pytest.approx(0.267709117062))
    lost = bf.find_orbit(table, (1.0, 0.5))  # Newton's trials lie below the table, too
    assert lost.success or lost.message
    with pytest.raises(ValueError, match=r"y0 = \[-1.0, 0.0\] lies in no mode"):
        bf.simulate(table, (-1.0, 0.0), periods=1)


def test_a_rocking_block_changes_its_edge_in_an_impact():
    """f'' = f - sgn f - B cos(w t), f'+ = 0.9 f'-: a saddle; the product of its multipliers is 0.9^4, two impacts a period."""
    def side(sign):
        return F([[0.0, 1.0], [1.0, 0.0]], [0.0, -sign], cos={1: lambda B: [0.0, -B]})
    again = R(np.diag([1.0, 0.9]))
    block = bf.HybridSystem("f v", {"right": side(1.0), "left": side(-1.0)}, [
        bf.Jump("right", S([-1.0, 0.0]), to="left", reset=again), bf.Jump("left", S([1.0, 0.0]), to="right", reset=again)],
        omega=2.0, B=3.0)
    start = bf.simulate(block, (0.0, 1.751671757477), t0=2.302911466860, duration=math.pi - 2.302911466860).final
    orbit = bf.find_orbit(block, start)
    first, second = orbit.events
    assert second.time == pytest.approx(2.302911466860, abs=1e-9) and second.time - first.time == pytest.approx(0.5 * math.pi)
    assert [-first.after[1], second.after[1]] == pytest.approx([1.751671757477] * 2, abs=1e-10)
    np.testing.assert_allclose(np.sort(orbit.multipliers.real), [0.186443341106, 3.519031551940], atol=1e-9)
    assert np.prod(orbit.multipliers).real == pytest.approx(0.9**4, abs=1e-11)
    np.testing.assert_allclose(after(orbit, 1, 3.088309630257 - 2.302911466860), [0.841656617527, 0.054170322255], atol=1e-9)


def tent(growth, slope):
    """x' = growth x; whenever the clock s comes to 1, x+ = 1 - slope |x|."""
    field = F([[growth, 0.0], [0.0, 0.0]], [0.0, 1.0])
    jumps = [bf.Jump("neg", S([1.0, 0.0]), to="pos"), bf.Jump("pos", S([-1.0, 0.0]), to="neg")]
    jumps += [bf.Jump(mode, S([0.0, 1.0], -1.0), to=("neg", "pos"), reset=R([[-slope * sign, 0.0], [0.0, 0.0]], [1.0, 0.0]))
              for mode, sign in (("neg", -1.0), ("pos", 1.0))]
    return bf.HybridSystem("x s", {"neg": field, "pos": field}, jumps)


@pytest.mark.parametrize(("growth", "slope"), [(-0.2, 2.1), (0.1, 1.7)])
def test_a_tent_has_the_exponent_of_its_slopes(growth, slope):
    found = bf.lyapunov_exponents(tent(growth, slope), (0.3, 0.0), periods=200, transient=20)
    assert abs(found.values[0] - math.log(slope) - growth) <= 3.0 * found.errors[0] <= 0.003


@pytest.mark.parametrize(("mu", "a", "b"), [(0.3, 0.4, -1.5), (0.1, -0.6, -1.3), (-0.3, 0.4, -1.5), (0.3, 0.4, -0.7)])
def test_cycles_of_a_skew_tent_map(mu, a, b):
    """x -> mu + (a or b) x below and above 0: a fixed point, or, for mu > 0 and b < -1, a 2-cycle; its slope is a b."""
    still = F(np.zeros((2, 2)), [0.0, 1.0])
    jumps = [bf.Jump("neg", S([1.0, 0.0]), to="pos"), bf.Jump("pos", S([-1.0, 0.0]), to="neg")]
    jumps += [bf.Jump(mode, S([0.0, 1.0], -1.0), to=("neg", "pos"), reset=R([[factor, 0.0], [0.0, 0.0]], [mu, 0.0]))
              for mode, factor in (("neg", a), ("pos", b))]
    orbit = bf.find_orbit(bf.HybridSystem("x s", {"neg": still, "pos": still}, jumps), (0.1 * mu, 0.0))
    two = mu > 0.0 and b < -1.0
    points = [mu * (1.0 + a) / (1.0 - a * b), mu * (1.0 + b) / (1.0 - a * b)] if two else [mu / (1.0 - (a if mu < 0.0 else b))]
    assert orbit.success and orbit.period == pytest.approx(len(points)) and orbit.stable
    assert sorted(event.after[0] for event in orbit.events) == pytest.approx(sorted(points), abs=1e-13)
    assert orbit.multipliers == pytest.approx([a * b if two else a if mu < 0.0 else b], abs=1e-12)
