"""Set-valued friction in harmonic balance: exact patterns, Galerkin's own floor from any start, rest, asymmetry, separation."""
import numpy as np
import pytest

from bifurc.hbm.layout import Layout
from bifurc.hbm.setvalued.douglas_rachford import split
from bifurc.hbm.setvalued.equations import Balance, Contact, Linear, SetValuedStatus
from bifurc.hbm.setvalued.full_stick import allowance
from bifurc.hbm.setvalued.sign_pattern import _polished, derivative_matrix, evaluate, pattern, roots
from bifurc.hbm.setvalued.solution import solve
from tests.reference.coulomb import SlipOnly
from tests.reference.fourier_friction import SteadyFriction


def oscillator(harmonics, omega=1.0, xi=0.1, alpha=1.4, upper=(1.0,), lower=None, listed=None):
    """Return layout, linear part and contact of Li's oscillator in physical time."""
    layout = Layout(tuple(range(harmonics + 1)) if listed is None else listed, 1)
    load = np.zeros(layout.size)
    load[layout.slot(1) + 1] = alpha
    upper = np.array(upper, complex)
    contact = Contact(np.ones(1), upper, -upper if lower is None else np.array(lower, complex))
    return layout, Linear.of(layout, omega, 1.0, 2.0 * xi, 1.0, load), [contact]


def velocity(layout, linear, contacts, found, omega=1.0):
    """Return the phasors of the speed."""
    return Balance(layout, omega, linear, contacts).speed(found.x, contacts[0])


def phasors(rng, degree):
    """Return a random spectrum."""
    c = rng.normal(size=degree + 1) + 1j * rng.normal(size=degree + 1)
    c[0] = 0.3 * rng.normal()
    return c


# rest

def test_the_room_of_a_force_is_that_of_its_bounds_and_none_where_they_are_apart():
    """Bounds N = 2 + cos t and r = .5 cos t: -(2 + c) <= .5 c + shift <= 2 + c for all c in [-1, 1].  With N = 1 + 1.5 cos t the
    contact is apart for a while, where the force is zero: a constant one must be shifted to zero, one that varies never fits."""
    layout = Layout((0, 1, 2), 1)
    row = np.ones(1)

    def room(upper, r, lower=None):
        upper = np.array(upper, complex)
        return allowance(layout, np.array(r), Contact(row, upper, -upper if lower is None else np.array(lower, complex)))

    assert room((2.0, 1.0), (0.0, 0.5, 0.0, 0.0, 0.0)) == pytest.approx((-0.5, 1.5), abs=1e-14)
    assert room((2.0, 1.0), (0.3, 0.5, 0.0, 0.0, 0.0)) == pytest.approx((-0.8, 1.2), abs=1e-14)
    assert room((2.0,), (0.0, 0.0, 0.0, 0.0, 0.5), (-1.0,)) == pytest.approx((-0.5, 1.5), abs=1e-14)
    assert room((1.0, 1.5), (0.25, 0.0, 0.0, 0.0, 0.0)) == pytest.approx((-0.25, -0.25), abs=1e-14)
    low, high = room((1.0, 1.5), (0.0, 0.0, 0.1, 0.0, 0.0))
    t = np.arccos(-2.0 / 3.0)  # apart behind it, where 0.1 sin t takes all values between those of both ends
    assert low == pytest.approx(0.1 * np.sin(t), abs=2e-3) and high == pytest.approx(-0.1 * np.sin(t), abs=2e-3)


# patterns

def test_roots_of_a_trigonometric_polynomial(rng):
    """Against the eigenvalues of the companion matrix; two roots 1e-6 apart are both found."""
    for degree in (1, 3, 9):
        c = phasors(rng, degree)
        p = np.concatenate([0.5 * c[:0:-1], [c[0].real], 0.5 * np.conj(c[1:])])  # powers of e^(i theta), highest first
        z = np.roots(p)
        z = z[np.abs(np.abs(z) - 1.0) < 1e-9]
        assert roots(c) == pytest.approx(np.sort(np.mod(np.angle(z), 2.0 * np.pi)), abs=1e-10)
    close = np.array([-np.cos(5e-7), 1.0 * np.exp(-1.234j)])  # cos(theta - 1.234) = cos 5e-7
    assert roots(close) == pytest.approx([1.234 - 5e-7, 1.234 + 5e-7], abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_a_sign_change_is_found_inside_its_bracket(seed):
    """A product of sines of half angles is zero where each is: brackets from all but one root to all but the next hold one."""
    rng = np.random.default_rng(seed)
    count = 2 * int(rng.integers(1, 6))
    zeros = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
    zeros = zeros[np.diff(zeros, prepend=zeros[-1] - 2.0 * np.pi) > 1e-2]
    zeros = zeros[:2 * (len(zeros) // 2)]
    phases = 2.0 * np.pi * np.arange(64) / 64
    values = np.prod(np.sin(0.5 * (phases[:, None] - zeros)), axis=1)
    c = np.fft.rfft(values)[:len(zeros) // 2 + 1] / 32.0
    c[0] *= 0.5
    before, after = np.append(zeros[-1] - 2.0 * np.pi, zeros[:-1]), np.append(zeros[1:], zeros[0] + 2.0 * np.pi)
    for part in (1e-3, 0.2, 0.5, 0.98):
        for other in (1e-3, 0.5, 0.98):
            lower, upper = zeros - part * (zeros - before), zeros + other * (after - zeros)
            size = np.abs(evaluate(np.arange(len(c)) * c, phases)).max()
            found = _polished(c, lower, upper, evaluate(c, lower))
            assert np.all((found > lower) & (found < upper))
            slope = np.abs(evaluate(1j * np.arange(len(c)) * c, zeros))
            np.testing.assert_array_less(np.abs(found - zeros), 1e-12 * (1.0 + size / slope))



@pytest.mark.parametrize("width", [0.0, 0.02, 0.5])
def test_coefficients_against_quadrature(rng, width):
    """Bounds that vary and vanish (separation): Gauss-Legendre on the pieces between a fine set of breaks."""
    speed, upper = phasors(rng, 6), np.array([1.0, 1.5 * np.exp(0.7j)])
    lower = -0.6 * upper
    found = pattern(speed, upper, lower, width, 9, 12)
    breaks = np.unique(np.concatenate([found.instants, [0.0, 2.0 * np.pi], np.linspace(0.0, 2.0 * np.pi, 41)]))
    nodes, weights = np.polynomial.legendre.leggauss(20)
    half = 0.5 * np.diff(breaks)[:, None]
    t, w = (0.5 * (breaks[1:] + breaks[:-1])[:, None] + half * nodes).ravel(), (half * weights).ravel()
    s, up, low = evaluate(speed, t), evaluate(upper, t), evaluate(lower, t)
    r = np.where(s > 0.0, up, low) if width == 0.0 else np.clip(s / width, np.minimum(low, up), up)
    r = np.where(up < low, 0.0, r)
    k = np.arange(10)
    expected = np.exp(-1j * np.multiply.outer(k, t)) @ (w * r) / np.pi
    expected[0] *= 0.5
    assert np.abs(found.force - expected).max() <= 1e-13


@pytest.mark.parametrize("width", [0.0, 0.1])
def test_derivative_against_dense_and_differences(rng, width):
    """Structured (Toeplitz + Hankel) against sum of 2 b b^T/|s'| at the reversals, and both laws against differences."""
    layout = Layout((0, 1, 2, 3, 5), 1)

    def spectrum(x):
        c = np.zeros(6, complex)
        c[0] = x[0]
        c[layout.positive] = x[1::2] - 1j * x[2::2]
        return c

    def coefficients(x):
        f = pattern(spectrum(x), np.ones(1, complex), -np.ones(1, complex), width, 5, 0).force
        out = np.zeros(layout.slots)
        out[0], out[1::2], out[2::2] = f[0].real, f[layout.positive].real, -f[layout.positive].imag
        return out

    x = rng.normal(size=layout.slots)
    found = pattern(spectrum(x), np.ones(1, complex), -np.ones(1, complex), width, 5, 10)
    matrix = derivative_matrix(found.slope, layout.waves, layout.is_sine)
    if width == 0.0:
        at = found.instants
        slope = np.abs(evaluate(1j * np.arange(6) * spectrum(x), at))
        B = layout.basis(at)
        dense = B.T @ (B * (2.0 / np.pi / slope)[:, None])
        dense[0] *= 0.5
        assert np.abs(matrix - dense).max() <= 1e-12 * np.abs(dense).max()
    h = 1e-5
    differences = np.array([(coefficients(x + h * e) - coefficients(x - h * e)) / (2.0 * h) for e in np.eye(len(x))]).T
    assert np.abs(matrix - differences).max() <= 1e-7 * max(np.abs(differences).max(), 1.0)


# Li's oscillator

@pytest.mark.parametrize("solver", ["newton", "broyden"])
@pytest.mark.parametrize("start", ["zero", "linear"])
@pytest.mark.parametrize(("alpha", "most"), [(1.6, 8e-3), (1.4, 7.5e-3)])
def test_published_cases_reach_galerkins_floor(alpha, most, start, solver):
    """N = 40; the published method finds one of them sometimes and the other never."""
    layout, linear, contacts = oscillator(40, alpha=alpha)
    x0 = None if start == "zero" else np.linalg.solve(linear.blocks, linear.load)
    found = solve(layout, 1.0, linear, contacts, x0, solver=solver)
    assert found.status is SetValuedStatus.CONVERGED and not found.widths.any()
    assert found.residual <= 1e-11
    v = velocity(layout, linear, contacts, found)
    state = (layout.values(found.x, [0.0])[0, 0], v.real.sum())
    error, best = SteadyFriction(1.0, 0.1, alpha, start=state).velocity_error(v)
    assert 1.5 * best < error <= most
    assert error == pytest.approx({1.6: 7.74e-3, 1.4: 6.8e-3}[alpha], rel=0.01)  # specs/friction.md C


def test_slip_only_velocity_against_the_closed_form():
    """The error by 30-digit coefficients of Den Hartog's orbit is the same as by the reference map."""
    layout, linear, contacts = oscillator(40, alpha=1.6)
    v = velocity(layout, linear, contacts, solve(layout, 1.0, linear, contacts))
    exact = 2.0 * SlipOnly(1.0, 0.1, 1.6).velocity_coefficients(range(1, 41))
    reference = SteadyFriction(1.0, 0.1, 1.6)
    lost = reference.mean_square() - 0.5 * np.sum(np.abs(exact)**2)
    error = np.sqrt((lost + 0.5 * np.sum(np.abs(v[1:] - exact)**2)) / reference.mean_square())
    assert error == pytest.approx(reference.velocity_error(v)[0], rel=1e-8)
    assert error <= 8e-3


def test_one_solution_from_anywhere(rng):
    """Strong monotonicity: random starts, first widths and the splitting end in the same speeds."""
    layout, linear, contacts = oscillator(20)
    first = solve(layout, 1.0, linear, contacts).x
    for width in (1.0, 0.1, 10.0):
        found = solve(layout, 1.0, linear, contacts, rng.normal(size=layout.size), first_width=width)
        assert found.success and np.abs(found.x - first).max() <= 1e-10
    near = split(layout, 1.0, 1.0, 0.2, 1.0, linear.load, contacts, iterations=2000)
    assert np.abs(near.x - first).max() <= 2e-3
    assert (np.abs(near.forces) <= 1.0).all()
    found = solve(layout, 1.0, linear, contacts, near.x, first_width=1e-2)
    assert found.success and np.abs(found.x - first).max() <= 1e-10


def test_only_odd_harmonics_give_the_same():
    """The symmetric orbit in half the unknowns."""
    layout, linear, contacts = oscillator(15)
    full = solve(layout, 1.0, linear, contacts)
    odd, linear, contacts = oscillator(15, listed=tuple(range(1, 16, 2)))
    half = solve(odd, 1.0, linear, contacts)
    assert np.abs(odd.moved(half.x, layout) - full.x).max() <= 1e-11


def test_scaling_of_load_and_limit():
    """(s alpha, s beta) -> s x, in nine decades."""
    layout, linear, contacts = oscillator(12)
    x = solve(layout, 1.0, linear, contacts).x
    for factor in (1e-6, 1e3):
        _, linear, contacts = oscillator(12, alpha=1.4 * factor, upper=(factor,))
        assert np.abs(solve(layout, 1.0, linear, contacts).x - factor * x).max() <= 1e-10 * factor


@pytest.mark.parametrize("omega", [1.0, 0.8, 1.0 / 3.0, 0.5])
def test_without_damping(omega):
    """No strong monotonicity: it converges all the same, also at the undamped resonance (stick-slip keeps it bounded)."""
    layout, linear, contacts = oscillator(30, omega=omega, xi=0.0, alpha=1.2)
    found = solve(layout, omega, linear, contacts)
    assert found.status is SetValuedStatus.CONVERGED
    if omega == 1.0:
        v = velocity(layout, linear, contacts, found)
        state = (layout.values(found.x, [0.0])[0, 0], v.real.sum())
        exact = SteadyFriction(1.0, 0.0, 1.2, start=state)
        assert exact.velocity_error(v)[0] <= 0.03
        assert max(abs(x0) for _, _, x0, v0, _ in exact.arcs if v0 == 0.0) == pytest.approx(0.163823617124, abs=1e-11)  # table A.2


# rest, asymmetry, load that varies

@pytest.mark.parametrize("alpha", [0.0, 0.5, 1.0])
def test_rest_below_the_limit(alpha):
    """alpha <= beta: no speed, and the mean force may be shifted by beta - alpha either way."""
    layout, linear, contacts = oscillator(10, alpha=alpha)
    found = solve(layout, 1.0, linear, contacts, np.ones(layout.size))
    assert found.status is SetValuedStatus.RESTS and found.success
    assert np.abs(found.x[1:]).max() <= 1e-14
    low, high = found.room[0]
    assert low == pytest.approx(alpha - 1.0, abs=1e-12) and high == pytest.approx(1.0 - alpha, abs=1e-12)


def test_just_above_the_limit_the_harmonics_do_not_resolve_the_slip():
    """alpha = 1.0001: slip lasts .04 rad of the period; 10 harmonics hold the mass, and the status says that it is so."""
    layout, linear, contacts = oscillator(10, alpha=1.0001)
    found = solve(layout, 1.0, linear, contacts)
    assert found.status is SetValuedStatus.HELD
    assert np.abs(velocity(layout, linear, contacts, found)).max() <= 1e-8
    assert "more harmonics" in found.status.sentence


def test_asymmetric_friction():
    """Moves iff 2 alpha > beta+ + beta-; the mean is -(beta+ - beta-)/2 and the extrema are those of the table A.2."""
    layout, linear, contacts = oscillator(60, alpha=1.4, lower=(-0.5,))
    found = solve(layout, 1.0, linear, contacts)
    assert found.status is SetValuedStatus.CONVERGED
    assert found.x[0] == pytest.approx(-0.25, abs=1e-9)
    x = layout.values(found.x, np.linspace(0.0, 2.0 * np.pi, 4001))
    assert x.max() == pytest.approx(1.96786299137, abs=2e-3) and x.min() == pytest.approx(-2.46786299137, abs=2e-3)
    layout, linear, contacts = oscillator(10, alpha=0.74, lower=(-0.5,))
    assert solve(layout, 1.0, linear, contacts).status is SetValuedStatus.RESTS
    layout, linear, contacts = oscillator(60, alpha=0.80, lower=(-0.5,))
    assert solve(layout, 1.0, linear, contacts).status is SetValuedStatus.CONVERGED


def test_load_that_varies_and_separates():
    """beta(tau) = max(0, 1 + 1.5 cos(tau + .7)): extrema of the table A.2; the error falls with the harmonics."""
    errors = []
    for harmonics in (20, 80):
        layout, linear, contacts = oscillator(harmonics, alpha=1.4, upper=(1.0, 1.5 * np.exp(0.7j)))
        found = solve(layout, 1.0, linear, contacts)
        assert found.status is SetValuedStatus.CONVERGED
        assert 2 in found.patterns[0].kinds  # apart
        x = layout.values(found.x, np.linspace(0.0, 2.0 * np.pi, 8001))
        errors.append(max(abs(x.max() - 1.65227279125), abs(x.min() + 0.274666817)))
    assert errors[1] <= 2e-3 and errors[1] < 0.4 * errors[0]


@pytest.mark.parametrize("unit", [1e-14, 1.0, 1e14])
def test_limits_that_vanish(unit):
    """No friction is the linear response, from any guess; 1e-12 of it changes nothing: of loads in any unit."""
    layout, linear, contacts = oscillator(10, alpha=1.4 * unit, upper=(0.0,))
    free = np.linalg.solve(linear.blocks, linear.load)
    for guess in (None, 0.5 * free, -3.0 * free):
        found = solve(layout, 1.0, linear, contacts, guess)
        assert found.success and np.abs(found.x - free).max() <= 1e-12 * unit and found.residual <= 1e-11 * unit
    layout, linear, contacts = oscillator(10, alpha=1.4 * unit, upper=(1e-12 * unit,))
    found = solve(layout, 1.0, linear, contacts)
    assert found.success and np.abs(found.x - free).max() <= 1e-10 * unit


# several

def two_masses(harmonics, load, limits, omega=1.1):
    """A chain wall - 1 - 2, friction to the ground on mass 1 and between the masses."""
    layout = Layout(tuple(range(harmonics + 1)), 2)
    f = np.zeros((layout.slots, 2))
    f[layout.slot(1) + 1] = load
    rows = (np.array([1.0, 0.0]), np.array([-1.0, 1.0]))
    contacts = [Contact(row, np.array([limit + 0j]), np.array([-limit + 0j])) for row, limit in zip(rows, limits, strict=True)]
    matrices = np.eye(2), np.array([[0.25, -0.1], [-0.1, 0.1]]), np.array([[3.0, -1.0], [-1.0, 1.0]])
    return layout, matrices, f.ravel(), contacts


def test_two_contacts_against_the_splitting():
    """Two algorithms that share no equation: sampled projections, and exact patterns with Newton."""
    layout, matrices, load, contacts = two_masses(12, (0.5, 1.5), (0.3, 0.5))
    found = solve(layout, 1.1, Linear.of(layout, 1.1, *matrices, load), contacts)
    assert found.status is SetValuedStatus.CONVERGED and not found.widths.any()
    other = split(layout, 1.1, *matrices, load, contacts, iterations=5000)
    assert np.abs(other.x - found.x).max() <= 5e-3 * np.abs(found.x).max()


def test_one_contact_held_all_period():
    """A strong contact between the masses: they move as one, and the force that ties them is inside its bounds."""
    layout, matrices, load, contacts = two_masses(12, (0.5, 1.5), (0.3, 50.0))
    found = solve(layout, 1.1, Linear.of(layout, 1.1, *matrices, load), contacts)
    assert found.status is SetValuedStatus.CONVERGED
    q = layout.matrix(found.x)
    assert np.abs(q[1:, 0] - q[1:, 1]).max() <= 1e-8
    M, C, K = (matrix.sum() for matrix in matrices)  # one mass
    single, one = Layout(layout.harmonics, 1), np.zeros(layout.slots)
    one[layout.slot(1) + 1] = 2.0
    alone = solve(single, 1.1, Linear.of(single, 1.1, M, C, K, one), [Contact(np.ones(1), contacts[0].upper, contacts[0].lower)])
    assert np.abs(alone.x[1:] - q[1:, 0]).max() <= 1e-7
    assert len(found.patterns[1].instants) == 0 and len(found.patterns[0].instants) > 0


def test_redundant_contacts_share_a_row():
    """Two contacts on one row are one with the sum of the limits: no mobility has to be inverted."""
    layout, linear, _ = oscillator(10)
    both = [Contact(np.ones(1), np.array([limit + 0j]), np.array([-limit + 0j])) for limit in (0.3, 0.7)]
    found = solve(layout, 1.0, linear, both)
    one = solve(*oscillator(10)[:1], 1.0, linear, oscillator(10)[2])
    assert np.abs(found.x - one.x).max() <= 1e-10


def test_moving_belt_slips_all_period():
    """Drift above the speeds of the mass: constant friction, no reversal; x is the linear response about a shifted mean."""
    layout, linear, _ = oscillator(8, alpha=0.2)
    belt = Contact(np.ones(1), np.ones(1, complex), -np.ones(1, complex), np.array([-5.0 + 0j]))
    found = solve(layout, 1.0, linear, [belt])
    free = np.linalg.solve(linear.blocks, linear.load)
    free[0] = 1.0
    assert found.success and np.abs(found.x - free).max() <= 1e-9


@pytest.mark.parametrize("mean, wave", [(1.0, 0.4), (0.5, 1.2)])
def test_a_reversal_counts_with_the_load_it_meets_and_not_where_the_contact_is_apart(mean, wave):
    """s = cos t turns at pi / 2 and 3 pi / 2, where mu N is mean - wave and mean + wave: pulses of twice that over |s'| = 1."""
    bound = np.array([mean, 1j * wave])  # mean - wave sin t
    found = pattern(np.array([0.0, 1.0 + 0j]), bound, -bound, 0.0, 4, 8)
    k = np.arange(9)
    want = sum(2.0 * max(load, 0.0) * np.exp(-1j * k * at) for load, at in ((mean - wave, 0.5 * np.pi), (mean + wave, 1.5 * np.pi)))
    np.testing.assert_allclose(found.slope, want / (2.0 * np.pi), atol=1e-12)
    t = 2.0 * np.pi * (np.arange(200000) + 0.5) / 200000
    force = np.maximum(mean - wave * np.sin(t), 0.0) * np.sign(np.cos(t))
    for h in range(5):
        phasor = (2.0 if h else 1.0) * (force * np.exp(-1j * h * t)).mean()
        assert found.force[h] == pytest.approx(phasor if h else phasor.real, abs=1e-4)
