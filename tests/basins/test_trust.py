"""What a basin map says about itself: entropies, uncertainty, errors, trust, mirror images, infinity, parts of it."""
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import linregress

import bifurc as bf
from bifurc.basins.maps.basin_map import CellState
from bifurc.basins.maps.entropy import basin_entropy
from bifurc.basins.maps.reliability import ReliabilityKind, fraction_errors, reliability
from bifurc.basins.maps.uncertainty_exponent import fitted, uncertainty_exponent
from bifurc.ensemble.outcomes import DIVERGED, REACHED, UNSETTLED

A = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
B = bf.systems.impact_oscillator(zeta=0.05, omega=4.25, amplitude=1.0, gap=0.1, restitution=0.8)


def slow_entropy(labels, side, starts):
    """Box by box, in plain Python."""
    values = []
    for i in range(0, labels.shape[0] - side + 1, side):
        for j in range(0, labels.shape[1] - side + 1, side):
            box = [labels[a, b] for a in range(i, i + side) for b in range(j, j + side) if starts[a, b]]
            if box:
                shares = [box.count(label) / len(box) for label in set(box)]
                values.append((-sum(p * np.log(p) for p in shares), len(shares)))
    mixed = [value for value, kinds in values if kinds > 1]
    return sum(v for v, _ in values) / len(values), sum(mixed) / len(mixed) if mixed else 0.0, len(values), len(mixed)


@pytest.mark.parametrize("side", [1, 2, 5, 7])
def test_entropy_against_a_second_implementation(rng, side):
    labels = rng.integers(-1, 3, (43, 38))
    labels[:, :20] = 0
    starts = rng.random(labels.shape) < 0.8
    starts[:14] = False
    found = basin_entropy(labels, side, starts)
    np.testing.assert_allclose(found[:4], slow_entropy(labels, side, starts), rtol=0, atol=1e-12)


def test_entropy_of_one_colour_of_stripes_and_of_noise(rng):
    assert basin_entropy(np.zeros((10, 10), int))[:4] == (0.0, 0.0, 4, 0)
    stripes = np.tile([0, 1], (8, 4))
    found = basin_entropy(stripes, 2)
    np.testing.assert_allclose(found[:2], np.log(2.0), rtol=1e-14)
    assert found.fractal is None  # equal to ln 2 proves nothing
    noise = basin_entropy(rng.integers(0, 3, (300, 300)))
    assert abs(noise.basin - np.log(3.0)) < 0.06 and noise.fractal is True
    cube = basin_entropy(rng.integers(0, 2, (6, 6, 6)), 3)
    assert cube.boxes == 8


@pytest.mark.parametrize("side", [0, 1.5, True, 11])
def test_sides_that_cannot_be(side):
    with pytest.raises(ValueError, match="side = "):
        basin_entropy(np.zeros((10, 20), int), side)


def smooth(points):
    return (points[:, 0] > 0.3 * np.sin(3 * points[:, 1])).astype(int)


def cantor(points):
    """Stripes at all scales: the digit 1 appears first at an odd or even place of the base-3 expansion; alpha = 1 - ln 2 / ln 3."""
    x, label = np.mod(points[:, 0], 1.0), np.zeros(len(points), int)
    open_ = np.ones(len(points), bool)
    for place in range(1, 30):
        x = 3 * x
        digit = np.floor(x)
        label[open_ & (digit == 1)] = 1 + place % 2
        open_ &= digit != 1
        x -= digit
    return label


@pytest.mark.parametrize(("law", "exponent", "low"), [(smooth, 1.0, 1e-3), (cantor, 1 - np.log(2) / np.log(3), 1e-5)])
def test_uncertainty_exponents_that_are_known(law, exponent, low):
    basins = SimpleNamespace(grid=bf.Grid(q0=(-1, 1, 4), v0=(-1, 1, 4)), attractors=(1, 2), system=A,
                             labeller=lambda workers, executor: law)
    found = uncertainty_exponent(basins, low, 3e-2, rungs=8, samples=40000, seed=3)
    assert abs(found.exponent - exponent) <= 3.0 * found.error and found.error < 0.04
    assert found.boundary_dimension == 2 - found.exponent


def test_the_fit_is_the_weighted_line_and_its_error_covers(rng):
    sizes = np.geomspace(1e-4, 1e-1, 7)
    law = 0.5 * sizes**0.4
    slopes, errors = [], []
    for _ in range(400):
        counts = rng.binomial(5000, law)
        slope, error, misfit = fitted(sizes, counts, np.full(7, 5000))
        slopes.append(slope)
        errors.append(error / max(misfit, 1.0))
    assert abs(np.mean(slopes) - 0.4) < 0.002
    assert 0.85 < np.std(slopes) / np.mean(errors) < 1.2
    plain = linregress(np.log(sizes), np.log(law)).slope
    np.testing.assert_allclose(fitted(sizes, law * 1e12, np.full(7, 1e12))[0], plain, rtol=1e-9)
    assert fitted(sizes, np.zeros(7), np.ones(7)) == (1.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def problem_a():
    return bf.basins_of_attraction(A, bf.Grid(q0=(-2.5, 0, 400), v0=(-3, 3, 400)))


@pytest.fixture(scope="module")
def problem_b():
    return bf.basins_of_attraction(B, bf.Grid(q0=(-2.4, 0.1, 400), v0=(-3, 3, 400)))


def test_entropies_and_exponents_of_the_references(problem_a, problem_b):
    np.testing.assert_allclose(problem_a.entropy()[:2], (0.1701, 0.5016), rtol=0, atol=5e-5)
    np.testing.assert_allclose(problem_b.entropy()[:2], (0.6044, 0.6319), rtol=0, atol=2e-3)  # labels differ in 4 % of cells
    a, b = problem_a.uncertainty(), problem_b.uncertainty()
    assert abs(a.exponent - 0.92) <= 0.06 and a.error <= 0.03
    assert abs(b.exponent - 0.077) <= 0.01 and b.error <= 0.005
    assert repr(b).startswith("Uncertainty(exponent 0.0")


def test_the_map_says_what_it_promises(problem_a, problem_b):
    assert problem_a.reliability.kind is ReliabilityKind.CELLS and problem_a.reliability.wrong < 1e-3
    assert problem_b.reliability.kind is ReliabilityKind.FRACTIONS
    with pytest.warns(DeprecationWarning, match="BasinMap.reliability"):
        assert problem_b.trust is problem_b.reliability
    assert 0.045 / 1.5 <= problem_b.reliability.wrong / 160000 <= 0.045 * 1.5
    assert "No single label is promised" in problem_b.report() and "Fractions hold: 0.44" in problem_b.report()
    assert "Every label can be trusted" in problem_a.report() and "boundary entropy 0.5016" in problem_a.report()
    few = SimpleNamespace(starts=np.ones((10, 10), bool), labels=np.zeros((10, 10), int), label_uncertainty=7e-4,
                          states=np.zeros((10, 10), int), fractions={0: 1.0}, noise=SimpleNamespace(exponent=0.5, size=5e-16))
    assert reliability(few).kind is ReliabilityKind.CELLS
    few.starts = np.ones((100, 100), bool)
    few.labels, few.states = np.zeros((100, 100), int), np.zeros((100, 100), int)
    assert reliability(few).kind is ReliabilityKind.MOST_CELLS and "about 7 of 10000" in reliability(few).statement


def test_starts_without_a_label_are_no_certainty():
    """63 % of unresolved starts, some, or no start at all: nothing says that every label can be trusted."""
    made = SimpleNamespace(starts=np.ones((10, 100), bool), labels=np.zeros((10, 100), int), label_uncertainty=0.0,
                           states=np.full((10, 100), REACHED), fractions={0: 0.37, -1: 0.63},
                           noise=SimpleNamespace(exponent=1.0, size=5e-16))
    made.labels.ravel()[:630], made.states.ravel()[:630] = -1, UNSETTLED
    assert reliability(made).kind is ReliabilityKind.UNRESOLVED and reliability(made).unresolved == 630
    assert "630 of 1000 starts (63 %) have no label" in reliability(made).statement and "Every" not in reliability(made).statement
    made.labels.ravel()[2:630], made.states.ravel()[2:630] = 0, REACHED
    assert reliability(made).kind is ReliabilityKind.CELLS
    assert "2 of 1000 starts (0.2 %) have no label" in reliability(made).statement
    made.states.ravel()[:2] = DIVERGED  # infinity is where a start leads
    assert reliability(made).unresolved == 0 and "no label" not in reliability(made).statement
    made.starts[:] = False
    assert reliability(made).kind is ReliabilityKind.NO_STARTS and "Every" not in reliability(made).statement


def test_errors_of_fractions_hold_the_fractions_of_finer_grids(problem_a, problem_b):
    for fine in (problem_a, problem_b):
        thin = fine.labels[2::5, 2::5]  # 80 x 80 cells of the same region, centred alike
        errors = fraction_errors(thin, np.ones(thin.shape, bool))
        assert abs(np.mean(thin == 0) - fine.fractions[0]) <= 3.0 * errors[0]
        assert errors[0] < 0.01


def test_a_zoom_keeps_attractors_and_numbers(problem_a):
    part = problem_a.zoom(q0=(-1.25, -0.625), cells=100)
    assert part.grid.names == ("q0", "v0") and part.grid.shape == (100, 100)
    assert part.attractors == problem_a.attractors
    whole = problem_a.zoom(cells=400)
    np.testing.assert_array_equal(whole.labels, problem_a.labels)
    with pytest.raises(ValueError, match="q1 is no component"):
        problem_a.zoom(q1=(0, 1))


def test_the_least_impact_speed_of_each_cell_is_that_of_its_simulated_motion():
    basins = bf.basins_of_attraction(A, bf.Grid(q0=(-2.5, 0, 12), v0=(-3, 3, 12)))
    for cell in (0, 50, 77, 140):
        motion = bf.simulate(A, basins.grid.starts(1, 2)[cell], periods=int(basins.periods.flat[cell]))
        hits = [abs(event.speed) for event in motion.events if event.kind == "impact"]
        np.testing.assert_allclose(basins.speeds.flat[cell], min(hits), rtol=0, atol=1e-9)


def test_mirror_images_are_named():
    system = bf.systems.two_sided_impact_oscillator(amplitude=3.45)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-1, 1, 16), v0=(-3, 3, 16)))
    assert basins.partners == {0: 1, 1: 0} and "mirror image of 1" in basins.report()
    symmetric = bf.basins_of_attraction(system.with_parameters(amplitude=3.0), bf.Grid(q0=(-1, 1, 6), v0=(-3, 3, 6)))
    assert symmetric.partners == {0: 0} and ", symmetric" in symmetric.report()
    assert bf.basins_of_attraction(A, bf.Grid(q0=(-2, 0, 3), v0=(-1, 1, 3))).partners == {}


def test_attractors_closer_than_the_tolerance_are_told_apart():
    """The mirrored orbits above the pitchfork lie within a tolerance of .1: radii shrink until their shells come back."""
    system = bf.systems.two_sided_impact_oscillator(amplitude=3.402)
    grid = bf.Grid(q0=(-1, 1, 16), v0=(-3, 3, 16))
    wide, narrow = (bf.basins_of_attraction(system, grid, tolerance=size) for size in (0.1, 1e-4))
    gap = min(np.linalg.norm((wide.attractors[0].state - y) / wide.scale) for y in wide.attractors[1].sample(2)[1])
    assert gap < 0.1 and max(wide.radii) < gap
    np.testing.assert_array_equal(wide.labels, narrow.labels)


def test_infinity_is_a_label_of_its_own():
    """A softening spring lets large starts escape; without a stop and without friction they never come back."""
    system = bf.System(1.0, 0.2, 1.0, [bf.elements.CubicSpring(-1.0), bf.elements.HarmonicForce(0.05)], omega=0.5)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-2, 2, 8), v0=(-2, 2, 8)), max_periods=200)
    assert basins.fractions[-1] == 0.0 and 0.2 < basins.fractions[CellState.DIVERGED] < 0.8
    assert basins.fractions[0] + basins.fractions[CellState.DIVERGED] == 1.0
    assert basins.entropy(4).mixed == basins.entropy(4).boxes == 4
    assert "left the finite numbers" in basins.report()
    assert 0.0 < basins.label_uncertainty < 1e-6 and basins.noise.samples > 0  # the boundary to infinity counts


def test_one_and_three_components():
    line = bf.basins_of_attraction(A, bf.Grid(v0=(-3, 3, 60), at={"q0": -1.0}))
    plane = bf.basins_of_attraction(A, bf.Grid(q0=(-1.5, -0.5, 1), v0=(-3, 3, 60)))
    np.testing.assert_array_equal(line.labels, plane.labels[0])
    assert line.labels.shape == (60,) and "BasinMap(60 cells" in repr(line)
    chain = bf.systems.impact_chain(n=2, omega=0.6, amplitude=0.5)
    space = bf.basins_of_attraction(chain, bf.Grid(q0=(-0.5, 0.5, 2), q1=(-0.5, 0.5, 3), v1=(-1, 1, 2)), max_periods=500)
    assert space.labels.shape == (2, 3, 2) and space.fractions[-1] == 0.0


def test_the_duffing_oscillator_at_245_promises_fractions_only():
    """Two integrators with errors of 2e-9 and 1e-15 a period disagreed on 37 % of the cells (specification)."""
    system = bf.systems.duffing_oscillator(zeta=0.075, alpha=-1.0, beta=1.0, amplitude=0.245, omega=1.0)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-2.2, 2.2, 60), v0=(-2.2, 2.2, 60)))
    found = basins.uncertainty()
    assert abs(found.exponent - 0.026) <= 0.005 and found.error <= 0.005
    assert 1e-13 <= basins.noise.size <= 2e-9 and "a period alone is expected to change" in basins.reliability.statement
    assert 0.37 / 1.5 <= basins.label_uncertainty <= 0.37 * 1.5
    assert basins.entropy().fractal is True and basins.partners == {0: 1, 1: 0, 2: 2}


def test_a_chaotic_attractor_beside_a_periodic_one_has_a_smooth_boundary():
    system = bf.systems.duffing_oscillator(zeta=0.075, alpha=-1.0, beta=1.0, amplitude=0.3, omega=1.0)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-2.2, 2.2, 400), v0=(-2.2, 2.2, 400)))
    assert abs(basins.fractions[0] - 0.3728) <= 1e-4 and basins.fractions[-1] == 0.0
    np.testing.assert_allclose(basins.entropy()[:2], (0.0236, 0.5014), rtol=0, atol=1e-3)
    assert basins.reliability.kind is ReliabilityKind.CELLS


def test_error_of_a_fraction_with_a_straight_boundary():
    """Beside it two of three neighbours are alike: variance 2/9 for every cell of the two columns; elsewhere none."""
    labels = np.zeros((30, 40), int)
    labels[:, 17:] = 1
    errors = fraction_errors(labels, np.ones(labels.shape, bool))
    assert errors == pytest.approx({0: np.sqrt(60 * 2 / 9) / 1200, 1: np.sqrt(60 * 2 / 9) / 1200}, rel=1e-12)


def test_the_error_of_an_exponent_grows_with_the_misfit_of_the_law():
    """Counts that lie off the power law by a fifth, one above and one below: the counting error is widened by the misfit."""
    sizes, totals = np.geomspace(1e-4, 3e-2, 6), np.full(6, 20000.0)
    law = 0.3 * np.sqrt(sizes)
    slope, plain, none = fitted(sizes, law * totals, totals)
    assert slope == pytest.approx(0.5, rel=1e-9) and none < 1e-6
    rough = law * np.array([1.2, 0.8, 1.2, 0.8, 1.2, 0.8])
    _, error, misfit = fitted(sizes, rough * totals, totals)
    assert misfit > 3.0
    assert error == pytest.approx(plain * misfit, rel=0.1)


def test_the_fitted_law_is_that_of_the_largest_likelihood(rng):
    """Binomial counts, also of large shares: against a search for the maximum of the likelihood itself; the error is the root of
    its inverse curvature, which sums totals p / (1 - p) (x - centre)^2."""
    sizes, totals = np.geomspace(1e-3, 0.5, 7), np.full(7, 3000.0)
    x = np.log(sizes)
    for exponent in (0.2, 0.5, 0.9):
        counts = rng.binomial(3000, 0.95 * (sizes / sizes[-1])**exponent).astype(float)
        slope, error, misfit = fitted(sizes, counts, totals)

        def loss(law, counts=counts):
            logs = law[0] + law[1] * (x - x[-1])
            with np.errstate(all="ignore"):
                value = -(counts * logs + (totals - counts) * np.log1p(-np.exp(logs))).sum()
            return value if np.isfinite(value) else 1e12

        found = minimize(loss, (np.log(0.9), exponent), method="Nelder-Mead",
                         options={"xatol": 1e-10, "fatol": 1e-9, "maxiter": 4000})
        assert slope == pytest.approx(found.x[1], abs=2e-6)
        p = np.exp(found.x[0] + found.x[1] * (x - x[-1]))
        weights = totals * p / (1.0 - p)
        spread = (weights * (x - (weights @ x) / weights.sum())**2).sum()
        assert error == pytest.approx(max(misfit, 1.0) / np.sqrt(spread), rel=1e-5)
