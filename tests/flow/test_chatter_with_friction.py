"""Complete chattering of a mass that rubs: friction turns round in every impact and at the top of every flight."""
import mpmath as mp
import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.compose.writer import kernels
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, HarmonicForce, RigidStop


def flights(r, v, push, away, loss, rate):
    """Return the duration of a complete chattering, by flights, 40 digits: w' = a + rate t - loss w, speed w to the stop."""
    with mp.workdps(40):
        r, v, push, away, loss, rate = (mp.mpf(value) for value in (r, v, push, away, loss, rate))

        def motion(a, t, w, tau):
            """Speed and way of w' = a + rate (t + tau) - loss w from w at t, series in the small loss tau."""
            b = a + rate * t
            terms, speed, way = [w], w, w * tau
            for k in range(1, 14):
                source = b if k == 1 else rate if k == 2 else mp.mpf(0)
                terms.append((source - loss * terms[-1]) / k)
                speed += terms[-1] * tau**k
                way += terms[-1] * tau**(k + 1) / (k + 1)
            return speed, way

        t, u = mp.mpf(0), r * v
        while u > v * mp.mpf("1e-25"):
            first = mp.findroot(lambda s, u=u, t=t: motion(away, t, -u, s)[0], u / away)
            height = -motion(away, t, -u, first)[1]
            guess = mp.sqrt(2 * height / push)
            second = mp.findroot(lambda s, t=t + first, h=height: motion(push, t, mp.mpf(0), s)[1] - h, guess)
            u = r * motion(push, t + first, mp.mpf(0), second)[0]
            t += first + second
        return t


def closed(scene, mode, guard, state, v):
    """Return excess and duration of what follows an impact, and the state that it leaves."""
    out = np.empty(state.size)
    return *kernels(scene, "bifurc.flow.chatter").closure(scene.tables, mode, guard, state, v, out), out


@pytest.mark.parametrize(("r", "push", "away"), [(0.5, 1.0, 1.0), (0.3, 0.7, 1.3), (0.8, 0.2, 1.9),
                                               pytest.param(0.9, 1.7, 2.0, marks=pytest.mark.slow)])  # many flights
@pytest.mark.parametrize(("loss", "rate"), [(0.3, 0.0), (0.0, -0.4), (0.2, 0.7)])
def test_duration_is_right_to_second_order(r, push, away, loss, rate):
    """A mass on a wall, pushed by P + Q sin t, that rubs with mu: what is left falls with the cube of the speed."""
    P, mu = 0.5 * (push + away), 0.5 * (away - push)
    forces = [ConstantForce(P), HarmonicForce(rate, phase=-np.pi / 2), RigidStop(0.0, r), *([Coulomb(mu)] if mu else [])]
    scene = scene_of(bf.System(1.0, loss, 0.0, forces, omega=1.0))
    mode = scene.index(("always", "always", "free", *(["slip+"] if mu else [])))
    hit = next(g for g in range(scene.tables.n_guards[mode]) if scene.guard(mode, g).element == 2)
    bf.simulate(scene.system, (-0.1, 0.5), periods=1)  # builds the modes that follow
    missed = []
    for v in (1e-3, 1e-4):
        state = np.concatenate([[0.0, v], scene.forcing(np.array([0.0]))[0]])
        _, duration, out = closed(scene, mode, hit, state, v)
        exact = flights(r, v, push, away, loss, rate)
        assert abs(float(duration - exact)) < 1e-2 * v * float(exact)
        assert out == pytest.approx(np.concatenate([[0.0, 0.0], state[2:]]), abs=1e-16)
        missed.append(abs(float(duration - exact)))
    assert missed[1] <= 1.3e-3 * missed[0] + 1e-19


@pytest.mark.parametrize("r", [0.2, 0.5, 0.9])
def test_a_mass_that_rubs_comes_to_rest_on_a_wall(r):
    """Pushed by P: flights begin under P + mu and end under P - mu; the speeds fall by r sqrt((P - mu)/(P + mu))."""
    P, mu, v = 0.8, 0.3, 0.4
    system = bf.System(1.0, 0.0, 0.0, [ConstantForce(P), RigidStop(gap=1.0, restitution=r), Coulomb(mu)])
    motion = bf.simulate(system, (1.0 - v**2 / (2 * (P - mu)), 0.0), duration=30.0)
    chatter = [event for event in motion.events if event.kind == "chatter"]
    rho = r * np.sqrt((P - mu) / (P + mu))
    end = v / (P - mu) + r * v / (1 - rho) * (1 / (P + mu) + 1 / np.sqrt((P - mu) * (P + mu)))
    assert len(chatter) == 1
    assert chatter[0].end == pytest.approx(end, abs=1e-10)
    np.testing.assert_allclose(motion.final, [1.0, 0.0], rtol=0, atol=1e-14)


def test_where_friction_holds_against_the_push_there_is_no_sequence():
    """P < mu: after the impact the mass stops at the top of its flight and stays there."""
    P, mu, v, r = 0.3, 0.5, 0.4, 0.6
    system = bf.System(1.0, 0.0, 0.0, [ConstantForce(P), RigidStop(gap=1.0, restitution=r), Coulomb(mu)])
    motion = bf.simulate(system, (0.9, v), duration=30.0)
    assert [str(event.kind) for event in motion.events] == ["impact", "stick"]
    arriving = v**2 - 2 * (mu - P) * 0.1
    np.testing.assert_allclose(motion.final, [1.0 - r**2 * arriving / (2 * (P + mu)), 0.0], rtol=0, atol=1e-14)


def test_flights_in_the_rounding_of_the_position_are_not_listed():
    """The push falls to the limit of friction: the nearer, the more slowly the flights come back, until none is seen."""
    system = bf.System(1.0, 0.0288, 1.0, [HarmonicForce(1.0), RigidStop(0.161, 0.4281), Coulomb(0.0283)], omega=0.651)
    motion = bf.simulate(system, (-0.5, 0.0), periods=30)
    speeds = [event.speed for event in motion.events if event.kind == "impact"]
    assert len(speeds) > 100 and min(speeds) > 8e-9  # (r v)^2 / 2 away = 4 roundings of .3


COUPLED = {"M": np.array([[1.0, 0.25, 0.1], [0.25, 1.44, 0.0], [0.1, 0.0, 0.8]]),
           "C": np.array([[0.11, -0.019, 0.0], [-0.019, 0.11, -0.03], [0.0, -0.03, 0.07]]),
           "K": np.array([[1.38, -0.38, 0.0], [-0.38, 1.38, -0.4], [0.0, -0.4, 0.9]])}
LOAD, OMEGA, GAP = np.array([1.6, 0.2, -0.3]), 0.7, 0.12


class Exact:
    """Motions of three masses in 40 digits, by Taylor series: mass 0 hits a stop, mass 1 rubs."""

    def __init__(self, mu):
        self.mu = mu
        self.M, self.C, self.K, self.load = (mp.matrix(a.tolist()) for a in (*COUPLED.values(), LOAD))

    def accelerations(self, held):
        """Accelerations per force (3, 3) where some coordinates are held."""
        free, out = [i for i in range(3) if i not in held], mp.zeros(3)
        inner = mp.matrix([[self.M[i, j] for j in free] for i in free])**-1
        for a, i in enumerate(free):
            for b, j in enumerate(free):
                out[i, j] = inner[a, b]
        return out

    def series(self, held, friction, t, q, v):
        """Taylor coefficients of the coordinates."""
        W, terms = self.accelerations(held), [q, v]
        for k in range(16):
            force = self.load * (OMEGA**k * mp.cos(OMEGA * t + k * mp.pi / 2) / mp.factorial(k))
            force -= self.C * ((k + 1) * terms[k + 1]) + self.K * terms[k]
            if k == 0:
                force[1] -= friction
            terms.append(W * force / ((k + 1) * (k + 2)))
        return terms

    @staticmethod
    def at(terms, s):
        """Coordinates and velocities after the time ``s``."""
        q, v = mp.zeros(3, 1), mp.zeros(3, 1)
        for k in range(len(terms) - 1, -1, -1):
            q, v = q * s + terms[k], v * s + q
        return q, v

    def end(self, r, t, q, v):
        """Follow the impacts from the one that arrives at t with q, v to their end; return time, coordinates, velocities."""
        unit, arriving = self.M**-1 * mp.matrix([1, 0, 0]), v[0]
        while v[0] > arriving * mp.mpf("1e-24"):
            v = v - unit * ((1 + r) * v[0] / unit[0])
            terms = self.series([], mp.sign(v[1]) * self.mu, t, q, v)
            s = mp.findroot(lambda s, a=terms: self.at(a, s)[1][1], -v[1] / (2 * terms[2][1]))
            t, (q, v) = t + s, self.at(terms, s)
            v[1] = mp.mpf(0)
            terms = self.series([1], 0, t, q, v)
            push, rise = 2 * terms[2][0], GAP - q[0]
            guess = (-v[0] + mp.sqrt(v[0]**2 + 2 * push * rise)) / push
            s = mp.findroot(lambda s, a=terms: self.at(a, s)[0][0] - GAP, guess)
            t, (q, v) = t + s, self.at(terms, s)
        return t, q, v


@pytest.mark.parametrize(("r", "mu", "phase", "law"), [
    (0.3, 2.5, 0.0, False), pytest.param(0.6, 0.8, -0.4, False, marks=pytest.mark.slow),
    pytest.param(0.7, 0.8, 0.3, False, marks=pytest.mark.slow), (0.6, 0.8, -0.4, True)])
def test_a_held_mass_slips_in_every_impact(r, mu, phase, law):
    """Time and state at the end, of the third order in the speed: the full mass matrix passes every impulse on to a mass that
    friction holds; it slips some way, and sticks again before the next.  A ``law`` is a spring too weak to be felt."""
    system = bf.System(*COUPLED.values(), [HarmonicForce(1.6), HarmonicForce(0.2, dof=1), HarmonicForce(-0.3, dof=2),
                                           RigidStop(GAP, r), Coulomb(mu, dof=1),
                                           *([CubicSpring(1e-14)] if law else [])], omega=OMEGA)
    scene = scene_of(system)
    mode, *_ = (scene.index(("always",) * 3 + keys + ("always",) * law) for keys in (
        ("free", "stick"), ("free", "slip+"), ("free", "slip-"), ("rest", "stick")))
    T = scene.tables
    hit = next(g for g in range(T.n_guards[mode]) if scene.guard(mode, g).element == 3)
    exact, missed, jump = Exact(mu), [], kernels(scene, "bifurc.flow.rule").jump
    for v in (1e-3, 1e-4):
        state = np.concatenate([[GAP, -0.05, 0.2, v, 0.0, -0.1], scene.forcing(np.array([phase / OMEGA]))[0]])
        _, duration, out = closed(scene, mode, hit, state, v)
        xp, P = np.empty(state.size), np.empty((6, state.size))
        jump(T, mode, hit, True, state, xp, P)
        np.testing.assert_allclose(xp, out, rtol=0, atol=1e-15)
        with mp.workdps(40):
            t = mp.mpf(phase) / OMEGA
            q, w = mp.matrix(state[:3].tolist()), mp.matrix(state[3:6].tolist())
            end, at, moves = exact.end(mp.mpf(r), t, q, w)
            rests = exact.at(exact.series([0, 1], 0, t, mp.matrix(out[:3].tolist()), mp.matrix(out[3:6].tolist())), end - t)
            missed.append([abs(float(end - t - mp.mpf(duration))), *(abs(float(b - a)) for a, b in zip(rests[0], at, strict=True)),
                           *(abs(float(b - a)) for a, b in zip(rests[1], moves, strict=True))])
    assert np.all(np.array(missed[1]) <= 1.3e-3 * np.array(missed[0]) + 1e-17)
    step = 1e-6  # the derivative of what is left, along all states that arrive
    for c in (0, 2, 3, 5):
        sides = [np.empty(state.size), np.empty(state.size)]
        for side, sign in zip(sides, (1.0, -1.0), strict=True):
            jump(T, mode, hit, True, state + sign * step * np.eye(state.size)[c], side, np.empty((6, state.size)))
        np.testing.assert_allclose((sides[0] - sides[1])[:6] / (2.0 * step), P[:, c], rtol=0, atol=1e-6)


@pytest.mark.parametrize("coupling", [0.2, 0.5, 0.9])
@pytest.mark.parametrize("static", [1.0, 1.4])
@pytest.mark.parametrize("turned", [False, True])
def test_a_chatter_that_drives_a_mass_held_by_friction_into_its_stop(coupling, static, turned):
    """Each impact is two: the other mass hits its plastic stop at once, and gives back b/a of its speed.  With M = [[a, b], [b, c]]
    speeds fall by r - (1 + r) b^2/(a c), between impacts the other mass is held: t0 (1 + 2 rho/(1 - rho)) to the end."""
    a, c, r, h, g = 2.0, 3.0, 0.6, 0.3, 1.5
    ratio = r - (1.0 + r) * coupling**2 / (a * c)
    stops = [RigidStop(0.0, r, side=-1, dof=0), RigidStop(0.0, 0.0, side=-1, dof=1)]
    stops = stops[::-1] if turned else stops
    system = bf.System([[a, coupling], [coupling, c]], np.zeros((2, 2)), np.zeros((2, 2)),
                       [ConstantForce(-g * a, dof=0), *stops, Coulomb(4.0, static_ratio=static, dof=1)])
    fall = np.sqrt(2.0 * h / g)
    end = fall * (1.0 + 2.0 * ratio / (1.0 - ratio))
    motion = bf.simulate(system, (h, 0.0, 0.0, 0.0), duration=1.5 * end)
    assert motion.success, motion.message
    first, second = (system.labels.index(label) for label in ("rigid_stop", "rigid_stop_2"))
    name = system.labels[second if turned else first]
    times = [event.time for event in motion.events if event.element == name][:6]
    exact = fall + 2.0 * fall * np.cumsum([0.0, *(ratio**k for k in range(1, 6))])
    np.testing.assert_allclose(times, exact, rtol=1e-10)
    assert motion.final.tolist() == [0.0, 0.0, 0.0, 0.0] and np.abs(motion(np.array([1.001 * end]))).max() < 1e-9
    assert not motion(np.array([0.5 * (exact[0] + exact[1])]))[0][[1, 3]].any()
