"""Trigonometric polynomials in compiled kernels against plain sums, for lists of harmonics with and without gaps."""
import numpy as np
import pytest

from bifurc.hbm import waves as kernels
from bifurc.hbm.contacts import spectra

LISTS = [(1,), (1, 2, 3), (1, 3, 5, 6), (2, 4), (3, 7, 8, 19)]


@pytest.fixture(params=LISTS, ids=str)
def listed(request):
    """Return the harmonics of internal slots: mean, then cosine and sine of each."""
    return np.array([0, *(k for k in request.param for _ in "cs")])


def basis(waves, theta, order=0):
    """Return derivatives of the waves of all slots at angles, (..., mi)."""
    quarter = np.where(np.arange(waves.size) % 2 == 1, 0.0, -0.5 * np.pi)
    angle = np.multiply.outer(np.asarray(theta), waves) + quarter + 0.5 * np.pi * order
    out = waves.astype(float)**order * np.cos(angle)
    out[..., 0] = 1.0 if order == 0 else 0.0
    return out


def test_values_and_derivatives(listed, rng):
    top = 2 * listed[-1] + 1
    for theta in rng.uniform(-1.0, 8.0, 6):
        a = rng.normal(size=listed.size)
        p, turned = np.empty((top, 2)), np.empty(listed.size)
        kernels.powers(theta, top, p)
        angle = np.arange(top) * theta
        assert p == pytest.approx(np.column_stack([np.cos(angle), np.sin(angle)]), abs=1e-13)
        exact = [basis(listed, theta, order) @ a for order in range(4)]
        assert kernels.jet(listed, a, p) == pytest.approx(exact, rel=1e-11, abs=1e-11)
        assert kernels.value(listed, a, theta) == pytest.approx(exact[:2], abs=1e-11)
        assert kernels.turn(listed, a, theta) == pytest.approx(exact[1:3], abs=1e-10)
        kernels.turned(listed, a, turned)
        assert basis(listed, theta) @ turned == pytest.approx(exact[1], abs=1e-11)
        kernels.turned(listed, turned, again := np.empty(listed.size))
        assert basis(listed, theta) @ again == pytest.approx(exact[2], abs=1e-10)


def test_the_bound_is_that_of_phasors(listed, rng):
    a = rng.normal(size=listed.size)
    theta = np.linspace(0.0, 2.0 * np.pi, 2000)
    bound = kernels.size(a)
    assert np.abs(basis(listed, theta) @ a).max() <= bound
    assert bound == pytest.approx(abs(a[0]) + sum(abs(complex(*a[j:j + 2])) for j in range(1, a.size, 2)), rel=1e-14)


def test_multiplication_by_a_signal(listed, rng):
    """Coefficients of a product of two polynomials, of a product with one wave, and of the signal, against Fourier sums."""
    top = int(listed[-1])
    N = 8 * top + 8
    theta = 2.0 * np.pi * np.arange(N) / N
    signal = rng.normal() + sum(rng.normal() * np.cos(l * theta) + rng.normal() * np.sin(l * theta) for l in range(1, 2 * top + 2))
    L = 2 * top + 1
    T = np.array([[(signal * np.cos(l * theta)).mean(), (signal * np.sin(l * theta)).mean()] for l in range(L)])
    a = rng.normal(size=listed.size)
    place = rng.permutation(listed.size)[:max(3, listed.size - 2)]
    weights = np.where(listed == 0, 1.0, 2.0)

    def analysed(values):
        return (weights * (basis(listed, theta) * values[:, None]).mean(axis=0))[place]

    B, even, odd = np.zeros((place.size, listed.size)), np.empty(2 * L - 1), np.empty(2 * L - 1)
    kernels.both_ways(T, even, odd)
    for row, slot in zip(B, place.tolist(), strict=True):
        kernels.spectrum_row(even, odd, listed, slot, row)
    assert B @ a == pytest.approx(analysed(signal * (basis(listed, theta) @ a)), abs=1e-12)
    out = np.empty(place.size)
    spectra.coefficients(T, listed, place, out)
    assert out == pytest.approx(analysed(signal), abs=1e-12)
    for slot in range(1, listed.size):
        spectra.modulated(T, listed, place, slot, out)
        assert out == pytest.approx(analysed(signal * basis(listed, theta)[:, slot]), abs=1e-12)


@pytest.mark.parametrize("samples", (0, 64, 37))
def test_spectrum_of_an_interval(samples, rng):
    """Integrals over a segment, or sums over the samples in it: end samples belong to what follows."""
    L = 15
    D, out, Ea, Eb = np.empty((L, 2)), np.empty((L, 2)), np.empty((L, 2)), np.empty((L, 2))
    spectra.divisors(L, samples, D)
    for _ in range(5):
        a, b = np.sort(rng.uniform(0.0, 2.0 * np.pi, 2))
        if samples:
            i, j = np.sort(rng.choice(samples, 2, replace=False))
            a, b = 2.0 * np.pi * i / samples, 2.0 * np.pi * j / samples
            at = 2.0 * np.pi * np.arange(i, j) / samples
            exact = [[np.cos(l * at).sum() / samples, np.sin(l * at).sum() / samples] for l in range(L)]
        else:
            exact = [[(b - a) / (2.0 * np.pi), 0.0]] + [[(np.sin(l * b) - np.sin(l * a)) / (2.0 * np.pi * l),
                                                        (np.cos(l * a) - np.cos(l * b)) / (2.0 * np.pi * l)] for l in range(1, L)]
        kernels.powers(a, L, Ea)
        kernels.powers(b, L, Eb)
        spectra.indicator(a, b, Ea, Eb, D, out)
        assert out == pytest.approx(np.array(exact), abs=1e-13)
        assert spectra.nonzero(out) and not spectra.nonzero(np.zeros((L, 2)))
        total = np.ones((L, 2))
        spectra.add(total, -1.5, out)
        assert total == pytest.approx(1.0 - 1.5 * out, abs=1e-15)
