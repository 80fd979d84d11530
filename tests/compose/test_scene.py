"""Scenes: tables against closed forms and plain numpy, modes reached lazily, symmetry, numbers of other parameters."""
import itertools
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc import elements as el
from bifurc import systems
from bifurc.compose import scene_of, writer
from bifurc.compose.modal import give_modal
from bifurc.compose.numbers import DependentHolds
from bifurc.compose.scene import Scene, given
from bifurc.compose.tables import PARTS
from bifurc.elements.local import lam, s, u
from bifurc.system import System
from tests.reference.written_elements import Slider

M = np.array([[2.0, 0.3, 0.1], [0.3, 1.0, -0.2], [0.1, -0.2, 1.5]])
C = np.array([[0.2, -0.1, 0.0], [0.05, 0.3, 0.1], [0.0, -0.1, 0.4]])
K = np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -0.5], [0.0, -0.5, 1.0]])


def forcing(scene, t):
    """Return w(t)."""
    waves = [f(k * scene.omega * t) for k in scene.harmonics for f in (np.cos, np.sin)]
    return np.array([1.0, *waves])


def test_tables_of_the_impact_oscillator_are_the_textbook_s():
    z, w, F, d, r = 0.05, 1.5, 0.9, 1.2, 0.7
    scene = scene_of(systems.impact_oscillator(zeta=z, omega=w, amplitude=F, gap=d, restitution=r))
    T = scene.tables  # x = (q, v, 1, cos, sin)
    assert scene.keys == [("always", "free"), ("always", "rest")]
    assert (scene.n, scene.ns, scene.nw, scene.harmonics, scene.omega) == (1, 2, 3, (1,), w)
    assert scene.closed_form and scene.laws == () and scene.period == 2 * np.pi / w
    assert T.flat[0] == w
    assert np.array_equal(T.A, [[[0, 1, 0, 0, 0], [-1, -2 * z, 0, F, 0]], [[0, 1, 0, 0, 0], [0, 0, 0, 0, 0]]])
    assert np.array_equal(T.G, [[[1, 0, -d, 0, 0]], [[1, 2 * z, 0, -F, 0]]])
    assert T.R[0, 0] == pytest.approx(np.array([[0, 0, d, 0, 0], [0, -r, 0, 0, 0]]), abs=1.2e-16)
    assert np.array_equal(T.R[1, 0], [[1, 0, 0, 0, 0], [0, 1, 0, 0, 0]])
    assert np.array_equal(T.B, [[[0, 1]], [[0, 0]]]) and np.array_equal(T.D, [[[1, 0]], [[0, 0]]])
    assert np.array_equal(T.H[1, 0], [0, 1, 0, 0, 0]) and np.array_equal(T.S[1, 0], [1, 0, -d, 0, 0])
    assert np.array_equal(T.ratio, [[r], [0]]) and np.array_equal(T.kick, [[1], [0]])
    assert np.array_equal(T.then, [[[1, 0]], [[0, 1]]]) and np.array_equal(T.ends_in, [[1], [-1]])
    assert np.array_equal(T.n_guards, [1, 1]) and np.array_equal(T.n_holds, [0, 1])
    assert np.array_equal(T.element, [[1], [1]])
    assert [scene.event_kind(m, 0) for m in (0, 1)] == [el.EventKind.IMPACT, el.EventKind.RELEASE]
    assert T.kind.ravel().tolist() == [list(el.EventKind).index("impact"), list(el.EventKind).index("release")]
    assert scene.element_name(0, 0) == "rigid_stop" and scene.hold_element(1, 0) == 1


def test_a_plastic_stop_leaves_no_speed_at_all():
    for mass in (1.0, 3.0, 0.7):
        T = scene_of(System(mass, 0.1, 1.0, [el.RigidStop(0.5, 0.0)])).tables
        assert np.array_equal(T.R[0, 0], [[0, 0, 0.5], [0, 0, 0]])


def test_saltation_matrix_of_the_rigid_stop():
    """S = R_y + (f+ - R_y f-) grad h / (grad h . f-) = [[-r, 0], [(1+r)(f(t0) - gap)/v, -r]] (specs, section 1)."""
    z, w, F, d, r, t, v = 0.05, 1.5, 0.9, 1.0, 0.7, 0.4, 0.8
    scene = scene_of(systems.impact_oscillator(zeta=z, omega=w, amplitude=F, gap=d, restitution=r))
    T, ns = scene.tables, scene.ns
    before = np.concatenate([[d, v], forcing(scene, t)])
    after = np.concatenate([T.R[0, 0] @ before, before[ns:]])
    Ry, h, minus, plus = T.R[0, 0][:, :ns], T.G[0, 0], T.A[0] @ before, T.A[0] @ after
    S = Ry + np.outer(plus - Ry @ minus, h[:ns]) / (h[:ns] @ minus)
    wanted = [[-r, 0.0], [(1 + r) * (F * np.cos(w * t) - d) / v, -r]]
    assert S == pytest.approx(np.array(wanted), rel=1e-14, abs=1e-14)


def test_an_impulse_meets_the_inertia_of_the_row():
    """v+ = v - (1 + r) b n.v with b = M^-1 n / (n M^-1 n), any mass matrix and row; kinetic energy falls by 1 - r^2."""
    n, r = np.array([1.0, -0.5, 2.0]), 0.6
    T = scene_of(System(M, C, K, [el.RigidStop(0.2, r, row=n)])).tables
    b = np.linalg.solve(M, n) / (n @ np.linalg.solve(M, n))
    assert T.R[0, 0][3:, 3:6] == pytest.approx(np.eye(3) - (1 + r) * np.outer(b, n), rel=1e-14, abs=1e-14)
    assert T.R[0, 0][:3, :3] == pytest.approx(np.eye(3) - np.outer(b, n), rel=1e-14, abs=1e-14)
    assert T.R[0, 0][:3, 6] == pytest.approx(0.2 * b, rel=1e-14)
    assert T.B[0, 0, 3:] == pytest.approx(b, rel=1e-14) and T.D[0, 0, :3] == pytest.approx(b, rel=1e-14)
    v = np.array([1.0, 2.0, 3.0])
    w = T.R[0, 0][3:, 3:6] @ v
    lost = 0.5 * v @ M @ v - 0.5 * w @ M @ w
    assert lost == pytest.approx(0.5 * (1 - r**2) * (n @ v) ** 2 / (n @ np.linalg.solve(M, n)), rel=1e-13)


@pytest.mark.parametrize("held", [(0,), (1,), (0, 1)])
def test_held_rows_are_eliminated_as_the_saddle_point_system_says(held, rng):
    """[M -n^T; n 0] (a, lam) = (f, -base''), solved by numpy, for one and two stops on rows of a coupled system."""
    rows = np.array([[1.0, -0.5, 0.0], [0.0, 0.4, 1.0]])
    stops = [el.RigidStop(0.2, 0.5, row=rows[0]),
             el.RigidStop(0.1, 0.0, row=rows[1], side=-1, amplitude=0.3, harmonic=2)]
    force = el.HarmonicForce(0.7, phase=0.3, row=(1.0, 2.0, -1.0))
    scene = scene_of(System(M, C, K, [force, *stops], omega=1.1))
    mode = scene.index(("always", *("rest" if i in held else "free" for i in (0, 1))))
    T = scene.tables
    q, v, t = rng.normal(size=3), rng.normal(size=3), 0.7
    x = np.concatenate([q, v, forcing(scene, t)])
    load = 0.7 * np.cos(1.1 * t + 0.3) * np.array([1.0, 2.0, -1.0]) - C @ v - K @ q
    base2 = np.array([0.0, 0.3 * 2.2**2 * np.cos(2.2 * t)])  # u = n q - 0.3 cos 2 omega t
    J = rows[list(held)]
    saddle = np.block([[M, -J.T], [J, np.zeros((len(held), len(held)))]])
    solved = np.linalg.solve(saddle, np.concatenate([load, -base2[list(held)]]))
    assert T.A[mode, 3:] @ x == pytest.approx(solved[:3], rel=1e-13, abs=1e-13)
    assert np.array_equal(T.A[mode, :3] @ x, v)
    sides = np.array([1.0, -1.0])
    for number, i in enumerate(held):
        (g,) = scene.guards_of(mode, 1 + i)
        assert T.G[mode, g] @ x == pytest.approx(sides[i] * solved[3 + number], rel=1e-13)
        assert scene.event_kind(mode, g) is el.EventKind.RELEASE and scene.hold_element(mode, number) == 1 + i
    assert T.n_holds[mode] == len(held)


def test_a_held_coordinate_keeps_no_rounding():
    for mass, side in itertools.product((1.0, 3.0, 0.3), (1, -1)):
        scene = scene_of(System(mass * np.eye(2), C[:2, :2], K[:2, :2], [el.RigidStop(0.1, dof=1, side=side)]))
        assert not scene.tables.A[scene.index(("rest",)), 3].any()


@pytest.mark.parametrize("factor", [1.0, 2.0, -0.5])
def test_a_coordinate_held_on_a_moving_wall_has_its_acceleration_by_the_row(factor):
    """factor q = gap + wall(t): q'' = wall'' / factor."""
    stop = el.RigidStop(0.3, 0.0, row=(factor, 0.0), amplitude=0.2, harmonic=1, phase=0.4)
    scene = scene_of(System(M[:2, :2], C[:2, :2], K[:2, :2], [stop], omega=1.3))
    t = 0.9
    x = np.concatenate([[0.1, 0.2, -0.3, 0.5], forcing(scene, t)])
    wall = -0.2 * 1.3**2 * np.cos(1.3 * t + 0.4)
    assert scene.tables.A[scene.index(("rest",)), 2] @ x == pytest.approx(wall / factor, rel=1e-14)


@dataclass(frozen=True)
class Ramp(el.Element):
    """Wall on row 0; while it is touched the reaction pushes along (-1, -mu): sliding friction on row 1."""

    mu: float = 0.4
    start = ("away", "sliding")

    def site(self, n):
        return el.Rows.of([[1.0, 0.0, 0.0], [0.0, 1.0, 0.5]], n, drift=(0.0, -0.2))

    def mode(self, key, core):
        d = u(0) - 1.0
        if key == "away":
            return el.Mode(guards=(el.Guard(d, el.EventKind.CONTACT, ("sliding",)),))
        slides = el.Guard(-s(1), el.EventKind.STICK, ())
        return el.Mode(hold=(el.Hold(0, (-1.0, -self.mu), d),),
                       guards=(el.Guard(-lam(), el.EventKind.RELEASE, ("away",)), slides))


def test_a_push_need_not_be_along_the_held_row(rng):
    scene = scene_of(System(M, C, K, [Ramp(), el.CubicSpring(0.5, row=(1.0, 1.0, 0.0))]))
    mode = scene.index(("sliding", "always"))
    T = scene.tables
    n, tangent, spring = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.5]), np.array([1.0, 1.0, 0.0])
    push = -n - 0.4 * tangent
    q, v = rng.normal(size=3), rng.normal(size=3)
    x = np.concatenate([q, v, [1.0]])
    f = -0.5 * (spring @ q) ** 3
    saddle = np.block([[M, -push[:, None]], [n[None, :], np.zeros((1, 1))]])
    solved = np.linalg.solve(saddle, np.concatenate([-C @ v - K @ q + spring * f, [0.0]]))
    assert not scene.closed_form and T.acts[mode].tolist() == [1]
    assert T.LU[0] @ x == pytest.approx(spring @ q) and T.LS[0] @ x == pytest.approx(spring @ v)
    assert T.law.tolist() == [0.5]
    assert T.A[mode, 3:] @ x + T.LP[mode, 0] * f == pytest.approx(solved[:3], rel=1e-13, abs=1e-13)
    assert T.G[mode, 0] @ x + T.LG[mode, 0, 0] * f == pytest.approx(-solved[3], rel=1e-13)
    assert T.G[mode, 1] @ x == pytest.approx(-(tangent @ v - 0.2)) and T.LG[mode, 1, 0] == 0.0
    assert T.H[mode, 0] @ x == pytest.approx(n @ v) and T.S[mode, 0] @ x == pytest.approx(n @ q - 1.0)


def test_memory_has_its_own_states_and_is_written_when_an_algebraic_mode_is_left():
    scene = scene_of(System(1.0, 0.1, 1.0, [Slider(), Slider(kt=4.0, limit=0.8)]))
    assert scene.ns == 4
    mode = scene.index(("stick", "up"))
    x = np.array([0.5, 0.7, 0.1, 9.0, 1.0])  # q, v, both sliders, 1
    T = scene.tables
    assert T.A[mode] @ x == pytest.approx([0.7, -0.5 - 0.07 - 2.0 * (0.5 - 0.1) - 0.8, 0.0, 0.0])
    assert (T.G[mode, :3] @ x).tolist() == pytest.approx([2.0 * 0.4 - 0.3, -2.0 * 0.4 - 0.3, -0.7])
    assert np.array_equal(T.R[mode, 0] @ x, x[:4]) and np.array_equal(T.R[mode, 1] @ x, x[:4])
    assert T.R[mode, 2] @ x == pytest.approx([0.5, 0.0, 0.1, 0.5 - 0.8 / 4.0])  # a stop leaves no speed


def test_elastic_stop_with_a_dashpot_released_at_zero_force():
    stop = el.ElasticStop(0.5, 4.0, 0.3, release="force", side=-1)
    scene = scene_of(System(2.0, 0.1, 1.0, [stop]))
    assert scene.keys == [("free",), ("contact",), ("separating",)]
    T, x = scene.tables, np.array([-0.8, 0.6, 1.0])
    force = 4.0 * 0.3 - 0.3 * 0.6  # k d + c d', d = -q - gap
    assert T.A[0, 1] @ x == pytest.approx((0.8 - 0.06) / 2) and T.A[2, 1] @ x == pytest.approx((0.8 - 0.06) / 2)
    assert T.A[1, 1] @ x == pytest.approx((0.8 - 0.06 + force) / 2)
    assert T.G[1, 0] @ x == pytest.approx(-force) and T.G[2, 1] @ x == pytest.approx(force)
    assert T.G[0, 0] @ x == pytest.approx(0.3) and T.G[2, 0] @ x == pytest.approx(-0.3)
    assert T.then[1, 0].tolist() == [0, 2, 1] and T.then[2, 1].tolist()[:2] == [1, 2]
    assert T.silent.tolist() == [[0, 0], [0, 0], [1, 0]] and not T.kick.any()
    kinds = [scene.event_kind(*at) for at in ((0, 0), (1, 0), (2, 0), (2, 1))]
    assert kinds == ["contact", "separation", "separation", "contact"]


def test_combinations_of_two_stops_on_one_coordinate():
    scene = scene_of(systems.two_sided_impact_oscillator())
    assert [keys[1:] for keys in scene.keys] == [("free", "free"), ("free", "rest"), ("rest", "free")]
    with pytest.raises(DependentHolds, match="hold rows that depend on each other"):
        scene.index(("always", "rest", "rest"))
    assert scene.combine(1, 1, "rest") is None and scene.combine(0, 2, "rest") == 1
    assert list(scene.start_modes()) == [0, 1, 2]
    right, left = scene.guards_of(0, 1), scene.guards_of(0, 2)
    assert scene.tables.then[0, right[0]].tolist() == [2, 0] and scene.tables.then[0, left[0]].tolist() == [1, 0]
    # resting on the right, a hit on the left could not end in rest on both
    assert scene.tables.then[2, scene.guards_of(2, 2)[0]].tolist() == [2, -1]
    assert scene.tables.ends_in[2, scene.guards_of(2, 2)[0]] == -1


def test_the_mirror_image_of_a_symmetric_scene():
    scene = scene_of(systems.two_sided_impact_oscillator())
    assert [scene.mirror(m) for m in range(3)] == [0, 2, 1]
    T, ns = scene.tables, scene.ns
    flip = np.array([-1.0, -1.0, 1.0, -1.0, -1.0])
    for m in range(3):
        p = scene.mirror(m)
        assert np.array_equal(T.A[p], -T.A[m] * flip)
        for g in range(T.n_guards[m]):
            h = scene.mirror_guard(m, g)
            assert scene.mirror_guard(p, h) == g
            assert np.array_equal(T.G[p, h], T.G[m, g] * flip) and np.array_equal(T.R[p, h], -T.R[m, g] * flip)
            for before, after in zip(T.then[m, g], T.then[p, h], strict=True):
                assert after == (scene.mirror(before) if before >= 0 else before)
    assert ns == 2
    with pytest.raises(ValueError, match="is not symmetric"):
        scene_of(systems.impact_oscillator()).mirror(0)


def chain_with_stops(count, gap=0.3):
    """A chain of ``count`` masses with a stop on each."""
    base = systems.impact_chain(n=count)
    stops = [el.RigidStop(gap + 0.1 * i, 0.5, dof=i) for i in range(count)]
    return System(base.mass, base.damping, base.stiffness, [el.HarmonicForce(0.5), *stops], omega=0.4)


def test_small_scenes_are_built_at_once_and_large_ones_when_reached():
    small = scene_of(chain_with_stops(4))
    assert small.complete and len(small.keys) == 16 and not (small.tables.then == -2).any()
    large = scene_of(chain_with_stops(7))
    assert not large.complete and len(large.keys) == 1
    T = large.tables
    assert T.then[0, 2].tolist() == [-2, 0] and T.ends_in[0, 2] == -2
    grown = large.expand(0, 2)
    assert len(large.keys) == 2 and large.tables is grown
    assert grown.then[0, 2].tolist() == [1, 0] and grown.ends_in[0, 2] == 1
    assert large.keys[1] == ("always", "free", "free", "rest", *("free",) * 4)
    assert np.array_equal(grown.A[0], T.A[0]) and np.array_equal(grown.G[0], T.G[0])
    assert grown.then[1, 3].tolist() == [-2, 1]
    assert large.expand(0, 2) is grown  # nothing was missing


def test_a_mode_reached_late_has_the_numbers_of_one_built_at_once():
    small, late = chain_with_stops(4), scene_of(chain_with_stops(4))
    late.keys, late._index, late._guards, late._holds, late._leads, late._packed = [], {}, [], [], [], 0
    wanted = scene_of(small)
    for keys in reversed(wanted.keys):
        late.index(keys)
    for m, keys in enumerate(wanted.keys):
        at = late.index(keys)
        for name in ("A", "G", "R", "B", "D", "H", "S", "ratio", "YT", "E"):
            assert np.array_equal(getattr(late.tables, name)[at], getattr(wanted.tables, name)[m])
        for before, after in zip(wanted.tables.then[m].ravel(), late.tables.then[at].ravel(), strict=True):
            assert after == (late.index(wanted.keys[before]) if before >= 0 else before)


def test_start_modes_come_first_keys_first_and_are_built_on_the_way():
    scene = scene_of(chain_with_stops(7))
    modes = scene.start_modes()
    assert next(modes) == 0 and len(scene.keys) == 1
    following = [scene.keys[next(modes)] for _ in range(7)]
    assert all(keys.count("rest") == 1 for keys in following) and len(set(following)) == 7
    assert sum(1 for _ in scene_of(chain_with_stops(4)).start_modes()) == 16


@pytest.mark.parametrize("build", [getattr(systems, name) for name in systems.__all__], ids=systems.__all__)
def test_numbers_of_other_parameters_are_those_of_a_scene_of_their_own(build):
    scene = scene_of(build())
    for name, value in build().parameters.items():
        if type(value) is float:
            other = build(**{name: 0.8 * value + 0.01})
            own = scene_of(other)
            assert scene.same_structure(own) and scene.same_structure(other)
            assert np.array_equal(scene.flat_of(other), own.tables.flat)
            T = scene.refill(other)
            for field in PARTS:
                assert np.array_equal(getattr(T, field), getattr(own.tables, field)), field


@dataclass(frozen=True)
class Unpacking(el.Element):
    """A load that grows with the square of the frequency, read by unpacking the core or by a place in it."""

    by_place: bool = False

    def site(self, n):
        return el.Rows.of(0, n)

    def mode(self, key, core):
        M, _, _, omega = core
        return el.Mode(force=(M[0, 0] * (core[3] if self.by_place else omega)**2 * u(0),))


@pytest.mark.parametrize("element", [
    el.BaseMotion(0.4, harmonic=2, damper="ground"), el.Jenkins(5.0, 0.4, load_amplitude=0.5), Unpacking(),
    Unpacking(by_place=True), el.Driven(el.ElasticStop(0.3, stiffness=4.0, damping=0.1), amplitude=1.0), el.HarmonicForce(0.7)],
    ids=repr)
def test_numbers_that_follow_the_frequency_are_packed_at_every_one(element):
    def made(omega):
        return System(1.0, 0.1, 1.0, [el.HarmonicForce(0.2), el.RigidStop(1.0, 0.7), element], omega=omega)

    scene = scene_of(made(0.6))
    for omega in (0.6, 0.85, 2.5):
        other = made(omega)
        assert np.array_equal(scene.flat_of(other), scene_of(other).tables.flat)
        assert np.array_equal(scene.flat_of(other), scene_of(made(0.6)).flat_of(other))  # a later call, and the first one
    apart = made(0.85).with_parameters(**{"rigid_stop.gap": 0.9})
    assert np.array_equal(scene.flat_of(apart), scene_of(apart).tables.flat)


def test_tables_are_given_to_systems_of_the_same_structure_only():
    """Where two surfaces begin to move alike both contacts stick together: other modes, and no tables of the system before."""
    floor = System(1.0, 0.1, 1.0, [el.HarmonicForce(0.5), el.Coulomb(0.1), el.Coulomb(0.1, belt_speed=0.3)], omega=0.8)
    scene = scene_of(floor)
    other = floor.with_parameters(**{"coulomb_2.belt_speed": 0.4})
    tables = scene.refill(other)
    assert given(other, tables) is other and scene_of(other).tables is tables and scene_of(other).keys == scene.keys
    together = floor.with_parameters(**{"coulomb_2.belt_speed": 0.0})
    assert scene_of(given(together, scene.tables)).keys == scene_of(System(
        1.0, 0.1, 1.0, [el.HarmonicForce(0.5), el.Coulomb(0.1), el.Coulomb(0.1)], omega=0.8)).keys != scene.keys


def test_another_structure_is_refused():
    scene = scene_of(systems.impact_oscillator())
    assert not scene.same_structure(systems.bouncing_ball())
    for other in (systems.bilinear_oscillator(), systems.impact_chain(n=2), systems.two_sided_impact_oscillator()):
        with pytest.raises(ValueError, match="has another structure than impact_oscillator"):
            scene.flat_of(other)


def test_a_scene_is_made_once_for_a_system():
    system = systems.impact_oscillator()
    assert scene_of(system) is scene_of(system)
    assert scene_of(systems.impact_oscillator()) is not scene_of(system)


def test_several_harmonics_share_the_forcing_states():
    elements = [el.HarmonicForce(1.0, harmonic=3, phase=0.2), el.HarmonicForce(2.0), el.HarmonicForce(0.5, harmonic=3)]
    scene = scene_of(System(1.0, 0.0, 1.0, elements, omega=0.7))
    assert scene.harmonics == (1, 3) and scene.nw == 5
    wanted = [-1, 0, 0, 2, 0, np.cos(0.2) + 0.5, -np.sin(0.2)]
    assert scene.tables.A[0, 1] == pytest.approx(wanted, rel=1e-15)


def test_an_autonomous_scene_has_no_frequency():
    scene = scene_of(System(1.0, 0.1, 1.0, [el.ConstantForce(0.3), el.RigidStop(0.5)]))
    assert scene.omega is None and scene.period is None and scene.nw == 1 and scene.tables.flat[0] == 0.0
    assert scene.tables.A[0, 1].tolist() == [-1.0, -0.1, 0.3]


def test_a_system_without_elements():
    scene = scene_of(System(2.0, 0.1, 3.0))
    assert scene.keys == [()] and scene.tables.A[0].tolist() == [[0, 1, 0], [-1.5, -0.05, 0]]


def test_modes_that_are_met_one_by_one_have_the_numbers_of_modes_built_together():
    n = 6
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    contacts = [el.RigidStop(0.3, 0.5, dof=n - 1), el.RigidStop(0.5, 0.3, dof=1), *[el.Coulomb(0.02, dof=i) for i in range(n - 1)]]
    system = System(np.eye(n), 0.05 * K + 0.02 * np.eye(n), K, [el.HarmonicForce(1.0), *contacts], omega=0.9)
    scene = Scene(system)
    for k in range(30):
        mode = k * k % len(scene.keys)
        scene.expand(mode, k % int(scene.tables.n_guards[mode]))
        if k % 4 == 0:
            give_modal(scene.tables)
    together = Scene(system, scene.keys)
    assert len(scene.keys) > 12 and together.keys == scene.keys
    for tables in (scene.tables, together.tables):
        give_modal(tables)
    for name in PARTS:
        assert np.array_equal(getattr(scene.tables, name), getattr(together.tables, name)), name


def test_an_impact_writes_the_memory_of_all_elements_that_it_turns_round():
    """A slider that slips is where its limit puts it in the instant of the impact, though its own guard does not fire."""
    k, limit, gap = 2.0, 0.3, 0.5
    scene = scene_of(System(1.0, 0.1, 1.0, [el.HarmonicForce(1.0), el.RigidStop(gap, 0.7), el.Jenkins(k, limit)], omega=1.3))
    T, seen = scene.tables, 0
    for m, keys in enumerate(scene.keys):
        for g in range(T.n_guards[m]):
            x = np.concatenate([[gap, 1.4, 0.123], forcing(scene, 0.4)])
            after = T.R[m, g] @ x
            if scene.system.labels[scene.guard(m, g).element] == "rigid_stop" and T.kick[m, g]:
                assert after[:2] == pytest.approx([gap, -0.7 * 1.4], rel=1e-14)
                way = {"slip+": 1.0, "slip-": -1.0}.get(keys[2])
                assert after[2] == pytest.approx(0.123 if way is None else gap - way * limit / k, rel=1e-14)
                seen += 1
    assert seen >= 3


@dataclass(frozen=True)
class Badly(el.Element):
    """A stop whose mode of contact is not what it should be."""

    wrong: object = None
    start = ("away",)
    memory = ("place",)

    def site(self, n):
        return el.Rows.of([[1.0, 0.0], [0.0, 1.0]], n)

    def mode(self, key, core):
        if key == "away":
            return el.Mode(guards=(el.Guard(u(0) - 1.0, el.EventKind.CONTACT, ("touching",)),))
        return self.wrong


@pytest.mark.parametrize("wrong, words", [
    (None, r"badly, mode 'touching': mode\(...\) returned None; it must be a Mode"),
    (el.Mode(force=(u(0),)), "badly, mode 'touching': force has 1 entries; the site has 2 rows"),
    (el.Mode(hold=(el.Hold(2, (1.0, 0.0), u(0)),)), "badly, mode 'touching': Hold.* does not fit a site of 2 rows"),
    (el.Mode(hold=(el.Hold(-1, (1.0, 0.0), u(0)),)), "does not fit a site of 2 rows"),
    (el.Mode(hold=(el.Hold(0, (1.0,), u(0)),)), "does not fit a site of 2 rows"),
    (el.Mode(memory=(None, None)), "badly, mode 'touching': memory has 2 entries; the element names 1")],
    ids=["none", "force", "row", "row below", "push", "memory"])
def test_a_mode_that_does_not_fit_its_site_is_refused_where_an_event_leads_to_it(wrong, words):
    with pytest.raises(ValueError, match=words):
        scene_of(System(np.eye(2), 0.1 * np.eye(2), np.eye(2), [Badly(wrong)]))


@dataclass(frozen=True)
class Deciding(el.Element):
    """Two rows, one of them on a belt; at its limit it asks where it is before it decides, and each mode has a force of its own."""

    asked: tuple = ()
    start = ("soft",)
    memory = ("mark",)

    def site(self, n):
        return el.Rows.of([[1.0, -1.0], [0.5, 2.0]], n, drift=(0.0, -0.2))

    def mode(self, key, core):
        def decide(value):
            return ("left" if value(u(0) - 0.1) < 0.0 else "right",) if not self.asked else tuple(map(value, self.asked))
        power = {"soft": 3, "left": 5, "right": 7}[key]
        law = el.Law(lambda u0, u1, s0, s1: (-u0**power, -s1 * u1 * u1), ())
        return el.Mode(law, guards=(el.Guard(u(1) - 1.0, el.EventKind.CONTACT, decide if key == "soft" else ()),))


def test_what_decides_reads_local_values_of_its_own_element(rng):
    x = rng.normal(size=10)  # q, v, two marks, 1 and a harmonic: one place more than there are
    asked = (u(0), u(1), s(0), s(1), el.local.z(), 2.0 * u(1) - s(0) + 3.0)
    scene = scene_of(System(np.eye(2), 0.1 * np.eye(2), np.eye(2), [el.HarmonicForce(0.3), Deciding(), Deciding(asked)], omega=1.1))
    x = x[:scene.ns + scene.nw]
    x[scene.ns] = 1.0
    q, v = x[:2], x[2:4]
    u0, u1, s0, s1 = q[0] - q[1], 0.5 * q[0] + 2.0 * q[1], v[0] - v[1], 0.5 * v[0] + 2.0 * v[1] - 0.2
    owner = [scene.guard(0, g).element for g in range(scene.tables.n_guards[0])]
    assert owner == [1, 2]
    assert scene.followers(0, 1, x) == pytest.approx((u0, u1, s0, s1, x[5], 2.0 * u1 - s0 + 3.0), rel=1e-14)
    assert scene.followers(0, 0, x) == (("left",) if u0 < 0.1 else ("right",))
    for first, key in ((-0.5, "left"), (0.5, "right")):
        x[:2] = first, 0.0
        assert scene.followers(0, 0, x) == (key,)


def test_modes_that_are_met_later_bring_their_laws_and_addresses(monkeypatch):
    """Whoever has the tables in hand goes on with laws that are compiled; of one whose laws are not yet, none are."""
    texts = []

    def compiled(text):
        texts.append(text)
        return SimpleNamespace(ADDRESSES=(10 * len(texts), 10 * len(texts) + 1))
    monkeypatch.setattr(writer, "step_module", compiled)
    monkeypatch.setattr(writer, "_compiled", {})
    scene = scene_of(System(np.eye(2), 0.1 * np.eye(2), np.eye(2), [Deciding()], omega=1.1))
    assert not scene.complete and len(scene.laws) == 1 and not scene.bound.any()
    assert scene.combine(0, 0, "left") == 1 and len(scene.laws) == 2 and not scene.bound.any() and not texts
    writer.bind(scene)
    writer.bind(scene)
    assert scene.bound.tolist() == [10, 11] and texts == [writer.law_text(scene.laws, 2)]
    assert scene.combine(0, 0, "right") == 2 and len(scene.laws) == 3
    assert scene.bound.tolist() == [20, 21] and scene.tables.bound is scene.bound
    assert texts[1] == writer.law_text(scene.laws, 2) != texts[0]
    assert scene.combine(0, 0, "left") == 1 and len(texts) == 2  # met before


def test_the_memory_of_another_system_of_the_same_structure_follows_its_own_numbers():
    """Where a slider slips it is limit / stiffness behind the mass."""
    system = System(1.0, 0.1, 1.0, [el.HarmonicForce(0.7), el.Jenkins(2.0, 0.3)], omega=1.3)
    scene = scene_of(system)
    m = scene.index(("always", "slip+"))
    state = np.array([[0.5, 1.0, 9.0]])
    for limit in (0.3, 0.8, 0.1):
        other = scene if limit == 0.3 else scene.at(system.with_parameters(limit=limit))
        assert other.shown(np.array([m]), state, np.zeros(1))[0] == pytest.approx([0.5, 1.0, 0.5 - limit / 2.0], abs=1e-15)
        (_, row), = other.algebraic(m)
        assert row[scene.ns] == pytest.approx(-limit / 2.0, abs=1e-15)
