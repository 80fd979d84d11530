"""Broyden's methods: updates against their definition, standard problems, honest failures."""
import numpy as np
import pytest

from bifurc.solve.broyden import BroydenStatus, Factors, _learn, broyden


def tridiagonal(x):
    """Broyden's tridiagonal function."""
    y = (3.0 - 2.0 * x) * x + 1.0
    y[1:] -= x[:-1]
    y[:-1] -= 2.0 * x[1:]
    return y


def tridiagonal_slope(x):
    """Its Jacobian."""
    n = len(x)
    return np.diag(3.0 - 4.0 * x) - np.diag(np.ones(n - 1), -1) - 2.0 * np.diag(np.ones(n - 1), 1)


def rosenbrock(x):
    """Root (1, 1)."""
    return np.array([10.0 * (x[1] - x[0]**2), 1.0 - x[0]])


def boundary(x):
    """Discrete boundary value problem of More, Garbow & Hillstrom."""
    n = len(x)
    h = 1.0 / (n + 1)
    t = h * np.arange(1, n + 1)
    y = 2.0 * x + 0.5 * h * h * (x + t + 1.0)**3
    y[1:] -= x[:-1]
    y[:-1] -= x[1:]
    return y


def helix(x):
    """Helical valley; root (1, 0, 0)."""
    angle = np.arctan2(x[1], x[0]) / (2.0 * np.pi)
    return np.array([10.0 * (x[2] - 10.0 * angle), 10.0 * (np.hypot(x[0], x[1]) - 1.0), x[2]])


@pytest.mark.parametrize("kind", ["good", "bad"])
def test_updates_are_those_of_the_definition(rng, kind):
    """One update of the QR factors against the dense rank-one formula; both fulfil the secant equation."""
    J = rng.normal(size=(6, 6)) + 3.0 * np.eye(6)
    dx, df = rng.normal(size=6), rng.normal(size=6)
    factors = Factors(J)
    _learn(factors, kind, dx, df)
    if kind == "good":
        expected = J + np.outer(df - J @ dx, dx) / (dx @ dx)
    else:
        H = np.linalg.inv(J)
        expected = np.linalg.inv(H + np.outer(dx - H @ df, df) / (df @ df))
    found = factors.q @ factors.r
    assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()
    assert np.abs(factors.solve(df) - dx).max() <= 1e-12 * np.abs(dx).max() * np.linalg.cond(expected)
    assert np.abs(np.tril(factors.r, -1)).max() == 0.0


@pytest.mark.parametrize("kind", ["good", "bad"])
@pytest.mark.parametrize(("f", "x0", "root"), [
    (tridiagonal, -np.ones(10), None), (tridiagonal, -np.ones(80), None), (rosenbrock, [-1.2, 1.0], [1.0, 1.0]),
    (boundary, np.linspace(0.1, 0.9, 30) * (np.linspace(0.1, 0.9, 30) - 1.0), None), (helix, [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
])
def test_standard_problems(kind, f, x0, root):
    """Differences as the first Jacobian."""
    found = broyden(f, x0, kind=kind)
    assert found.success and "\n" not in repr(found)
    assert np.abs(f(found.x)).max() <= 1e-9
    if root is not None:
        assert np.abs(found.x - root).max() <= 1e-9


def test_exact_jacobian_saves_the_differences():
    """Same iterations, n residuals fewer."""
    plain, exact = broyden(tridiagonal, -np.ones(40)), broyden(tridiagonal, -np.ones(40), tridiagonal_slope)
    assert exact.success and abs(exact.iterations - plain.iterations) <= 1
    assert plain.evaluations >= exact.evaluations + 40
    assert exact.jacobians == 1


def test_given_jacobian_and_superlinear_convergence():
    """The Jacobian of a neighbouring problem will do; the residual falls faster than linearly."""
    near = tridiagonal_slope(np.full(20, -0.7))
    found = broyden(tridiagonal, np.full(20, -0.6), near)
    assert found.success
    falls = np.array(found.history[1:]) / np.array(found.history[:-1])
    assert falls[-1] < 0.1 and falls[-3:].max() < falls[:3].max()


def test_restart_where_the_first_jacobian_is_useless():
    """A first Jacobian with the wrong sign stalls; it is computed again and the iteration goes on."""
    wrong = np.diag([-1.0, 1.0, -1.0, 1.0])[::-1]
    found = broyden(lambda x: x**3 + x - np.array([2.0, -10.0, 30.0, 0.5]), np.full(4, 3.0), jacobian=wrong)
    assert found.success and found.jacobians >= 2


@pytest.mark.parametrize(("f", "x0", "keywords", "status"), [
    (lambda x: x * x + 1.0, [0.7], {}, (BroydenStatus.STALLED, BroydenStatus.ITERATIONS)),
    (lambda x: np.log(x), [-1.0], {}, (BroydenStatus.NOT_FINITE,)),
    (lambda x: x - 1.0, [0.0], {"jacobian": np.zeros((1, 1))}, (BroydenStatus.SINGULAR,)),
    (lambda x: np.arctan(x), [1.2, -1.3], {"iterations": 1}, (BroydenStatus.ITERATIONS,)),
    (lambda x: x - 1.0, [0.0], {"jacobian": 1e12 * np.eye(1), "increment": 1e-8, "restarts": False},
     (BroydenStatus.FALSE_CONVERGENCE,)),
])
def test_failures_say_why(f, x0, keywords, status):
    """No root, no number, no slope, no patience, and a small increment far from any root."""
    found = broyden(f, x0, **keywords)
    assert not found.success and found.status in status
    assert found.status.sentence.endswith(".")
    assert np.isfinite(found.x).all()


def test_bad_name_is_named():
    """The error lists what is allowed."""
    with pytest.raises(ValueError, match="kind = 'ugly'"):
        broyden(rosenbrock, [0.0, 0.0], kind="ugly")


def test_guess_is_kept_and_a_root_costs_one_residual():
    """Nothing is done where nothing is to be done."""
    guess = np.array([1.0, 1.0])
    found = broyden(rosenbrock, guess)
    assert found.success and found.evaluations == 1 and found.iterations == 0
    broyden(rosenbrock, guess + 0.1)
    assert (guess == 1.0).all()


def test_scale_of_the_unknowns():
    """Unknowns of very different size: with their scale the path is that of the well scaled problem."""
    size = np.array([1e-6, 1e6])
    plain = broyden(rosenbrock, [-1.2, 1.0])
    scaled = broyden(lambda x: rosenbrock(x / size), size * [-1.2, 1.0], scale=size)
    assert scaled.success and scaled.iterations == plain.iterations
    assert scaled.x / size == pytest.approx([1.0, 1.0], abs=1e-9)


# how it goes: how long steps are, when a Jacobian is made, and where it stops


def test_a_given_jacobian_that_is_singular_is_the_last_word():
    """Nothing is updated yet that a new one could put right: no step, no difference."""
    for restarts in (True, False):
        found = broyden(lambda x: x - [1.0, 2.0], [0.0, 0.0], jacobian=[[1.0, 1.0], [1.0, 1.0]], restarts=restarts)
        assert (found.status, found.evaluations, found.jacobians, found.iterations) == (BroydenStatus.SINGULAR, 1, 1, 0)
        assert found.x.tolist() == [0.0, 0.0] and found.residual == found.history[0] == pytest.approx(np.sqrt(5.0))


def test_the_step_of_a_fresh_jacobian_does_not_raise_the_residual():
    """That of arctan from 1.5 does, at full length: it is halved once; a method as published takes it."""
    def slope(x):
        return np.diag(1.0 / (1.0 + x * x))

    x0 = np.array([1.5])
    full = x0 - np.arctan(x0) * (1.0 + x0 * x0)
    assert abs(full) > 1.5
    found = broyden(np.arctan, x0, jacobian=slope, iterations=1)
    assert found.x == pytest.approx(0.5 * (x0 + full)) and found.history[1] == pytest.approx(np.abs(np.arctan(found.x[0])))
    assert found.evaluations == 3 and found.increment == pytest.approx(0.5 * abs(full - x0)[0])
    published = broyden(np.arctan, x0, jacobian=slope, iterations=1, restarts=False)
    assert published.history[1] == pytest.approx(np.arctan(abs(full[0]))) and published.evaluations == 2
    assert published.x == x0 and published.residual == published.history[0]  # the best of all, not the last
    found = broyden(np.arctan, x0, jacobian=slope)
    assert found.success and abs(found.x[0]) < 1e-12


def test_a_later_step_may_raise_the_residual_tenfold():
    """The secant through the first two points of this function overshoots: by less than ten it is taken, by more it is halved."""
    for rise, halvings in ((5.0, 0), (30.0, 1)):
        seen = []

        def f(x, rise=rise, seen=seen):
            seen.append(x[0])
            return {1: np.array([1.0]), 2: np.array([0.9]), 3: np.array([0.9 * rise]), 4: np.array([0.5])}.get(len(seen), 0.0 * x)

        found = broyden(f, [0.0], jacobian=[[1.0]])
        assert seen[1] == pytest.approx(-1.0) and seen[2] == pytest.approx(-10.0)  # secant: slope .1 from 1 and .9
        if halvings:
            assert seen[3] == pytest.approx(-5.5) and found.history[2] == 0.5
        else:
            assert found.history[2] == pytest.approx(0.9 * rise) and seen[3] == pytest.approx(1.25)  # slope -.4 from there


def test_a_residual_that_does_not_fall_gets_one_new_jacobian_and_then_up():
    """|f| = 1 at the nearest: after eight steps without half the residual the Jacobian is made again, at the best point."""
    at = []

    def slope(x):
        at.append(x.copy())
        return np.array([[2.0 * x[0]]])

    found = broyden(lambda x: x * x + 1.0, [0.7], jacobian=slope)
    assert found.status is BroydenStatus.STALLED and found.jacobians == len(at) >= 2
    assert found.residual == min(found.history) == pytest.approx(found.x[0]**2 + 1.0)
    assert at[0] == 0.7 and all(abs(x[0]) <= 0.7 for x in at)
    never = broyden(lambda x: x * x + 1.0, [0.7], jacobian=slope, restarts=False, iterations=50)
    assert never.jacobians == 1 and never.status in (BroydenStatus.ITERATIONS, BroydenStatus.SINGULAR, BroydenStatus.STALLED)


def test_what_is_counted_is_what_was_done():
    """Residuals with those of differences; a given array is the first Jacobian only; one entry of the history a step."""
    calls, slopes = [], []

    def f(x):
        calls.append(x.copy())
        return rosenbrock(x)

    found = broyden(f, [-1.2, 1.0])
    assert found.success and found.evaluations == len(calls) and len(found.history) == found.iterations + 1
    assert found.history[-1] == pytest.approx(found.residual) == np.linalg.norm(rosenbrock(found.x))
    moved = np.array(calls[1:3]) - calls[0]
    assert np.count_nonzero(moved) == 2 and moved[0, 0] == pytest.approx(1e-7) == moved[1, 1]
    calls.clear()

    def slope(x):
        slopes.append(x)
        return np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])

    found = broyden(f, [-1.2, 1.0], jacobian=slope)
    assert found.jacobians == len(slopes) and found.evaluations == len(calls) and found.success
    first = broyden(rosenbrock, [-1.2, 1.0], jacobian=[[24.0, 10.0], [-1.0, 0.0]], iterations=1)
    exact = broyden(rosenbrock, [-1.2, 1.0], jacobian=slope, iterations=1)
    assert np.array_equal(first.x, exact.x) and first.evaluations == exact.evaluations
    calls.clear()
    sized = broyden(f, [1.0 + 1e-6, 1.0], size=1e9)  # small beside what is natural
    assert sized.success and sized.evaluations == 1 and sized.iterations == 0
    unsized = broyden(f, [1.0 + 1e-6, 1.0])
    assert unsized.success and unsized.iterations > 0


def test_nothing_finite_is_said_and_the_best_is_kept():
    found = broyden(lambda x: np.where(x > 0.5, x - 2.0, np.nan), [1.0], jacobian=[[-1e-3]])  # away from the root, and out
    assert found.status is BroydenStatus.STALLED and found.x.tolist() == [1.0] and found.residual == 1.0
    found = broyden(lambda x: x - 2.0, [1.0], jacobian=lambda x: np.full((1, 1), np.nan))
    assert found.status is BroydenStatus.NOT_FINITE and found.iterations == 0 and found.jacobians == 1


def test_a_small_step_is_judged_by_the_residual():
    """Stopping on the increment it must not stop on the residual; either is measured in the natural size of the unknowns."""
    found = broyden(rosenbrock, [-1.2, 1.0], increment=1e-9)
    assert found.success and found.increment < 1e-9
    loose = broyden(rosenbrock, [-1.2, 1.0], increment=1e-9, tolerance=0.5)
    assert loose.success and loose.increment < 1e-9 and loose.residual < 1e-6
    scaled = broyden(lambda x: rosenbrock(x / 1e3), [-1.2e3, 1e3], increment=1e-9, scale=1e3)
    assert scaled.iterations == found.iterations and scaled.increment == pytest.approx(found.increment, rel=1e-2)


@pytest.mark.parametrize("unit", [1e-30, 1.0, 1e30])
def test_factors_know_no_unit(unit, rng):
    """Solutions, products and updates of a Jacobian in any unit; singular is one whose columns depend on each other."""
    from bifurc.solve.broyden import Factors

    J, b, u, v = rng.normal(size=(4, 4)), rng.normal(size=4), rng.normal(size=4), rng.normal(size=4)
    factors = Factors(unit * J)
    assert not factors.singular
    assert factors.solve(unit * b) == pytest.approx(np.linalg.solve(J, b), rel=1e-10)
    assert factors.times(b) == pytest.approx(unit * (J @ b), rel=1e-10)
    factors.update(unit * u, v)
    assert factors.times(b) == pytest.approx(unit * ((J + np.outer(u, v)) @ b), rel=1e-9)
    J[:, 2] = J[:, 0] - J[:, 3]
    assert Factors(unit * J).singular
