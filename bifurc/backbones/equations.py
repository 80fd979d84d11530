"""Two ways to solve for an extended periodic motion: shooting through exact events, and harmonic balance."""
import numpy as np

from ..flow.simulate import simulate
from ..hbm.balance import Balance
from ..orbits.balance.method import HarmonicBalance
from ..solve.newton import newton
from ..system import System

DIFFERENCE = 3e-6  # relative, central, over what the motion makes of it: under a negative damping of the size of the critical one
# it grows by hundreds in a period, and with it how crooked the misfit is; Newton converges to rounding all the same
SWING = 1e-3  # of the amplitude
LONGEST = 2.0  # linear periods in which a motion is expected to come back
OVERDAMPED = 20.0  # |xi|/omega: far beyond a damping ratio of 1 nothing oscillates
CLOSED = 5e-12  # scaled misfit of an accepted motion that does not grow much
NOISE = 64.0 * np.finfo(float).eps  # of the terms of a row: steps that gain nothing below it have met rounding
REFUSED = (ValueError, ArithmeticError)  # what systems and motions say of numbers that Newton tries: a start beyond a stop, ...


def with_negative_damping(system: System, xi: float, omega: float | None = None) -> System:
    """Return the system with the damping C - xi M."""
    return System(system.mass, system.damping - xi * system.mass, system.stiffness, system.elements, omega=omega)


def sizes(system: System, q: np.ndarray, omega: float) -> np.ndarray:
    """Return natural sizes (n,) of the coordinates in a motion of size ``q`` (n,): all hold as much energy as any of it.

    A turning of a beam is small in metres and large in stiffness: what rounding leaves of it is of this size.
    """
    stiff = np.abs(np.diag(system.stiffness)) + omega**2 * np.diag(system.mass)
    return np.sqrt((stiff * q**2).max() / stiff)


def shot(system: System, dof: int, amplitude: float, start: np.ndarray, omega: float, xi: float):
    """Return state (ns,), omega, xi, scaled misfit and success, by shooting over the period (half of it where it is symmetric)."""
    n = system.n
    half = system.symmetry == -1
    try:
        first = simulate(with_negative_damping(system, xi), start, duration=0.0).final
    except REFUSED:  # a guess beyond a stop
        return np.array(start, float), omega, xi, np.inf, False
    ns = first.size
    free = [c for c in range(ns) if c not in (dof, n + dof)]
    natural = sizes(system, np.maximum(np.abs(first[:n]), np.where(np.arange(n) == dof, abs(amplitude), 0.0)), omega)
    scale = np.full(ns, natural.max())
    scale[:n] = natural
    scale[n:2 * n] = natural * np.sqrt(omega**2 + np.abs(np.diag(system.stiffness)) / np.diag(system.mass))
    sign, part = (-1.0, 0.5) if half else (1.0, 1.0)

    def made(u):
        y = np.empty(ns)
        y[free] = u[:-2] * scale[free]
        y[dof], y[n + dof] = amplitude, 0.0
        return y, u[-2] * omega0, u[-1] * omega0

    def misfit(u):
        y, w, damping = made(u)
        if not w > 0.0 or abs(damping) > OVERDAMPED * w:
            return np.full(ns, np.nan)
        try:
            motion = simulate(with_negative_damping(system, damping), y, duration=part * 2.0 * np.pi / w)
        except REFUSED:
            return np.full(ns, np.nan)
        return (sign * motion.final - y) / scale if motion.success else np.full(ns, np.nan)

    def slope(u):
        J = np.empty((ns, ns))
        for k in range(ns):
            step = np.zeros(ns)
            step[k] = DIFFERENCE * max(1.0, abs(u[k])) / grown[0]
            J[:, k] = (misfit(u + step) - misfit(u - step)) / (2.0 * step[k])
        if np.isfinite(J).all():
            grown[0] = max(1.0, float(np.abs(J).max()))
        return J

    omega0, grown = omega, [1.0]
    y0 = first.copy()
    y0[dof], y0[n + dof] = amplitude, 0.0
    u = np.concatenate((y0[free] / scale[free], [1.0, xi / omega]))
    found = newton(misfit, slope, u, 1.0, noise=CLOSED)
    left = misfit(found.x)
    state, w, damping = made(found.x)
    worst = float(np.abs(left).max()) if np.isfinite(left).all() else np.inf
    closed = worst < max(CLOSED if found.success else 0.0, NOISE * grown[0])
    good = closed and swings(with_negative_damping(system, damping), state, w, dof)
    return state, w, damping, worst, good


def swings(system: System, state: np.ndarray, omega: float, dof: int) -> bool:
    """Return whether a coordinate moves to and fro over the period: a vanishing period closes without any motion."""
    motion = simulate(system, state, duration=2.0 * np.pi / omega)
    return motion.success and bool(np.ptp(motion.sample(65)[1][:, dof]) > SWING * abs(state[dof]))


def returning(system: System, start: np.ndarray, dof: int, omega: float) -> float:
    """Return the frequency with which a motion from a turning point first turns there again; that given when it does not."""
    try:
        motion = simulate(system, start, duration=LONGEST * 2.0 * np.pi / omega)
    except REFUSED:  # a start beyond a stop: Newton will tell
        return omega
    t, v = motion.t, motion.y[:, system.n + dof]
    moving = np.abs(v) > SWING * np.abs(v).max()  # at the start itself the speed has the sign of its rounding
    y = -np.sign(v[np.argmax(moving)]) * v
    gone = np.maximum.accumulate(moving)
    back = np.flatnonzero(gone[:-1] & (y[:-1] > 0.0) & (y[1:] <= 0.0))
    return omega if not back.size else 2.0 * np.pi / float(t[back[0]] + 0.5 * (t[back[0] + 1] - t[back[0]]))


def balanced(system: System, method: HarmonicBalance, dof: int, amplitude: float, start: np.ndarray, omega: float, xi: float):
    """Return state (ns,), omega, xi, scaled residual, success and first harmonic, by harmonic balance.

    The residual depends on omega and xi as a quadratic polynomial (contacts see the phase, not the time), so that central
    differences in them are exact.
    """
    n = system.n
    layout = method.layout(n, 1)
    size = layout.size

    def equations(u) -> Balance | None:
        w, damping = u[-2:]
        if not w > 0.0 or not abs(damping) <= OVERDAMPED * w:
            return None
        try:
            return method.balance(with_negative_damping(system, damping, w), layout)
        except REFUSED:
            return None

    places = [[layout.place(k, d) for d in range(n)] for k in layout.harmonics]
    turning, rising = np.zeros(size), np.zeros(size)
    for k, mine in zip(layout.harmonics, places, strict=True):
        spots = mine[dof]
        turning[spots[0]] = 1.0
        if k:
            rising[spots[1]] = k
    x = np.zeros(size)
    fundamental = places[list(layout.harmonics).index(1)]
    for d in range(n):
        x[fundamental[d][0]], x[fundamental[d][1]] = start[d], start[n + d] / omega
    natural = sizes(system, np.maximum(np.abs(start[:n]), np.abs(start[n:2 * n]) / omega), omega)
    scale, terms = np.empty(size), np.empty(size)
    for k, mine in zip(layout.harmonics, places, strict=True):
        own = (np.abs(system.stiffness) + k * omega * np.abs(system.damping) + (k * omega)**2 * np.abs(system.mass)) @ natural
        for d, spots in enumerate(mine):
            scale[list(spots)], terms[list(spots)] = natural[d], own[d]

    def residual(u):
        balance = equations(u)
        left = np.full(size, np.nan) if balance is None else balance.residual(u[:-2]) / terms
        return np.concatenate((left, [(turning @ u[:-2] - amplitude) / abs(amplitude), (rising @ u[:-2]) / abs(amplitude)]))

    def jacobian(u):
        J = np.zeros((size + 2, size + 2))
        balance = equations(u)
        J[:size, :size] = np.nan if balance is None else balance.jacobian(u[:-2]) / terms[:, None]
        for column, step in ((size, 1e-3 * u[-2]), (size + 1, 1e-3 * u[-2])):
            up, down = u.copy(), u.copy()
            up[column] += step
            down[column] -= step
            J[:size, column] = (residual(up)[:size] - residual(down)[:size]) / (2.0 * step)
        J[size, :size], J[size + 1, :size] = turning / abs(amplitude), rising / abs(amplitude)
        return J

    guess = np.concatenate((x, [omega, xi]))
    first = equations(guess)
    contacts = np.zeros(size) if first is None else np.abs(first.jacobian(x)) @ scale  # stiff ones outweigh the structure
    terms = np.where(np.isfinite(contacts), np.maximum(terms, contacts), terms)
    found = newton(residual, jacobian, guess, np.concatenate((scale, [omega, omega])), noise=NOISE * np.sqrt(size))
    u = found.x
    left = float(np.abs(residual(u)).max())
    values = layout.values(u[:-2], np.array([0.0]))[0]
    speeds = layout.values(layout.derivative(u[:-2]), np.array([0.0]))[0] * u[-2]
    return np.concatenate((values, speeds)), u[-2], u[-1], left, found.success and left < CLOSED, abs(layout.phasor(u[:-2], 1, dof))
