"""Numbers of every mode against the mechanics written out: forces summed at a state, held rows as a saddle-point system, guards,
jumps, followers, for a scene in which no two numbers are equal."""
import itertools
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose import numbers
from bifurc.compose.scene import Scene, given, numbered, scene_of
from bifurc.compose.tables import allocate, keep
from bifurc.elements import (
    Algebraic,
    BaseMotion,
    ConstantForce,
    Coulomb,
    ElasticStop,
    HarmonicForce,
    Jenkins,
    LinearSpring,
    Rate,
    RigidStop,
)
from bifurc.elements.local import affine

OMEGA = 1.3
M = np.array([[1.0, 0.25, 0.1], [0.25, 1.44, -0.2], [0.1, -0.2, 0.9]])
C = np.array([[0.11, -0.03, 0.05], [0.02, 0.07, 0.01], [-0.04, 0.06, 0.2]])
K = np.array([[1.38, -0.38, 0.2], [-0.31, 1.1, -0.4], [0.1, -0.5, 2.0]])
ELEMENTS = (HarmonicForce(0.7, row=(1.0, 0.3, 0.0), phase=0.3), BaseMotion(0.2, 3, 0.4, "ground"),
            RigidStop(0.12, 0.6, amplitude=0.1, harmonic=2, phase=0.5, row=(1.0, -0.4, 0.0)),
            Coulomb(0.5, 0.4, 1.2, belt_speed=0.3, dof=1, label="dry"), Jenkins(2.0, 0.3, dof=2),
            ElasticStop(0.2, 3.0, 0.5, side=-1, row=(0.0, 0.5, 1.0)), LinearSpring(0.4, 0.1, row=(1.0, 0.0, -1.0)))


def with_key(keys, element, key):
    return (*keys[:element], key, *keys[element + 1:])


@pytest.fixture(scope="module")
def scene():
    return scene_of(bf.System(M, C, K, ELEMENTS, omega=OMEGA))


class Place:
    """What an element sees at a state: coordinates, speeds and the part of accelerations that the system does not give."""

    def __init__(self, scene, e, q, v, z, t):
        site = scene.system.elements[e].site(scene.n)
        self.R, self.t, self.z = site.R, t, z[scene.slices[e].start - 2 * scene.n:scene.slices[e].stop - 2 * scene.n]
        base = [[self.wave(motion, order) for order in range(3)] for motion in site.base] or [[0.0] * 3] * len(site.R)
        drift = site.drift or (0.0,) * len(site.R)
        self.u = site.R @ q + [b[0] for b in base]
        self.s = site.R @ v + [b[1] + d for b, d in zip(base, drift, strict=True)]
        self.rest = np.array([b[2] for b in base])
        self.lam = ()

    def wave(self, expression, order=0):
        total = 0.0
        for (name, k), weight in affine(expression).terms.items():
            w = k * OMEGA
            turn = w * self.t + 0.5 * np.pi * order
            total += weight * (w**order * math.cos(turn) if name == "cos" else w**order * math.sin(turn) if name == "sin"
                               else float(order == 0))
        return total

    def value(self, expression):
        known = {"u": self.u, "s": self.s, "z": self.z, "lam": self.lam}
        return sum(weight * (known[name][i] if name in known else self.wave(type(affine(0.0))({(name, i): 1.0})))
                   for (name, i), weight in affine(expression).terms.items())


def mechanics(scene, m, q, v, z, t):
    """Return places, accelerations, held rows (rows J, pushes D) by the saddle-point system."""
    places = [Place(scene, e, q, v, z, t) for e in range(len(scene.system.elements))]
    modes = [element.mode(key, scene.system.core) for element, key in zip(scene.system.elements, scene.keys[m], strict=True)]
    force = -C @ v - K @ q
    for place, mode in zip(places, modes, strict=True):
        if mode.force:
            force = force + place.R.T @ [place.value(entry) for entry in mode.force]
    holds = [(e, hold) for e, mode in enumerate(modes) for hold in mode.hold]
    J = np.array([places[e].R[hold.row] for e, hold in holds]).reshape(-1, 3)
    D = np.array([places[e].R.T @ hold.push for e, hold in holds]).reshape(-1, 3).T
    k = len(holds)
    whole = np.block([[M, -D], [J, np.zeros((k, k))]])
    found = np.linalg.solve(whole, np.concatenate([force, [-places[e].rest[hold.row] for e, hold in holds]]))
    for e, place in enumerate(places):
        place.lam = [found[3 + i] for i, (owner, _) in enumerate(holds) if owner == e]
    return places, modes, holds, found[:3], J, D


def drawn(scene, rng):
    t = rng.uniform(0.0, 9.0)
    x = np.concatenate([rng.normal(size=scene.ns), scene.forcing(np.array([t]))[0]])
    return x, x[:3], x[3:6], x[6:scene.ns], t


def test_rates_guards_and_holds_of_every_mode(scene, rng):
    T = scene.tables
    assert len(scene.keys) == 36 and scene.complete and scene.harmonics == (1, 2, 3) and scene.closed_form
    for m in range(36):
        x, q, v, z, t = drawn(scene, rng)
        places, modes, holds, a, J, D = mechanics(scene, m, q, v, z, t)
        rates = [places[e].value(item.value) if isinstance(item, Rate) else 0.0 for e, mode in enumerate(modes)
                 for item in (mode.memory or (None,) * len(scene.system.elements[e].memory))]
        assert T.A[m] @ x == pytest.approx([*v, *a, *rates], abs=1e-12)
        assert T.n_holds[m] == len(holds) and [scene.hold_element(m, k) for k in range(len(holds))] == [e for e, _ in holds]
        for k, (e, hold) in enumerate(holds):
            assert T.H[m, k] @ x == pytest.approx(places[e].s[hold.row], abs=1e-13)
            surface = 0.0 if hold.surface is None else places[e].value(hold.surface)
            assert T.S[m, k] @ x == pytest.approx(surface, abs=1e-13) and T.S[m, k].any() == (hold.surface is not None)
        listed = [(e, number, guard) for e, mode in enumerate(modes) for number, guard in enumerate(mode.guards)]
        assert T.n_guards[m] == len(listed)
        for g, (e, number, guard) in enumerate(listed):
            assert T.G[m, g] @ x == pytest.approx(places[e].value(guard.value), abs=1e-12)
            assert scene.guard(m, g) == (e, number, guard) and T.element[m, g] == e and T.kind[m, g] == guard.kind.code
            assert scene.event_kind(m, g) is guard.kind and scene.element_name(m, g) == scene.system.labels[e]
            assert (T.kick[m, g], T.silent[m, g]) == (guard.kick is not None, guard.silent)
            assert g in scene.guards_of(m, e) and scene.followers(m, g, x) == guard.then
            then = [scene.keys[k] for k in T.then[m, g] if k >= 0]
            tried = [with_key(scene.keys[m], e, key) for key in guard.then]
            assert then == [keys for keys in tried if keys != scene.keys[m]] + [scene.keys[m]]
            if guard.accumulates is None:
                assert T.ends_in[m, g] == -1 and T.ratio[m, g] == 0.0
            else:
                assert T.ratio[m, g] == 0.6 and scene.keys[T.ends_in[m, g]] == with_key(scene.keys[m], e, "rest")
        assert (T.then[m, len(listed):] == -1).all() and (T.ends_in[m, len(listed):] == -1).all()


def test_jumps_of_every_event(scene, rng):
    """An impulse along the row of the stop, places put on their surface, speeds that stop exactly, memory of what is left."""
    T, kinds = scene.tables, set()
    for m in range(36):
        x, q, v, z, t = drawn(scene, rng)
        places, modes, holds, _, J, D = mechanics(scene, m, q, v, z, t)
        g = 0
        for e, mode in enumerate(modes):
            for guard in mode.guards:
                y = T.R[m, g] @ x
                dq, dv = y[:3] - q, y[3:6] - v
                names = guard.value.names
                R = places[e].R[0]
                written = range(len(modes)) if guard.kick is not None else (e,)
                memory = z.copy()
                for other in written:
                    for i, item in enumerate(modes[other].memory):
                        if isinstance(item, Algebraic):
                            memory[scene.slices[other].start - 6 + i] = places[other].value(item.value)
                assert y[6:] == pytest.approx(memory, abs=1e-13)
                W = R @ np.linalg.solve(M, R)
                if "u" in names and not names & {"s", "z", "lam"}:
                    kinds.add("surface")
                    assert T.G[m, g] @ np.concatenate([y, x[scene.ns:]]) == pytest.approx(0.0, abs=1e-12)
                    free = np.linalg.solve(M, R)
                    if len(J):
                        free = free - np.linalg.solve(M, D @ np.linalg.solve(J @ np.linalg.solve(M, D), J @ free))
                    assert dq == pytest.approx(-free * (T.G[m, g] @ x) / (T.G[m, g, :3] @ free), abs=1e-12)
                    assert T.D[m, g, :3] == pytest.approx(free / (T.G[m, g, :3] @ free), abs=1e-12)
                else:
                    assert not dq.any()
                if guard.kick is not None:
                    kinds.add("kick")
                    impulse = -1.6 * places[e].s[0] / W
                    assert dv == pytest.approx(np.linalg.solve(M, R) * impulse, abs=1e-12)
                    along = np.linalg.solve(M, R)
                    assert T.B[m, g, 3:6] == pytest.approx(along / (T.G[m, g, :3] @ along), abs=1e-12)
                elif "s" in names and not names & {"u", "z", "lam"}:
                    kinds.add("stop")
                    assert T.G[m, g] @ np.concatenate([y, x[scene.ns:]]) == pytest.approx(0.0, abs=1e-12)
                    assert not len(J) or J @ dv == pytest.approx(np.zeros(len(J)), abs=1e-12)
                else:
                    assert not dv.any()
                g += 1
    assert kinds == {"surface", "kick", "stop"}


def test_velocities_come_to_rest_by_inertia(scene, rng):
    for m in range(36):
        x, *_ = drawn(scene, rng)
        given = x.copy()
        y, _ = scene.put_to_rest(m, x)
        assert np.array_equal(x, given)  # not changed in place
        T, k = scene.tables, int(scene.tables.n_holds[m])
        assert T.H[m, :k] @ y == pytest.approx(np.zeros(k), abs=1e-13) and np.array_equal(y[:3], x[:3])
        impulse = M @ (y - x)[3:6]
        J = T.H[m, :k, 3:6]
        assert impulse == pytest.approx(J.T @ (np.linalg.lstsq(J.T, impulse, rcond=None)[0] if k else np.empty(0)), abs=1e-12)
        assert np.array_equal(y[6:], x[6:]) and (k or np.array_equal(x, y))


def test_memory_at_a_start_and_shown(scene, rng):
    x, q, v, z, t = drawn(scene, rng)
    scene.relax(x)
    assert x[6] == q[2] and scene.memory_of(4) == slice(6, 7) and scene.memory_of(3) == slice(6, 6)
    slipping = next(m for m, keys in enumerate(scene.keys) if keys[4] == "slip-")
    sticking = next(m for m, keys in enumerate(scene.keys) if keys[4] == "stick")
    for m, expected in ((slipping, q[2] + 0.15), (sticking, 9.0)):
        states = np.array([[*q, *v, 9.0]] * 2)
        scene.show(m, states, np.array([t, t + 1.0]))
        assert states[:, 6] == pytest.approx([expected] * 2) and states[0, :6].tolist() == [*q, *v]
    assert scene.algebraic(sticking) == [] and [place for place, _ in scene.algebraic(slipping)] == [6]
    tau = np.array([0.3, 1.1])
    known = [[1.0, *itertools.chain(*((math.cos(k * OMEGA * s), math.sin(k * OMEGA * s)) for k in (1, 2, 3)))] for s in tau]
    assert scene.forcing(tau) == pytest.approx(np.array(known), abs=1e-15)


def test_modes_by_their_keys(scene):
    keys = scene.keys[7]
    assert scene.index(keys) == 7 and scene.combine(7, 3, keys[3]) == 7
    other = scene.combined(7, {2: "rest", 5: "contact"})
    assert scene.keys[other] == (*keys[:2], "rest", *keys[3:5], "contact", keys[6])
    assert scene.keys[scene.combine(7, 4, "slip-")] == with_key(keys, 4, "slip-")
    starts = [scene.keys[m] for m in scene.start_modes()]
    order = [element.start for element in scene.system.elements]
    numbers_ = [[start.index(key) for start, key in zip(order, keys, strict=True)] for keys in starts]
    assert [sum(n) for n in numbers_] == sorted(sum(n) for n in numbers_) and len(set(starts)) == len(starts) == 36
    assert starts[0] == tuple(start[0] for start in order)
    assert repr(scene) == "Scene(n=3, modes=36, harmonics=(1, 2, 3), closed_form=True)"
    with pytest.raises(ValueError, match="is not symmetric"):
        scene.mirror(0)


def test_rows_that_two_contacts_hold_are_dependent():
    both = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(), RigidStop(0.2), Coulomb(0.3)], omega=1.0))
    assert both.combine(both.index(("always", "rest", "slip+")), 2, "stick") is None
    assert both.combined(both.index(("always", "free", "stick")), {1: "rest"}) is None
    with pytest.raises(numbers.DependentHolds, match="hold rows that depend on each other"):
        both.index(("always", "rest", "stick"))
    assert ("always", "rest", "stick") not in both.keys and len(both.keys) == 5
    near = scene_of(bf.System(np.eye(2), np.eye(2), np.eye(2), [Coulomb(0.3), Coulomb(0.3, row=(1.0, 1e-5))]))
    assert ("stick", "stick") in near.keys  # the Gram matrix is regular to 1e-10


def test_numbers_of_another_system_of_the_structure(scene):
    other = scene.system.with_parameters(**{"dry.friction": 0.7, "rigid_stop.gap": 0.3, "mass[0,1]": 0.1, "omega": 1.7})
    own = Scene(other)
    assert scene.same_structure(other) and np.array_equal(scene.flat_of(other), own.tables.flat)
    refilled = scene.refill(other)
    assert np.array_equal(refilled.flat, own.tables.flat) and np.array_equal(refilled.YT, own.tables.YT)
    assert np.array_equal(scene.refill(scene.system).flat, scene.tables.flat) and scene.refill(scene.system) is not scene.tables
    linked = scene_of(other)
    assert linked.keys == scene.keys and linked.keys is not scene.keys and np.array_equal(linked.tables.flat, own.tables.flat)
    assert linked.omega == 1.7 and linked.period == other.period
    assert "modes" not in numbered(other)
    simple = bf.System(2.0, 0.1, 1.0, [HarmonicForce(0.3), RigidStop(0.4)], omega=1.0)
    faster = simple.with_parameters(omega=2.0)
    flat = scene_of(simple).flat_of(faster)
    assert flat[0] == 2.0 and np.array_equal(flat[1:], scene_of(simple).tables.flat[1:])
    assert np.array_equal(flat, Scene(faster).tables.flat)
    with pytest.raises(ValueError, match="has another structure than"):
        scene.flat_of(simple)
    shared = given(simple.with_parameters(omega=3.0), scene_of(simple).refill(simple.with_parameters(omega=3.0)))
    assert shared._scene is not None and shared._scene.tables.flat[0] == 3.0


def test_delayed_feedback_is_refused_by_name():
    from bifurc.elements.feedback import DelayedFeedback

    with pytest.raises(ValueError, match="'delayed_feedback': delayed feedback is not supported here"):
        scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(), DelayedFeedback(0.1)], omega=1.0))


def test_rows_that_a_hold_keeps_still():
    """On the held row, in any multiple, a guard stays what it is: a place from the second derivative on, a speed from the first."""
    system = bf.System(np.eye(2), np.zeros((2, 2)), np.eye(2), [
        RigidStop(0.2), ElasticStop(0.3, 2.0, row=(2.0, 0.0)), Coulomb(0.3, dof=0), ElasticStop(0.1, 2.0, row=(1.0, 1.0))])
    scene = scene_of(system)
    for keys, expected in ((("rest", "free", "slip+", "free"), {1: 2, 2: 1, 3: 0}),
                           (("free", "free", "slip+", "free"), {1: 0, 2: 0, 3: 0})):
        m = scene.index(keys)
        for e, order in expected.items():
            (g,) = scene.guards_of(m, e)
            assert scene.tables.still[m, g] == order, (keys, e)
            assert not order or not scene.tables.GT[m, g, :, order:].any()
    moving = bf.System(np.eye(2), np.zeros((2, 2)), np.eye(2), [
        RigidStop(0.2, amplitude=0.1, harmonic=1), ElasticStop(0.3, 2.0), HarmonicForce()], omega=1.0)
    scene = scene_of(moving)
    m = scene.index(("rest", "free", "always"))
    assert scene.tables.still[m, scene.guards_of(m, 1)[0]] == 0


def test_what_kind_of_surface_a_guard_is():
    from bifurc.elements.local import cos, lam, s, u, z

    for value, surface, stop in ((u() - 1.0 + cos(1), True, False), (s() + cos(1), False, True), (u() + s(), False, False),
                                 (u() + z(), False, False), (u() + lam(), False, False), (s() + z(), False, False),
                                 (s() + lam(), False, False), (lam(), False, False), (affine(1.0), False, False),
                                 (None, False, False)):
        assert (numbers.is_surface(value), numbers.is_stop(value)) == (surface, stop)


def test_numbers_move_into_larger_tables():
    small, large = allocate(2, 1, 2, 1, 2, 4, (1,)), allocate(3, 2, 3, 1, 2, 4, (1,))
    small.A[:], small.G[:], large.A[:] = 3.0, 4.0, 7.0
    keep(small, large, ("A", "G"))
    assert (large.A[:2] == 3.0).all() and (large.A[2] == 7.0).all() and (large.G[:2, :1] == 4.0).all() and not large.G[:, 1].any()
    assert (large.then == -1).all() and (large.ends_in == -1).all() and large.harmonics.tolist() == [1]
    for dofs, laws, modal in ((4, 0, False), (5, 0, True), (5, 1, False)):
        assert bool(allocate(1, 1, 1, 1, dofs, 2 * dofs, (), laws).V.size) is modal


def test_a_large_scene_is_built_where_it_is_met():
    """Four frictions on four masses: 81 modes; those that are met are numbered in their order, and records keep them."""
    system = bf.System(np.eye(4), 0.1 * np.eye(4), np.eye(4), [HarmonicForce(), ConstantForce(0.1, dof=3),
                                                              *(Coulomb(0.3, dof=i) for i in range(4))], omega=1.0)
    scene = scene_of(system)
    first = ("always", "always", "stick", "stick", "stick", "stick")
    assert not scene.complete and scene.keys == [first]
    assert scene.tables.then[0, 0].tolist()[:2] == [-2, 0]
    tables = scene.expand(0, 0)
    assert scene.keys == [first, (*first[:2], "slip+", *first[3:])] and tables.then[0, 0].tolist()[:2] == [1, 0]
    assert np.array_equal(tables.A[1], Scene(system, ((*first[:2], "slip+", *first[3:]),)).tables.A[1])
    assert numbered(system)["modes"] == scene.keys
    later = scene_of(system.with_parameters(**{"coulomb.friction": 0.5}))
    assert later.keys == scene.keys


def test_a_force_along_a_held_row_leaves_no_rounding_beside_a_small_one():
    """Two masses stick to each other within a stiff contact of their distance: they are one mass, and dry friction on the second
    decelerates it by mu over the sum of all entries of the mass matrix, to the last digits of that however stiff the contact is."""
    mass = np.array([[1.3436, 0.0098], [0.0098, 1.2283]])
    apart = (1.0, -1.0)
    for mu in (1e-3, 0.0221, 0.1):
        system = bf.System(mass, C[:2, :2], K[:2, :2], [Coulomb(0.0267, row=apart), ElasticStop(0.891, 3.71e4, row=apart),
                                                        Coulomb(mu, dof=1, belt_speed=0.0836)])
        scene = scene_of(system)
        mode = scene.keys.index(("stick", "contact", "slip+"))
        constant = scene.tables.A[mode, 2:4, scene.ns]
        np.testing.assert_allclose(np.abs(constant), mu / mass.sum(), rtol=2e-15)


@pytest.mark.parametrize("seed", range(6))
def test_coordinates_that_several_constraints_hold_feel_nothing(seed):
    """One mass sticks and two others to it and to each other: whatever acts, not one of them has an acceleration."""
    rng = np.random.default_rng(seed)
    Q = rng.normal(size=(3, 3))
    mass = Q @ Q.T + np.eye(3)
    rows = ((0.0, 1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 0.0, -1.0))
    others = [HarmonicForce(0.694, dof=0), Coulomb(0.0674, dof=1, belt_speed=0.1), ElasticStop(0.3, 40.0, dof=2)]
    system = bf.System(mass, C, K, [*(Coulomb(0.05 + 0.1 * i, row=row) for i, row in enumerate(rows)), *others], omega=OMEGA)
    scene = scene_of(system)
    mode = scene.index(("stick", "stick", "stick", "always", "slip+", "contact"))
    np.testing.assert_array_equal(scene.tables.A[mode, 3:6], 0.0)
    system = bf.System(mass, C, K, [Coulomb(0.1, row=rows[0]), Coulomb(0.2, row=rows[1]), *others], omega=OMEGA)
    scene = scene_of(system)
    mode = scene.index(("stick", "stick", "always", "slip+", "contact"))
    np.testing.assert_array_equal(scene.tables.A[mode, 3:5], 0.0)


def test_what_an_impulse_leaves_of_its_own_row_is_exactly_nothing(rng):
    """Rows that move as the row of a contact does lose all of it, whatever rounding says; others keep what is beside it."""
    from bifurc.compose.numbers import unmoved

    for _ in range(20):
        direction, row = rng.normal(size=3), rng.normal(size=5) * 10.0 ** rng.integers(-6, 6)
        moved = direction[:, None] * row
        beside = rng.normal(size=(3, 5)) * (rng.random((3, 5)) < 0.5) * np.abs(moved)
        rounded = moved * (1.0 + 2.2e-16 * rng.integers(-1, 2, (3, 5)))
        left = unmoved(np.where(beside == 0.0, rounded, moved + beside), direction, row)
        assert np.array_equal(left == 0.0, beside == 0.0)
        np.testing.assert_allclose(left, beside, rtol=1e-12, atol=1e-15 * np.abs(moved).max())
