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
