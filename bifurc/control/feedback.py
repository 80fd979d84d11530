"""Which gains of a delayed feedback make an orbit stable: `feedback_range`, and the multipliers at one gain.

A force K (s(t - T) - s(t)) with the period T of the orbit vanishes on it (Pyragas 1992): the orbit does not change, its
stability does.  With memory R, K sum R^(k-1) (s(t - k T) - s(t - (k-1) T)) (Socolar, Sukow, Gauthier 1994).
"""
import math

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from ..checks import FED, POSITIVE, RATIO, checked, number, of, whole
from ..orbits.orbit import PeriodicOrbit
from .characteristic import Characteristic, OnCircle
from .collocated import Collocated
from .impact_order import ImpactOrder
from .linearization import Linearization, NotSupported, linearized
from .results import EndKind, FeedbackEnd, FeedbackRange, FeedbackStatus

SAMPLES = 129  # gains at which the largest multiplier is looked at first
ITERATED = 2e-3  # largest relative error of growths from iteration


@checked(of=FED, row=None, memory=RATIO, delay=POSITIVE, samples=of(whole, least=5, most=10**8))
def feedback_range(orbit: PeriodicOrbit, of: str = "displacement", bounds=(0.0, 1.0), *, row=0, memory: float = 0.0,
                   delay: float | None = None, samples: int = SAMPLES) -> FeedbackRange:
    """Return the intervals of the gain in which a delayed feedback makes a periodic orbit stable.

    Parameters
    ----------
    orbit : PeriodicOrbit
    of : {"displacement", "velocity"}
        What is fed back: the force is K (s(t - T) - s(t)), with s the coordinate or its velocity.
    bounds : pair of float
        Of the gain K: force per length, or per speed.
    row : int, sequence of float (n,), or sequence of such (m, n)
        Degree of freedom that is measured and pushed, or n factors of the coordinates; several rows are each fed back to
        itself with the same gain, such as ``((1, 0), (0, 1))`` for both coordinates of a rotor.
    memory : float
        R of the extended feedback, 0 <= R < 1; 0: plain.
    delay : float, optional
        In periods of the orbit, a whole number; default 1.
    samples : int
        Gains that are looked at first; an interval narrower than their distance is found where the largest multiplier has
        its extremum.

    Returns
    -------
    FeedbackRange
        With ``intervals``, their located ends, the best gain, and a status that says why there is none.

    Raises
    ------
    ValueError
        Arguments out of range, a delay that is no multiple of the period, a failed orbit.
    NotSupported
        Orbits with complete chattering or without a clock; velocity feedback where the velocity jumps more than three times a
        period, or with memory or a delay of several periods.

    References
    ----------
    K. Pyragas, Phys. Lett. A 170 (1992) 421; J. E. S. Socolar, D. W. Sukow, D. J. Gauthier, Phys. Rev. E 50 (1994) 3245;
    H. Nakajima, Phys. Lett. A 232 (1997) 207 (odd-number limitation).

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator(omega=2.5, amplitude=12.0)
    >>> orbit = bf.find_orbit(system, guess=(-4.0, 8.4))
    >>> found = bf.control.feedback_range(orbit, "displacement", (0.0, 0.2))
    >>> [round(end.gain, 6) for end in found.ends]
    [0.008897, 0.112742]
    """
    low, high = _bounds(bounds)
    memory = number("feedback_range", "memory", memory, least=0.0)
    if memory >= 1.0:
        raise ValueError(f"feedback_range: memory = {memory!r} is not allowed; it must be at least 0 and below 1")
    if isinstance(samples, bool) or not isinstance(samples, int | np.integer) or samples < 5:
        raise ValueError(f"feedback_range: samples = {samples!r} is not allowed; it must be a whole number of at least 5")
    repeats = _repeats(delay)
    linear = linearized(orbit, of, row, max(abs(low), abs(high)))
    if odd_number(linear):
        return FeedbackRange(orbit, of, (low, high), memory, (), (), None, None, FeedbackStatus.ODD_NUMBER, *_curve())
    if linear.jumping:
        if memory or repeats != 1:
            what = f"memory {memory:g}" if memory else f"a delay of {repeats} periods"
            raise NotSupported(f"velocity feedback with {what} where the velocity jumps (impact of {linear.jumping[0].label!r}) is "
                               "not treated: pulses of several ages would overlap; use displacement, or simulate")
        analysis: _Smooth | _Jumping = _Jumping(linear)
    else:
        analysis = _Smooth(linear, memory, repeats)
    return _scan(orbit, of, (low, high), memory, analysis, int(samples))


@checked(of=FED, row=None, memory=RATIO, least=POSITIVE)
def controlled_multipliers(orbit: PeriodicOrbit, of: str, gain: float, *, row=0, memory: float = 0.0,
                           least: float = 0.1) -> np.ndarray:
    """Return all multipliers above a modulus that an orbit has under delayed feedback, largest first.

    Candidates are eigenvalues of the collocated monodromy operator, each is polished on the characteristic equation, and
    their number is checked by the argument principle.

    Parameters
    ----------
    orbit, of, row, memory
        As for `feedback_range`.
    gain : float
        K.
    least : float
        Modulus down to which they are wanted, above R and above 0.

    Returns
    -------
    ndarray
        Complex, (k,).

    Raises
    ------
    NotSupported
        Where the velocity that is fed back jumps: the return map has no derivative there (`feedback_range` treats it).
    ArithmeticError
        When the two methods disagree, or small multipliers are lost in rounding (large gains); a larger ``least`` may help.
    """
    gain = number("controlled_multipliers", "gain", gain)
    if memory >= 1.0:
        raise ValueError(f"controlled_multipliers: memory = {memory!r} is not allowed; it must be at least 0 and below 1")
    least = number("controlled_multipliers", "least", least, above=memory)
    linear = linearized(orbit, of, row, abs(gain) * max(1.0, 0.5 * (1.0 + 1.0 / least)))  # |K (1 - 1/lambda)| on the circle
    if linear.jumping:
        raise NotSupported(f"the velocity jumps at {linear.jumping[0].label!r}: with velocity feedback the return map is not "
                           "differentiable there and has no multipliers; see feedback_range")
    equation = Characteristic(linear, memory)
    rough = Collocated(linear, memory).outside(gain, least)
    found = [mu for value in rough[np.abs(rough) > least] if (mu := equation.root(1.0 / value, gain)) is not None]
    wanted = equation.count(gain, 1.0 / least)
    if len(found) != wanted:
        raise ArithmeticError(f"{wanted} multipliers lie outside the circle of radius {least:g} by the argument principle, "
                              f"{len(found)} were found by collocation; choose another `least`")
    values = 1.0 / np.array(found, complex)
    return values[np.argsort(-np.abs(values), kind="stable")]


def odd_number(linear: Linearization) -> bool:
    """Return whether an odd number of real multipliers lies above 1: no feedback of this kind can then make the orbit stable.

    F(0) = 1 and F(1) = det(I - M) whatever the gain is, so that F < 0 at 1 leaves a zero in (0, 1) (Nakajima 1997).
    """
    M = linear.reduced(linear.transition(np.zeros(1)))[0]
    return bool(np.linalg.det(np.eye(len(M)) - M) < 0.0)


class _Smooth:
    """Largest multiplier and its crossings where the return map is smooth."""

    polished = True

    def __init__(self, linear: Linearization, memory: float, repeats: int):
        if repeats != 1:
            linear = repeated(linear, repeats)
        self.equation, self.operator = Characteristic(linear, memory), Collocated(linear, memory)

    def modulus(self, gain: float) -> float:
        """Return the largest modulus of a multiplier."""
        return abs(self.operator.leading(gain))

    def end(self, low: float, high: float) -> FeedbackEnd:
        """Return where the largest multiplier crosses the unit circle between two gains."""
        gain = float(brentq(lambda k: self.modulus(k) - 1.0, low, high, xtol=1e-300, rtol=1e-10))
        value = self.operator.leading(gain)
        polished = self.equation.crossing(abs(math.atan2(value.imag, value.real)), gain, max(abs(low), abs(high)))
        if polished is None or not min(low, high) <= polished[1] <= max(low, high):
            kind = EndKind.PERIOD_DOUBLING if value.real < 0.0 and abs(value.imag) < 1e-6 else EndKind.NEIMARK_SACKER
            return FeedbackEnd(gain, kind, value, 1e-10 * max(abs(gain), 1e-300))
        angle, gain, error = polished
        kind = EndKind.PERIOD_DOUBLING if abs(angle - math.pi) < 1e-9 else EndKind.NEIMARK_SACKER
        return FeedbackEnd(gain, kind, complex(math.cos(angle), math.sin(angle)), error + 4e-16 * abs(gain))

    def confirmed(self, gain: float) -> bool:
        """Return whether the argument principle counts no unstable multiplier."""
        return self.equation.count(gain) == 0


class _Jumping:
    """Growth and its crossings where the velocity that is fed back jumps."""

    polished = False

    def __init__(self, linear: Linearization):
        self.order = ImpactOrder(linear)

    def modulus(self, gain: float) -> float:
        """Return the growth per period."""
        return self.order.iterated(gain)

    def end(self, low: float, high: float) -> FeedbackEnd:
        """Return where perturbations cease to grow between two gains."""
        found = self.order.end(low, high)
        if found is not None:
            gain, (a, b) = found
            kind = EndKind.PERIOD_DOUBLING if a != b else EndKind.OTHER
            return FeedbackEnd(gain, kind, complex(-1.0 if a != b else 1.0), 1e-13 * abs(gain), (a, b))
        gain = float(brentq(lambda k: self.modulus(k) - 1.0, low, high, rtol=1e-6))
        return FeedbackEnd(gain, EndKind.OTHER, complex(math.nan, math.nan), ITERATED * abs(gain))

    def confirmed(self, gain: float) -> bool:
        """Return whether no pattern of signs grows."""
        return not any(growth >= 1.0 for growth, _ in self.order.growths(gain))


def repeated(linear: Linearization, times: int) -> Linearization:
    """Return the equations over several periods."""
    return Linearization(linear.orbit, linear.pieces * times, linear.rows, linear.labels)


def _scan(orbit, of, bounds, memory, analysis, samples) -> FeedbackRange:
    """Look at gains, bracket and locate the ends, and find the best gain."""
    gains = np.linspace(bounds[0], bounds[1], samples)
    moduli = np.array([analysis.modulus(gain) for gain in gains])
    if not np.isfinite(moduli).all():
        raise ArithmeticError(f"growth is not finite at the gain {gains[~np.isfinite(moduli)][0]:g}; choose narrower bounds")
    gains, moduli = _extrema(analysis, gains, moduli)
    inside = moduli < 1.0
    ends: list[FeedbackEnd] = []
    intervals: list[tuple[float, float]] = []
    begin = float(gains[0])
    for i in range(len(gains) - 1):
        if inside[i] == inside[i + 1]:
            continue
        end = analysis.end(float(gains[i]), float(gains[i + 1]))
        ends.append(end)
        if inside[i]:
            intervals.append((begin, end.gain))
        begin = end.gain
    if inside[-1]:
        intervals.append((begin, float(gains[-1])))
    best = best_modulus = None
    for first, last in intervals:
        place = _best(analysis, gains, moduli, first, last)
        if best_modulus is None or place[1] < best_modulus:
            best, best_modulus = place
    status = FeedbackStatus.FOUND if intervals else FeedbackStatus.NEVER_STABLE
    if intervals and not ends:
        status = FeedbackStatus.EVERYWHERE
    for first, last in intervals:
        try:
            if not analysis.confirmed(0.5 * (first + last)):
                status = FeedbackStatus.DISPUTED
        except OnCircle:
            status = FeedbackStatus.DISPUTED
    return FeedbackRange(orbit, of, bounds, memory, tuple(intervals), tuple(ends), best, best_modulus, status, gains, moduli)


def _extrema(analysis, gains, moduli) -> tuple[np.ndarray, np.ndarray]:
    """Add the extrema of the largest modulus between samples that all lie on one side of 1 and come near it."""
    extra = []
    for i in range(1, len(gains) - 1):
        side = np.sign(moduli[i - 1:i + 2] - 1.0)
        if abs(side.sum()) < 3:
            continue
        near = side[1] * (moduli[i - 1:i + 2] - 1.0)  # distance from the unit circle
        if near[1] <= near[0] and near[1] <= near[2] and near[1] < 2.0 * (near[0] + near[2] - 2.0 * near[1]) + 1e-3:
            found = minimize_scalar(lambda k, side=side: side[1] * (analysis.modulus(k) - 1.0), bounds=(gains[i - 1], gains[i + 1]),
                                    method="bounded", options={"xatol": 1e-4 * (gains[i + 1] - gains[i - 1])})
            if found.fun < 0.0:
                extra.append((float(found.x), 1.0 + side[1] * float(found.fun)))
    if not extra:
        return gains, moduli
    order = np.argsort(np.append(gains, [k for k, _ in extra]), kind="stable")
    return np.append(gains, [k for k, _ in extra])[order], np.append(moduli, [m for _, m in extra])[order]


def _best(analysis, gains, moduli, low: float, high: float) -> tuple[float, float]:
    """Return the gain with the least growth in an interval, and that growth."""
    held = [low, *gains[(gains > low) & (gains < high)], high]
    values = [1.0, *moduli[(gains > low) & (gains < high)], 1.0]
    place = int(np.argmin(values))
    left, right = held[max(place - 1, 0)], held[min(place + 1, len(held) - 1)]
    found = minimize_scalar(analysis.modulus, bounds=(left, right), method="bounded",
                            options={"xatol": (1e-10 if analysis.polished else 1e-4) * max(abs(left), abs(right))})
    return (float(found.x), float(found.fun)) if found.fun < values[place] else (float(held[place]), float(values[place]))


def _bounds(bounds) -> tuple[float, float]:
    try:
        low, high = (number("feedback_range", "bounds", value) for value in bounds)
    except TypeError:
        raise ValueError(f"feedback_range: bounds = {bounds!r} is not allowed; give (low, high)") from None
    if not low < high:
        raise ValueError(f"feedback_range: bounds = {bounds!r} is not allowed; the low gain must be below the high one")
    return low, high


def _repeats(delay) -> int:
    if delay is None:
        return 1
    delay = number("feedback_range", "delay", delay, above=0.0)
    if abs(delay - round(delay)) > 1e-12 or round(delay) < 1:
        raise ValueError(f"feedback_range: delay = {delay!r} periods is not allowed; it must be a whole number of periods of the "
                         "orbit: otherwise the feedback does not vanish on the orbit, which is then no motion of the system")
    return round(delay)


def _curve() -> tuple[np.ndarray, np.ndarray]:
    return np.empty(0), np.empty(0)
