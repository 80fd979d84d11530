"""Numbers that a batch step under laws reads, against forcing written out; cubics of accelerations; substeps that are deferred."""
from copy import deepcopy
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.polynomial import Polynomial

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.ensemble import scalar
from bifurc.ensemble.batch import law_modes, smooth
from bifurc.flow.scan import COUNT, MODE, STATE, TAU
from tests.reference.plain import plain

e = bf.elements
OMEGA, STEPS = 1.3, 9
SYSTEM = bf.System([[1.0, 0.3], [0.3, 2.0]], [[0.1, 0.0], [0.0, 0.2]], [[2.0, -0.5], [-0.5, 1.0]],
                   [e.HarmonicForce(0.7, phase=0.4, dof=0), e.HarmonicForce(-0.3, harmonic=2, phase=-1.0, dof=1),
                    e.ConstantForce(0.2), e.CubicSpring(0.5, row=(-1.0, 1.0)),
                    e.RigidStop(0.6, 0.7), e.RigidStop(0.8, 0.5, side=-1, dof=1)], omega=OMEGA)


def forcing(t):
    """Accelerations (2, ...) by the excitation."""
    force = np.array([0.7 * np.cos(OMEGA * t + 0.4) + 0.2, -0.3 * np.cos(2.0 * OMEGA * t - 1.0)])
    return np.tensordot(np.linalg.inv(SYSTEM.mass), force, 1)


def changed(T, G):
    """Tables with other guards."""
    made = deepcopy(T)
    made.G[:] = G
    return made


@pytest.fixture
def read():
    """Numbers of the scene's modes and substeps; `read(G)` has guards' rows of one's own."""
    scene = scene_of(SYSTEM)
    kind = smooth.kind_of(scene)

    def made(G=None):
        T = scene.tables if G is None else changed(scene.tables, G)
        return T, *law_modes.step_numbers(T, kind, STEPS)

    return kind, made


def test_loads_of_substeps_are_those_of_the_excitation(read):
    """At the stages, and between them as polynomials; fields are those of the mechanics."""
    kind, made = read
    T, own, grid = made()
    h, c = 2.0 * np.pi / OMEGA / STEPS, law_modes.nystrom(8).c[:-1]
    free = next(m for m in range(len(own)) if T.n_holds[m] == 0)
    for k in range(STEPS):
        known = forcing((k + c) * h).T
        np.testing.assert_allclose(grid[free, k]["stages"][:, :2], known, atol=1e-13)
        for s in np.linspace(0.0, h, 7):
            values = [Polynomial(row)(s) for row in grid[free, k]["loads"][:2]]
            np.testing.assert_allclose(values, forcing(k * h + s), atol=1e-8)
    field = -np.linalg.solve(SYSTEM.mass, np.hstack([SYSTEM.stiffness, SYSTEM.damping]))
    np.testing.assert_allclose(own[free]["field"], field, atol=1e-13)
    assert own[free]["h"] == pytest.approx(h)
    assert own[free]["u"].tolist() == [[-1.0, 1.0]] and own[free]["values"].tolist() == [0.5]
    np.testing.assert_allclose(own[free]["p"][0], np.linalg.solve(SYSTEM.mass, [-1.0, 1.0]), atol=1e-13)


def test_what_forcing_gives_to_guards(read, rng):
    """Value and a third of the step times slope at both ends, polynomials between; bounds on the fourth derivative and rounding."""
    kind, made = read
    G = np.array(scene_of(SYSTEM).tables.G)
    G[:, :, :] = rng.normal(size=G.shape)
    assert (G[..., 4:] < 0.0).any()
    T, own, grid = made(G)
    _, mirrored, _ = made(-G)
    _, doubled, _ = made(2.0 * G)
    h, fine = 2.0 * np.pi / OMEGA / STEPS, np.linspace(0.0, 2.0 * np.pi / OMEGA, 4001)

    def part(row, t, order=0):
        """Derivative of the part of a guard that time alone gives."""
        out = row[4] * (order == 0)
        for i, k in enumerate((1, 2)):
            a, b, w = row[5 + 2 * i], row[6 + 2 * i], k * OMEGA
            out = out + w**order * (a * np.cos(w * t + order * np.pi / 2.0) + b * np.sin(w * t + order * np.pi / 2.0))
        return out

    for m in range(len(own)):
        for g in range(kind.guards):
            guard, on = own[m]["guards"][g], grid[m]["guards"][:, g]
            if g >= T.n_guards[m]:
                assert g >= own[m]["count"] and guard.tobytes() == bytes(guard.nbytes) and on.tobytes() == bytes(on.nbytes)
                continue
            row, t = G[m, g], h * np.arange(STEPS + 1)
            assert np.array_equal(guard["value"], row[:4]) and guard["constant"] == row[4]
            for end, at in enumerate((t[:-1], t[1:])):
                known = np.transpose([part(row, at), h / 3.0 * part(row, at, 1)])
                np.testing.assert_allclose(on["ends"][:, end], known, atol=1e-12)
            for k in range(STEPS):
                for s in np.linspace(0.0, h, 5):
                    assert Polynomial(on["value"][k])(s) == pytest.approx(part(row, k * h + s), abs=1e-7)
                    assert Polynomial(on["slope"][k])(s) == pytest.approx(h / 3.0 * part(row, k * h + s, 1), abs=1e-7)
            highest = sum(np.abs(part(np.where(np.isin(np.arange(9), keep), row, 0.0), fine, 4)).max() for keep in ((5, 6), (7, 8)))
            if T.LG[m, g].any():  # it feels the cubic spring: nothing is proved of it
                assert guard["bound_all"] == guard["noise_all"] == np.inf
                continue
            assert guard["bound_all"] == pytest.approx(law_modes.SAFETY / 384.0 * h**4 * highest, rel=1e-5)
            assert guard["noise_all"] == pytest.approx(law_modes.NOISE * (abs(row[4]) + np.abs(row[5:9]).sum()), rel=1e-12)
            assert mirrored[m]["guards"][g]["noise_all"] == guard["noise_all"] == 0.5 * doubled[m]["guards"][g]["noise_all"]
            assert mirrored[m]["guards"][g]["bound_all"] == guard["bound_all"]


def test_a_kick_turns_the_speed_of_arrival_round(read):
    """What is added per speed of arrival: after it the speed is that times -r, and nothing pushes elsewhere than along the row."""
    kind, made = read
    T, own, _ = made()
    free, seen = next(m for m in range(len(own)) if T.n_holds[m] == 0), []
    for g in range(T.n_guards[free]):
        row, r = T.G[free, g, :2], T.ratio[free, g]
        added = own[free]["guards"][g]["added"]
        assert row @ added[2:] == pytest.approx(-(1.0 + r)) and not added[:2].any()
        impulse = SYSTEM.mass @ added[2:]
        assert impulse @ [row[1], -row[0]] == pytest.approx(0.0, abs=1e-12)
        seen.append(r)
    assert sorted(seen) == [0.5, 0.7]


def test_accelerations_of_a_step_are_a_cubic_with_bounds(rng):
    """Through four samples of one that is a cubic: its third derivative, and a bound on its second one, over the whole substep
    where the step is a part of it."""
    c = law_modes.nystrom(8).c[:-1]
    kind = SimpleNamespace(n=2, order=8, acts=[law_modes.Acts((), ())], rows=(), values=(), moving=(), coordinates=(), speeds=())

    def named(values, ended, r):
        """What the lines name; no field pushes, so that the accelerations at the end are the loads of the last stage."""
        names = {f"f{i}_{k}": values(k, time) for k in range(2) for i, time in enumerate(c)} | {"over": 1.0 / r}
        names |= {f"x{j}": 0.0 for j in range(4)} | {f"mode_field_{k}_{j}": 0.0 for k in range(2) for j in range(4)}
        names |= {f"forcing_stages_{len(c) - 1}_{k}": ended(k) for k in range(2)}
        for line in law_modes._ends(kind, 0):
            exec(line, names)
        return names

    for r in (1.0, 0.3, 0.1, 1.0, 0.7):
        cubics = [Polynomial(rng.normal(size=4)) for _ in range(2)]  # over the substep, of which the step is the part r
        names = named(lambda k, time, r=r, cubics=cubics: cubics[k](r * time), lambda k, r=r, cubics=cubics: cubics[k](r), r)
        for k, cubic in enumerate(cubics):
            assert (names[f"begun_{k}"], names[f"ended_{k}"]) == (cubic(0.0), cubic(r))
            third, second = abs(cubic.deriv(3)(0.0)), np.abs(cubic.deriv(2)(np.linspace(0.0, r, 50))).max()
            assert names[f"third_{k}"] == pytest.approx(third, rel=1e-9)
            assert second <= names[f"second_{k}"] * (1.0 + 1e-9) <= 2.0 * second + 2.0 * third
    constant = named(lambda k, time: 1.5, lambda k: 1.5, 1.0)
    assert [constant[f"{name}_0"] for name in ("second", "third")] == [0.0] * 2


def test_a_deferred_substep_begins_and_ends_on_the_grid(rng):
    """With the forcing of its time; the last one ends at the section.  It tells mode, events, hits and the least speed."""
    scene = scene_of(SYSTEM)
    T, h, seen = scene.tables, 2.0 * np.pi / OMEGA / STEPS, []

    def integrate(T, ints, floats, x, whole, tau, limit, rows, record, tally):
        seen.append((ints[MODE], floats[TAU], x.copy(), whole, tau, limit, rows.shape, record.shape, tally.copy(), ints[COUNT]))
        ints[COUNT], ints[MODE] = 3, 1
        x[:4] += [1.0, 2.0, 3.0, 4.0]
        tally[0] += 2.0
        tally[1] = min(tally[1], 0.4)
        return 5

    room = plain(scalar.room)(T)
    substep = plain(scalar.substep, integrate=integrate)
    for k in (0, 4, STEPS - 1):
        y = rng.normal(size=4)
        room[0][:] = y
        assert substep(T, k, STEPS, h, 2, room, 17) == (5, 1)
        assert room[0] == pytest.approx(y + [1.0, 2.0, 3.0, 4.0], abs=0.0) and room[1].tolist() == [3.0, 2.0, 0.4]
        mode, begin, x, whole, end, limit, rows, record, tally, count = seen[-1]
        assert (mode, limit, count, tally.tolist()) == (2, 17, 0, [0.0, np.inf]) and np.array_equal(x[:4], y)
        assert begin == pytest.approx(k * h) and x[4:] == pytest.approx(scene.forcing(np.array([k * h]))[0], abs=1e-13)
        assert whole * 2.0 * np.pi / OMEGA + end == pytest.approx((k + 1) * h) and (whole == 1) == (k + 1 == STEPS)
        assert end == 0.0 or whole == 0
        assert rows[0] == record[0] > 0 and rows[1] == 5 and record[1] == STATE + 2 * 4
