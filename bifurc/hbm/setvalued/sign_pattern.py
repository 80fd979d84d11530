"""Sign pattern of a set-valued friction force along a trigonometric speed: exact instants, integrals in closed form.

    r(theta) = upper where s > 0, lower where s < 0,  or  clip(s/width, lower, upper)  for a width above 0,

with theta the phase, the width a speed over a force (a dashpot 1/width that gives way at the bounds), s a trigonometric
polynomial and the bounds trigonometric polynomials of low degree.  Instants are
found on a grid of eight points a wave, with the extrema between them, and polished by Newton; the Fourier coefficients of
r and of dr/ds then are integrals of products of waves between instants, so nothing is sampled and the error is rounding.
The derivative of the coefficients of r in those of s depends on the spectrum of dr/ds only (Toeplitz plus Hankel): an
indicator for a width above 0, a sum of pulses (upper - lower)/|s'| at the reversals without.

Spectra here are phasors c[k] = a - ib of c[0] + Re sum_k c[k] e^(i k theta), k = 0 .. K.
"""
from typing import NamedTuple

import numpy as np

GRID = 8  # points a wave of the highest harmonic; with extrema and polishing 32 to 512 change nothing beyond 3e-15
POLISH = 60  # limit of the safeguarded Newton iteration; bisection alone needs 52
CLOSE = 1e-9  # Newton step over the bracket after which the next would be below rounding


class Pattern(NamedTuple):
    """What a contact does in a period.

    Attributes
    ----------
    force : ndarray, shape (K + 1,), complex
        Phasors of r.
    slope : ndarray, shape (L + 1,), complex
        (1/2 pi) times the integral of dr/ds e^(-i k theta), k = 0 .. L.
    instants : ndarray, shape (m,)
        Phases in [0, 2 pi) where the kind changes, ascending.
    kinds : ndarray, shape (m,) or (1,), int
        1 at the upper bound, -1 at the lower, 0 between (only for a width above 0), 2 apart, from each instant on; one
        entry when nothing changes.
    """

    force: np.ndarray
    slope: np.ndarray
    instants: np.ndarray
    kinds: np.ndarray


def evaluate(c, theta) -> np.ndarray:
    """Return c[0] + Re sum c[k] e^(i k theta) at phases ``theta`` (m,)."""
    theta = np.asarray(theta, float)
    if len(c) <= 4:
        out = np.full(theta.shape, c[0].real)
        for k in range(1, len(c)):
            out += c[k].real * np.cos(k * theta) - c[k].imag * np.sin(k * theta)
        return out
    return (np.exp(1j * np.multiply.outer(theta, np.arange(len(c)))) @ c).real


def differentiated(c) -> np.ndarray:
    """Return the phasors of the derivative by theta."""
    return 1j * np.arange(len(c)) * c


def added(*spectra) -> np.ndarray:
    """Return the sum of spectra of different lengths."""
    total = np.zeros(max(map(len, spectra)), complex)
    for c in spectra:
        total[:len(c)] += c
    return total


def on_grid(c, count: int) -> np.ndarray:
    """Return the values at ``count`` equidistant phases from 0; count >= 2 len(c)."""
    spectrum = np.zeros(count // 2 + 1, complex)
    spectrum[:len(c)] = 0.5 * count * c
    spectrum[0] = count * c[0].real
    return np.fft.irfft(spectrum, count)


def grid_size(degree: int) -> int:
    """Return the number of grid points for a trigonometric polynomial: a power of two, at least GRID a wave."""
    return 1 << max(6, int(GRID * max(degree, 1) - 1).bit_length())


def roots(c) -> np.ndarray:
    """Return the phases in [0, 2 pi) where a trigonometric polynomial changes sign, ascending, (m,).

    Two that are closer than the grid are found through the extremum between them.
    """
    count = grid_size(len(c) - 1)
    step = 2.0 * np.pi / count
    g, dg = on_grid(c, count), on_grid(differentiated(c), count)
    size = np.abs(c).sum()
    if size == 0.0:
        return np.zeros(0)
    after, dafter = np.roll(g, -1), np.roll(dg, -1)
    positive = g > 0.0
    crossing = positive != np.roll(positive, -1)
    left = np.flatnonzero(crossing).astype(float)
    right = left + 1.0
    # an extremum toward zero inside a cell without crossing: only where a parabola of the end slopes can reach zero
    away = np.where(positive, 1.0, -1.0)
    reach = np.minimum(np.abs(g), np.abs(after)) <= 0.5 * step * np.maximum(np.abs(dg), np.abs(dafter))
    hidden = np.flatnonzero(~crossing & (away * dg < 0.0) & (away * dafter > 0.0) & reach)
    lower, upper = left * step, right * step
    if len(hidden):
        d1 = differentiated(c)
        turn = _polished(d1, hidden * step, (hidden + 1.0) * step, dg[hidden])
        through = away[hidden] * evaluate(c, turn) < 0.0
        hidden, turn = hidden[through], turn[through]
        lower = np.concatenate([lower, hidden * step, turn])
        upper = np.concatenate([upper, turn, (hidden + 1.0) * step])
    if not len(lower):
        return np.zeros(0)
    found = _polished(c, lower, upper, evaluate(c, lower) if len(hidden) else g[left.astype(int)])
    return np.sort(np.mod(found, 2.0 * np.pi))


def _polished(c, lower, upper, at_lower) -> np.ndarray:
    """Return the sign changes inside brackets (m,) by Newton, safeguarded by bisection."""
    sign = np.where(at_lower > 0.0, 1.0, -1.0)
    k = np.arange(len(c))
    pair = np.stack([c, 1j * k * c], axis=1)
    noise = 2.0 * np.finfo(float).eps * float(np.abs(c).sum())
    enough = CLOSE * (upper - lower)
    lower, upper = lower.copy(), upper.copy()
    found = np.empty(len(lower))
    left = np.arange(len(lower))
    x = 0.5 * (lower + upper)
    with np.errstate(all="ignore"):
        for _ in range(POLISH):
            both = (np.exp(1j * np.multiply.outer(x, k)) @ pair).real
            g, dg = sign * both[:, 0], sign * both[:, 1]
            inside = g > 0.0
            lower, upper = np.where(inside, x, lower), np.where(inside, upper, x)
            new = x - g / dg
            good = (new > lower) & (new < upper)
            here = np.abs(g) <= noise
            step = np.where(good, new, np.where(here, x, 0.5 * (lower + upper))) - x
            x = x + step
            done = here | (good & (np.abs(step) <= enough))
            if done.any():
                found[left[done]] = x[done]
                keep = ~done
                if not keep.any():
                    return found
                x, left, sign, enough = x[keep], left[keep], sign[keep], enough[keep]
                lower, upper = lower[keep], upper[keep]
    found[left] = x
    return found


def pattern(speed, upper, lower, width: float, top: int, slopes: int) -> Pattern:
    """Return force and derivative of a contact along a speed.

    Parameters
    ----------
    speed : array (H + 1,), complex
        Phasors of s.
    upper, lower : array (p + 1,), complex
        Phasors of the bounds; the contact is apart (r = 0) where upper < lower.
    width : float
        Of the regularisation, speed over force; 0: set-valued law, r at the reversals does not matter.
    top, slopes : int
        Highest harmonic of the force, and of the spectrum of its derivative.
    """
    half = 0.5 * added(upper, -lower)  # apart where negative
    parts = [roots(speed)] if width == 0.0 else [roots(added(speed, -width * upper)), roots(added(speed, -width * lower))]
    varies = len(half) > 1 and np.abs(half[1:]).sum() >= half[0].real
    openings = roots(half) if varies else np.zeros(0)
    instants = np.sort(np.concatenate([*parts, openings]))
    if len(instants):
        ends = np.append(instants[1:], instants[0] + 2.0 * np.pi)
    else:
        instants, ends = np.zeros(1), np.full(1, 2.0 * np.pi)
    middle, length = 0.5 * (instants + ends), ends - instants
    s, up, low = evaluate(speed, middle), evaluate(upper, middle), evaluate(lower, middle)
    kinds = np.where(up < low, 2, np.where(s >= width * up, 1, np.where(s <= width * low, -1, 0)))
    still = not np.any(speed)  # at rest all period: no sign to go by, and no force is preferred
    if width == 0.0 and still:
        kinds = np.where(up < low, 2, 0)
    degree = max(len(upper), len(lower)) - 1
    reach = max(top + degree, top + len(speed) - 1, slopes)
    k = np.arange(reach + 1)
    waves = np.exp(-1j * np.multiply.outer(k, middle)) * np.sinc(np.multiply.outer(k, length / (2.0 * np.pi)))
    waves *= length / (2.0 * np.pi)
    force = np.zeros(top + 1, complex)
    for kind, bound in ((1, upper), (-1, lower)):
        chosen = kinds == kind
        if chosen.any():
            force += _product(waves[:, chosen].sum(1), bound, top)
    slope = np.zeros(slopes + 1, complex)
    if width > 0.0:
        chosen = kinds == 0
        if chosen.any():
            indicator = waves[:, chosen].sum(1)
            force += _product(indicator, speed, top) / width
            slope = indicator[:slopes + 1] / width
    elif not still:
        at = parts[0]
        at = at[evaluate(half, at) > 0.0] if varies else at
        if len(at):
            weight = evaluate(half, at) / (np.pi * np.abs(evaluate(differentiated(speed), at)))
            slope = np.exp(-1j * np.multiply.outer(np.arange(slopes + 1), at)) @ weight
    moved = kinds != np.roll(kinds, 1)
    if len(kinds) > 1 and moved.any():
        instants, kinds = instants[moved], kinds[moved]
    else:
        instants, kinds = np.zeros(0), kinds[:1]
    return Pattern(force, slope, instants, kinds)


def _product(indicator, c, top: int) -> np.ndarray:
    """Return phasors 0 .. top of an indicator (one-sided coefficients (1/2 pi) int e^(-ik theta)) times c."""
    n = len(c) - 1
    two = np.concatenate([np.conj(c[:0:-1]) * 0.5, [c[0].real], c[1:] * 0.5])  # -n .. n
    need = top + n
    sided = np.concatenate([np.conj(indicator[n:0:-1]), indicator[:need + 1]])  # -n .. need
    full = np.convolve(sided, two) if len(two) < 256 else _fast(sided, two)
    out = 2.0 * full[2 * n:2 * n + top + 1]  # index of harmonic 0 is n + n
    out[0] = 0.5 * out[0].real
    return out


def _fast(a, b) -> np.ndarray:
    """Return the convolution by FFT, for long spectra."""
    size = 1 << (len(a) + len(b) - 1).bit_length()
    return np.fft.ifft(np.fft.fft(a, size) * np.fft.fft(b, size))[:len(a) + len(b) - 1]


def derivative_matrix(slope, waves, is_sine) -> np.ndarray:
    """Return d(coefficients of r)/d(coefficients of s), both packed by slots: (slots, slots).

    ``slope`` is `Pattern.slope` up to twice the highest harmonic; ``waves`` and ``is_sine`` are those of `Layout`.
    """
    h, k = waves[:, None], waves[None, :]
    hs, ks = is_sine[:, None], is_sine[None, :]
    c, s = slope.real, -slope.imag  # (1/2 pi) int d cos, d sin
    plus, minus, sign = h + k, np.abs(h - k), np.sign(h - k)
    cp, cm, sp, sm = c[plus], c[minus], s[plus], sign * s[minus]
    out = np.where(hs, np.where(ks, cm - cp, sp + sm), np.where(ks, sp - sm, cm + cp))
    out[waves == 0] *= 0.5
    return out
