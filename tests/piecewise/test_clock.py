"""Events at known times, and ramps: converters, parametric stiffness, pulses and maps against closed forms."""
import math
import pickle

import numpy as np
import pytest

import bifurc as bf

F, S, R = bf.AffineField, bf.AffineSurface, bf.AffineReset


def with_a_time(E=20.0, R_=22.0, L=20e-3, C=47e-6, T=400e-6):
    """The same converter as modes over v, i and the time of the ramp, which is reset at T."""
    A, h, offset = [[-1 / (R_ * C), 1 / C, 0], [-1 / L, 0, 0], [0, 0, 0]], np.array([8.4, 0.0, -4.4 / T]), -8.4 * 11.3 - 3.8
    return bf.HybridSystem("v i time", {"off": F(A, [0, 0, 1]), "on": F(A, [0, E / L, 1])}, [
        bf.Jump("off", S(-h, -offset), to="on"), bf.Jump("on", S(h, offset), to="off"),
        *(bf.Jump(mode, S([0, 0, 1], -T), to=("off", "on"), reset=R(np.diag([1.0, 1.0, 0.0]))) for mode in ("off", "on"))])


def buck(E=20.0, T=400e-6):
    """On where 8.4 (v - 11.3) is below a ramp from 3.8 to 8.2 V."""
    def A(R, L, C):
        return [[-1.0 / (R * C), 1.0 / C], [-1.0 / L, 0.0]]
    ramp = S(lambda a: [a, 0.0], lambda a, Vref, low: -a * Vref - low, ramp=lambda low, high: low - high)
    return bf.PiecewiseSystem("v i", {"on": F(A, lambda E, L: [0.0, E / L]), "off": F(A)},
                              [bf.Switch(ramp, below="on", above="off", sliding=False)], period=lambda T: T, clock={0.0: "decide"},
                              E=E, R=22.0, L=20e-3, C=47e-6, T=T, a=8.4, Vref=11.3, low=3.8, high=8.2)


def test_a_buck_converter_is_a_ramp_and_a_clock():
    """The same as one whose ramp's time is a state with a reset, and as the ready one."""
    system, start = buck(), (11.969511538815, 0.591571935915)
    ready = bf.systems.buck_converter()
    assert ready.states == system.states and bf.find_orbit(ready, start).state == pytest.approx(bf.find_orbit(system, start).state)
    assert system.states == ("v", "i", "clock") and system.parameters["E"] == 20.0
    orbit, own = bf.find_orbit(system, start), bf.find_orbit(with_a_time(), (*start, 0.0))
    assert orbit.success and orbit.period == pytest.approx(400e-6, rel=1e-12)
    cross, tick = orbit.events
    assert (cross.kind, tick.kind) == ("cross", "clock") and cross.after[2] == pytest.approx(0.402350330388, abs=1e-11)
    np.testing.assert_allclose(tick.after, [*start, 0.0], rtol=1e-11, atol=1e-15)
    np.testing.assert_allclose(sorted(orbit.multipliers, key=np.imag), sorted(own.multipliers, key=np.imag), atol=1e-11)
    branch = bf.trace(orbit, "E", bounds=(18.0, 30.0))
    [point] = branch.special_points
    assert point.kind == "period_doubling" and point.parameter == pytest.approx(24.516572829, abs=1e-8) and branch.audit.ok


@pytest.mark.parametrize("depth", [0.4, 0.1, -0.4])
def test_meissners_equation(depth):
    """x'' + (1 +- depth) x, which changes at 0 and pi: the matrix of a period is a product of two."""
    modes = {name: F([[0.0, 1.0], [-1.0 + sign * depth, 0.0]]) for name, sign in (("later", 1.0), ("first", -1.0))}
    system = bf.HybridSystem("x v", modes, [], period=2.0 * math.pi, clock={0.0: "first", 0.5: "later"})
    turns = [np.array([[math.cos(w * math.pi), math.sin(w * math.pi) / w], [-w * math.sin(w * math.pi), math.cos(w * math.pi)]])
             for w in (math.sqrt(1.0 + depth), math.sqrt(1.0 - depth))]
    orbit, multipliers = bf.find_orbit(system, (0.0, 0.0)), np.linalg.eigvals(turns[1] @ turns[0])
    assert orbit.success and orbit.period == pytest.approx(2.0 * math.pi)
    np.testing.assert_allclose(np.sort_complex(orbit.multipliers), np.sort_complex(multipliers), atol=1e-11)
    if abs(depth) == 0.4:
        np.testing.assert_allclose(np.sort(orbit.multipliers.real), [0.805512258674, 1.241446035403], atol=1e-11)
    motion = bf.simulate(system, (1.0, 0.3), duration=4.0 * math.pi)
    np.testing.assert_allclose(motion.final[:2], np.linalg.matrix_power(turns[1] @ turns[0], 2) @ [1.0, 0.3], atol=1e-12)
    assert [event.mode_after[0].split("@")[0] for event in motion.events][:3] == ["later", "first", "later"]


def test_a_duty_ratio_is_a_parameter():
    """x' = u - x with u = 1 up to D T: the largest value is (1 - exp(-D T))/(1 - exp(-T))."""
    system = bf.HybridSystem("x", {"on": F([[-1.0]], [1.0]), "off": F([[-1.0]])}, [], period=lambda T: T,
                             clock={0.0: "on", (lambda D: D): "off"}, D=0.3, T=2.0)
    orbit = bf.find_orbit(system, {"x": 0.2})
    assert orbit.multipliers == pytest.approx([math.exp(-2.0)]) and [event.kind for event in orbit.events] == ["clock", "clock"]
    for name, bounds in (("D", (0.05, 0.95)), ("T", (0.5, 5.0))):
        branch = bf.trace(orbit, name, bounds=bounds)
        D, T = (branch.column(name) if name == key else system.parameters[key] for key in "DT")
        np.testing.assert_allclose(branch.column("max_x"), (1.0 - np.exp(-D * T)) / (1.0 - np.exp(-T)), rtol=1e-12)
        assert branch.audit.ok and not len(branch.special_points)


def test_pulses():
    """x' = -x with 1 more at a quarter of each period: 1/(1 - exp(-T)) behind a pulse; a clock without any tick only runs."""
    system = bf.HybridSystem("x", {"falls": F([[-1.0]])}, [], period=1.5, clock={0.25: R([[1.0]], [1.0])})
    orbit = bf.find_orbit(system, (1.0,))
    pulse = max(orbit.events, key=lambda event: event.after[0])
    assert pulse.after == pytest.approx([1.0 / (1.0 - math.exp(-1.5)), 0.25])
    assert orbit.multipliers == pytest.approx([math.exp(-1.5)])
    plain = bf.HybridSystem("x", {"falls": F([[-1.0]], ramp=[1.0])}, [], period=1.5)
    [tick] = bf.simulate(plain, (0.0,), duration=1.6).events  # x' = t/T - x
    assert tick.before == pytest.approx([(1.5 - 1.0 + math.exp(-1.5)) / 1.5, 1.0]) and tick.kind == "clock"


def test_a_surface_that_jumps_lets_a_slide_go():
    """x' = -sgn(x - c/2) follows c/2, comes back from 1/2 at the slope -1 when c is 0 again, and meets it at c = 1/3."""
    follower = bf.PiecewiseSystem("x", {"-": F([[0.0]], [1.0]), "+": F([[0.0]], [-1.0])}, [bf.Switch(S([1.0], ramp=-0.5))],
                                  period=1.0, clock={0.0: "decide"})
    orbit = bf.find_orbit(follower, (0.0,))
    assert orbit.success and orbit.period == pytest.approx(1.0)
    kinds = {event.kind.value: event.after for event in orbit.events}
    np.testing.assert_allclose(kinds["slide_begin"], [1.0 / 6.0, 1.0 / 3.0], atol=1e-13)
    np.testing.assert_allclose(kinds["clock"], [0.5, 0.0], atol=1e-13)
    np.testing.assert_allclose(np.abs(orbit.multipliers), [0.0], atol=1e-13)


def test_a_tick_moves_one_of_two_surfaces_on_which_a_motion_slides():
    """The follower beside y' = -sgn y, which stays on y = 0."""
    fields = {p + q: F(np.zeros((2, 2)), [1.0 if p == "-" else -1.0, 1.0 if q == "-" else -1.0]) for p in "-+" for q in "-+"}
    both = bf.PiecewiseSystem("y x", fields, [bf.Switch(S([1.0, 0.0])), bf.Switch(S([0.0, 1.0], ramp=-0.5))], period=1.0,
                              clock={0.0: "decide"})
    motion = bf.simulate(both, (0.1, -0.1), duration=2.9)
    modes = [event.mode_after[0] for event in motion.events if event.time > 0.9]
    assert modes == ["0+", "00", "0+", "00"] and motion.final == pytest.approx([0.0, 0.45, 0.9], abs=1e-13)
    assert [event.time % 1.0 for event in motion.events[-3::2]] == pytest.approx([1.0 / 3.0, 1.0 / 3.0])


def test_a_slide_that_no_tick_moves_goes_on():
    still = bf.PiecewiseSystem("x", {"-": F([[0.0]], [1.0]), "+": F([[0.0]], [-1.0])}, [bf.Switch(S([1.0], -0.3))], period=1.0,
                               clock={0.0: "decide", 0.4: "decide"})
    motion = bf.simulate(still, (0.0,), duration=2.2)
    assert motion.success and motion.final == pytest.approx([0.3, 0.2], abs=1e-13)
    assert all(event.mode_after[0].startswith("slide") for event in motion.events)


@pytest.mark.parametrize(("growth", "slope"), [(-0.2, 2.1), (0.1, 1.7)])
def test_a_tent_has_the_exponent_of_its_slopes(growth, slope):
    """x' = growth x, and x+ = 1 - slope |x| after each period."""
    tent = bf.HybridSystem("x", {"neg": F([[growth]]), "pos": F([[growth]])}, [
        bf.Jump("neg", S([1.0]), to="pos"), bf.Jump("pos", S([-1.0]), to="neg")], period=1.0,
        clock={0.0: {"neg": R([[slope]], [1.0]), "pos": R([[-slope]], [1.0])}})
    found = bf.lyapunov_exponents(tent, (0.3,), periods=200, transient=20)
    assert abs(found.values[0] - math.log(slope) - growth) <= 3.0 * found.errors[0] <= 0.003


@pytest.mark.parametrize("p", [0.8, 1.6])
def test_an_event_that_meets_the_clock_is_a_border_collision(p):
    """x' = p - x from each tick until x = 1, then -x: from p = 1 on there is a switch, and the multiplier is -exp(-1)/(p - 1)."""
    modes, limit = {"on": F([[-1.0]], lambda p: [p]), "off": F([[-1.0]])}, S([1.0], lambda top: -top)
    control = bf.HybridSystem("x", modes, [bf.Jump("on", limit, to="off")], period=1.0, clock={0.0: "on"}, p=p, top=1.0)
    orbit = bf.find_orbit(control, (0.2,))
    assert orbit.success and len(orbit.events) == (1 if p < 1.0 else 2)
    branch = bf.trace(orbit, "p", bounds=(0.5, 3.0))
    assert [point.kind for point in branch.special_points] == ["border_collision", "period_doubling"] and branch.audit.ok
    np.testing.assert_allclose([point.parameter for point in branch.special_points], [1.0, 1.0 + math.exp(-1.0)], rtol=1e-11)
    low = branch.column("p") < 1.0
    np.testing.assert_allclose(branch.column("max_x")[low], branch.column("p")[low], rtol=1e-12)  # it rests
    np.testing.assert_allclose(branch.column("max_x")[~low], 1.0, rtol=1e-9)
    curve = bf.trace_curve(branch.special_points[0], ("p", "top"), bounds=((0.5, 3.0), (0.6, 2.0)))
    np.testing.assert_allclose(curve.column("p"), curve.column("top"), rtol=1e-10)
    assert curve.column("top").min() == 0.6 and curve.column("top").max() == 2.0


def test_files_and_copies():
    system = buck(E=21.0)
    pulses = bf.HybridSystem("x", {"falls": F([[-1.0]])}, [], period=1.5, clock={0.25: R([[1.0]], [1.0])})
    assert bf.simulate(pickle.loads(pickle.dumps(pulses)), (1.0,), duration=1.5).success
    assert system.with_parameters(E=22.0).parameters["E"] == 22.0 and system.with_parameters(E=21.0) == system


@pytest.mark.parametrize(("more", "words"), [
    ({"clock": {0.0: "decide"}}, "period = None"), ({"period": 0.0}, "period = 0"), ({"period": -1.0}, "period = -1"),
    ({"period": float("nan")}, "period = nan"), ({"period": "a"}, "period = 'a'"), ({"period": lambda k: k}, "parameter 'k'"),
    ({"period": 1.0, "omega": 2.0}, "omega = 2"), ({"period": 1.0, "clock": [0.0]}, r"clock = \[0.0\]"),
    ({"period": 1.0, "clock": {1.0: "decide"}}, "clock = 1.0"), ({"period": 1.0, "clock": {-0.1: "decide"}}, "clock = -0.1"),
    ({"period": 1.0, "clock": {"a": "decide"}}, "clock = 'a'"), ({"period": 1.0, "clock": {0.0: "b"}}, "clock = 'b'"),
    ({"period": 1.0, "clock": {0.0: 3}}, "clock = 3"), ({"period": 1.0, "clock": {0.0: {"b": "a"}}}, "mode 'b'"),
    ({"period": 1.0, "clock": {0.0: "a", (lambda: 0.0): "a"}}, r"differ"),
    ({"period": 1.0, "clock": {0.0: R([[1.0, 0.0]])}}, r"shape \(1, 1\)")])
def test_what_is_no_clock_is_refused(more, words):
    with pytest.raises(ValueError, match=words):
        bf.HybridSystem("x", {"a": F([[-1.0]])}, [], **more)


def test_what_has_a_clock_never_rests():
    for guess in (None, (12.0, 0.6), (12.0, 0.6, 0.5), {"v": 12.0}):
        rest = bf.find_equilibrium(buck(), guess)
        assert rest.status == "not_found" and "does the field vanish" in rest.message
    assert bf.piecewise.equilibria(buck()) == () and bf.find_orbit(buck()).period == pytest.approx(400e-6)
    with pytest.raises(ValueError, match="guess"):
        bf.find_equilibrium(buck(), (1.0,))


def test_what_has_no_clock_has_no_ramp_and_its_state_has_a_name_of_its_own():
    with pytest.raises(ValueError, match="ramp = .* without a clock"):
        bf.HybridSystem("x", {"a": F([[-1.0]], ramp=[1.0])}, [])
    with pytest.raises(ValueError, match="'clock' has the name"):
        bf.HybridSystem("clock", {"a": F([[-1.0]])}, [], period=1.0)
    with pytest.raises(ValueError, match="y0"):
        bf.simulate(buck(), (1.0, 2.0, 3.0, 4.0), duration=1.0)


@pytest.mark.slow
def test_basins_on_a_section_of_the_clock():
    """The converter's orbit is the only one, and attracts: voltages and currents at the beginning of a ramp."""
    system = buck()
    orbit = bf.find_orbit(system, (12.0, 0.6))
    basins = bf.basins_of_attraction(system, bf.Grid(v=(11.0, 13.0, 2), i=(0.4, 0.8, 2)), section=bf.Section("clock", 0.5), seed=1)
    [found] = basins.attractors
    assert basins.counts[0] == 4 and found.period == pytest.approx(orbit.period)
    [switch] = [event.after for event in orbit.events if event.kind == "cross"]
    at = bf.simulate(system, switch, duration=(0.5 - switch[2]) * orbit.period, mode=("on",)).final
    np.testing.assert_allclose(basins.points(0)[0], at, rtol=1e-8)
