"""Steps put together by the engine of laws, on steps of a linear motion that are as long as one likes; rates against mechanics."""
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.compose.writer import kernels
from bifurc.elements import ConstantForce, CubicSpring, ElasticStator, Force, HarmonicForce, Jenkins, RigidStator, RigidStop
from bifurc.flow.laws import calls, engine
from tests.reference.plain import plain

A = np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [-2.0, 0.5, -0.3, 0.1], [0.7, -1.0, 0.0, -0.2]])
START = np.array([0.3, -0.2, 0.5, 0.1, 1.0, 1.0, 0.0])


class Steps:
    """Exact steps of y' = A y: each as long as ``longest`` lets it be, with the ``wish`` for the next one."""

    def __init__(self, longest=lambda n: np.inf, wish=lambda n: np.inf, lost=None):
        self.longest, self.wish, self.lost, self.tried, self.taken = longest, wish, lost, [], []

    def __call__(self, T, m, x, h, aim, x1, acc, force, X, edges, accs, scratch):
        n = len(self.tried)
        self.tried.append(h)
        h = np.sign(h) * min(abs(h), self.longest(n))
        self.taken.append(h)
        assert m == 2 and not edges and x is not x1
        flow = expm(h * A)
        x1[:4], x1[4:] = flow @ x[:4], x[4:]
        if len(X):
            X[:] = X @ flow.T
        if n == self.lost:
            x1[0] = np.nan
        scratch[calls.WISH] = self.wish(n)
        return h


def tables(step=0.3, omega=1.0, harmonics=(1, 3)):
    return SimpleNamespace(LP=np.zeros((3, 0, 2)), LU=np.zeros((0, 7)), A=np.zeros((3, 4, 7)), stages=np.zeros(5, np.int64),
                           harmonics=np.array(harmonics), flat=np.array([omega]), step=np.full(3, step))


def integrated(s, T, steps):
    """Follow the engine's `arc`; return the lengths of the steps, having checked where they lead."""
    x, y, Phi = START.copy(), np.empty(4), np.empty((4, 4))
    plain(engine.arc, step=steps)(T, 2, x, s, y, Phi)
    assert np.array_equal(x, START)
    assert sum(steps.taken) == pytest.approx(s, rel=1e-14)
    assert all(np.sign(h) == np.sign(s) for h in steps.tried)
    np.testing.assert_allclose(Phi, expm(s * A), atol=1e-12)
    np.testing.assert_allclose(y, expm(s * A) @ START[:4], atol=1e-12)
    return np.array(steps.taken)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_steps_cover_the_time_and_are_as_long_as_is_wished(way):
    """As few as allow for the mode's step, the forcing's Taylor series (.4 here) and the wish, all equal until the wish changes."""
    top = plain(calls.longest)(np.array([1, 3]), 1.0)
    assert top == pytest.approx(0.4) and plain(calls.longest)(np.array([1, 3]), 2.0) == pytest.approx(0.2)
    assert plain(calls.longest)(np.array([2]), 0.0) == plain(calls.longest)(np.zeros(0, int), 1.0) == np.inf
    even = integrated(way * 1.0, tables(), Steps(wish=lambda n: 0.25))
    assert even == pytest.approx(np.full(4, way * 0.25))
    known = integrated(way * 1.0, tables(0.5), Steps(wish=lambda n: 0.4))  # the forcing is a series on shorter steps
    assert known == pytest.approx(np.full(3, way / 3.0))
    free = integrated(way * 10.0, tables(0.1), Steps())
    assert free == pytest.approx(way * np.array([0.1, *np.full(25, 9.9 / 25)]))
    careful = integrated(way * 1.0, tables(), Steps(wish=lambda n: 0.1))
    assert careful == pytest.approx(way * np.array([0.25, *np.full(8, 0.75 / 8)]))
    nearly = integrated(way * 1.0, tables(), Steps(wish=lambda n: 0.21 if n else 0.39))  # neither is worth a change
    assert nearly == pytest.approx(np.full(4, way * 0.25))
    unforced = integrated(way * 3.0, tables(0.1, omega=0.0), Steps(wish=lambda n: 100.0))
    assert unforced == pytest.approx(way * np.array([0.1, 2.9]))


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_what_a_shorter_step_leaves_is_made_up_for(way):
    cut = integrated(way * 1.0, tables(), Steps(longest=lambda n: 0.21, wish=lambda n: 0.21))
    assert cut == pytest.approx(way * np.array([0.21, *np.full(4, 0.1975)]))
    once = integrated(way * 1.0, tables(), Steps(longest=lambda n: 0.05 if n == 1 else np.inf,
                                                wish=lambda n: 0.2 if n == 1 else 0.25))
    assert once == pytest.approx(way * np.array([0.25, 0.05, *np.full(4, 0.175)]))
    last = integrated(way * 1.0, tables(), Steps(longest=lambda n: 0.1 if n == 3 else np.inf, wish=lambda n: 0.25))
    assert last == pytest.approx(way * np.array([0.25, 0.25, 0.25, 0.1, 0.15]))


def test_no_time_and_a_lost_state():
    steps, x1 = Steps(lost=2), np.empty(7)
    plain(engine.propagate, step=steps)(tables(), 2, START, 0.0, x1)
    assert np.array_equal(x1, START) and not steps.tried
    plain(engine.propagate, step=steps)(tables(), 2, START, 5.0, x1)
    assert len(steps.tried) == 3 and np.isnan(x1[0])
    y = np.empty(4)
    plain(engine.advance, step=Steps())(tables(), 2, START, 0.7, y)
    np.testing.assert_allclose(y, expm(0.7 * A) @ START[:4], atol=1e-13)


def coupled(u0, u1, s0, s1, a):
    return -a * u0 * u1 - 0.7 * s1 * s1, -0.3 * s0 * u1 - a * u1 * u1


M, C, K = np.array([[1.0, 0.3], [0.3, 0.8]]), np.array([[0.1, -0.5], [0.6, 0.05]]), np.array([[2.0, -0.4], [-0.4, 1.0]])


def test_rates_are_those_of_the_forces_written_out(rng):
    """A law of two rows coupled through coordinates and speeds, one between the masses; forcing and a slider's memory."""
    row = (0.7, -1.2)
    system = bf.System(M, C, K, [HarmonicForce(0.5), Force(coupled, site=np.eye(2), a=0.9),
                                 CubicSpring(0.6, row=row), Jenkins(2.0, 0.4, dof=1)], omega=1.3)
    scene = scene_of(system)
    T, laws = scene.tables, scene.laws
    first = np.cumsum([0, *(law.law.rows if hasattr(law.law, "rows") else law.rows for law in laws)])

    def values(T, what, m, local):
        assert what == calls.FORCE
        u, s = local[0, :, 0], local[1, :, 0]
        for i, law in enumerate(laws):
            own = range(first[i], first[i + 1])
            source = [int(T.owners[calls.SOURCE, r]) for r in own]
            found = law.law.function(*u[source], *s[source], *law.law.values)
            for r, force in zip(own, np.atleast_1d(found), strict=True):
                local[2, r, 0] = force

    rate, local = plain(calls.rate, values=values), np.full((4, T.LU.shape[0], 1), np.nan)
    for _ in range(4):
        q, v, z, t = rng.normal(size=2), rng.normal(size=2), rng.normal(), rng.uniform(0.0, 5.0)
        x, f = np.concatenate([q, v, [z], scene.forcing(np.array([t]))[0]]), np.full(5, np.nan)
        u = np.array(row) @ q
        for m, keys in enumerate(scene.keys):
            rate(T, m, x, f, local)
            friction = {"stick": -2.0 * (q[1] - z), "slip+": -0.4, "slip-": 0.4}[keys[-1]]
            force = -C @ v - K @ q + [0.5 * np.cos(1.3 * t), friction] + coupled(*q, *v, 0.9) - 0.6 * u**3 * np.array(row)
            assert f[:2] == pytest.approx(v, abs=0.0) and f[2:4] == pytest.approx(np.linalg.solve(M, force), abs=1e-12)
            assert f[4] == 0.0


def test_what_forces_push_is_added(rng):
    LP, local, f = rng.normal(size=(2, 4, 3)), rng.normal(size=(4, 4, 1)), rng.normal(size=6)
    given = f.copy()
    plain(calls.push)(LP, 1, 1, 3, local, f)
    assert np.array_equal(f[:3], given[:3])
    assert f[3:] == pytest.approx(given[3:] + LP[1, 1] * local[2, 1, 0] + LP[1, 2] * local[2, 2, 0], abs=1e-14)


RUBBING = (
    [HarmonicForce(0.7), CubicSpring(0.8), RigidStator(restitution=0.7, friction=0.2, radius=0.6, surface_speed=0.3)],
    [HarmonicForce(0.7), CubicSpring(-0.5, dof=1),
     RigidStator(restitution=0.4, friction=0.5, radius=0.6, centre_x=0.1, frame_spin=0.2)],
    [HarmonicForce(0.7), ElasticStator(stiffness=9.0, damping=0.2, friction=0.3, radius=0.6)],
)


@pytest.mark.parametrize("elements", RUBBING)
def test_guards_that_feel_laws_and_their_gradients(elements, rng):
    """Depths, speeds, and reactions of a wall, in every mode: gradients by the state against differences of the values."""
    scene = scene_of(bf.System(np.diag([1.3, 1.3]), [[0.2, -0.1], [0.1, 0.3]], [[2.0, -0.5], [-0.5, 1.0]], elements, omega=1.1))
    T, start = scene.tables, scene.system.elements[-1].start
    seen, row = 0, np.empty(T.A.shape[2])
    for mode in [scene.index((*["always"] * (len(elements) - 1), key)) for key in start]:
        T, engine_ = scene.tables, kernels(scene)
        for g in range(int(T.n_guards[mode])):
            for _ in range(3):
                y = rng.normal(size=4)
                y[:2] *= 0.7 / np.linalg.norm(y[:2])
                x = np.concatenate([y, [1.0, 0.6, 0.8]])
                engine_.guard_gradient(T, mode, g, x, row)
                for c in range(4):
                    h = 1e-5 * np.eye(x.size)[c]
                    at = [engine_.guard_value(T, mode, g, x + k * h) for k in (-2, -1, 1, 2)]
                    slope = (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / 12e-5
                    assert row[c] == pytest.approx(slope, rel=1e-6, abs=1e-7)
            seen += bool(T.LG[mode, g].any())
    assert seen >= 3


@pytest.mark.parametrize("noise", [1e-13, -1e-13])
def test_a_touch_at_the_start_is_no_maximum_beyond_it(noise):
    """A mass on its stop without speed, to rounding, that a force pulls away, and a spring that is no line."""
    scene = scene_of(bf.System(1.0, 0.0, 1.0, [ConstantForce(-1.0), CubicSpring(0.5), RigidStop(0.3, 0.8)]))
    T, own = scene.tables, kernels(scene, "bifurc.flow.affine.peak")
    mode = next(m for m in range(len(scene.keys)) if T.n_holds[m] == 0)
    guard = next(g for g in range(int(T.n_guards[mode])) if T.kick[mode, g])
    start = np.zeros(T.A.shape[2])
    start[:3] = 0.3 + noise, noise, 1.0
    assert own.segment_peak(T, mode, guard, start, 0.5, 1, 2)[0] == -np.inf
    if noise > 0.0:
        value, at = own.segment_peak(T, mode, guard, start, 0.5, 1, 0)
        assert 0.0 < at < 1e-12 and value == pytest.approx(noise, rel=1e-2)
