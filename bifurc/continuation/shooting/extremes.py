"""Derivatives of the largest and least displacement of an orbit in its unknowns and its parameter.

A top inside an interval does not move to first order: its value has the derivative of the arc that leads to it.  Where the
largest displacement is that of an event (an impact at the stop), it is one of the unknowns itself.
"""
import numpy as np

from ...orbits.shooting.sequence import AFTER, BEFORE, GUARD, closed_in

SAMPLES = 96  # a period, among which a top is looked for
TURNS = 30  # of Newton's method on its speed
CLOSE = 1e-13  # of a period, last of its steps
DIFFERENCE = 3e-4  # of the parameter's natural size, fourth-order differences


def extreme_gradient(problem, x, dof: int, sign: float):
    """Return the gradient (n + 1,), own units, of the maximum (``sign`` 1) or minimum (-1) of a displacement at ``x`` (n + 1,).

    None for orbits of unknown period, where events are too near, and where a law makes the motion.
    """
    whole, U = problem._whole(x)
    if whole.clock or problem.scene.laws:
        return None
    e, ns, count = problem.equations, problem.scene.ns, len(problem.sequence.nodes)
    found = top(e, e.numbers_at(x[-1]), whole, U, dof, sign)
    if found is None:
        return None
    i, t = found
    gradient = np.zeros(x.size)
    if t is None:  # at an event: displacements are continuous there
        gradient[(i % count) * (1 + ns) + 1 + dof] = -1.0 if i >= count else 1.0
        return gradient
    row = arc_row(e, e.numbers_at(x[-1]), whole, U, i, t, dof)
    base = (i % count) * (1 + ns)
    gradient[base:base + 1 + ns] = row
    if i >= count:  # the mirrored half
        gradient[base + 1:base + 1 + ns] *= -1.0
    h = DIFFERENCE * problem.scale[-1]
    total = 0.0
    for k, weight in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
        total += weight * value_at(e, e.numbers_at(x[-1] + k * h), whole, U, i, t, dof)
    gradient[-1] = total / (12.0 * h)
    e.numbers_at(x[-1])
    return gradient


def top(e, T, whole, U, dof: int, sign: float):
    """Return (node, time behind it or None at the node itself) of the largest ``sign`` times displacement; None if unclear."""
    ns, n = T.A.shape[1], e.scene.n
    rows = U.reshape(len(whole.nodes), -1)
    period = 2.0 * np.pi / T.flat[0]
    ends = np.append(rows[1:, 0], rows[0, 0] + whole.span)
    best: tuple[float, int, float | None, bool] = (-np.inf, 0, 0.0, False)
    y = np.empty(ns)
    for i in range(len(rows)):
        start, duration = started(e, T, whole, U, i), (ends[i] - rows[i, 0]) * period
        times = np.linspace(0.0, duration, max(5, int(SAMPLES * (ends[i] - rows[i, 0]) / whole.span) + 3))
        values = np.empty(times.size)
        for k, t in enumerate(times):
            e.motion.advance(T, int(whole.nodes[i, AFTER]), start, t, y)
            values[k] = sign * y[dof]
        k = int(np.argmax(values))
        if values[k] > best[0]:
            best = (values[k], i, times[k], 0 < k < times.size - 1)
            if k in (0, times.size - 1):
                e.motion.advance(T, int(whole.nodes[i, AFTER]), start, times[k], y)
                inward = y[n + dof] * sign * (1.0 if k == 0 else -1.0)
                best = (*best[:3], inward > 0.0) if inward > 0.0 else (values[k], i if k == 0 else (i + 1) % len(rows), None, False)
    _, i, t, inside = best
    if not inside or t is None:
        return i, None
    start = started(e, T, whole, U, i)
    mode, f, joined = int(whole.nodes[i, AFTER]), np.empty(ns), start.copy()
    step = np.inf
    for _ in range(TURNS):
        e.motion.advance(T, mode, start, t, y)
        joined[:ns] = y
        e.motion.forcing(T, rows[i, 0] * period + t, joined)
        e.kernel.field(T, mode, joined, f)
        if f[n + dof] * sign >= 0.0:
            return None
        step = -y[n + dof] / f[n + dof]
        t += step
        if not 0.0 <= t <= (ends[i] - rows[i, 0]) * period:
            return None
        if abs(step) <= CLOSE * period:
            break
    return (i, t) if abs(step) <= 1e3 * CLOSE * period else None


def started(e, T, whole, U, i: int) -> np.ndarray:
    """Return the joined state (nx,) just after a node."""
    joined, P = np.empty(T.A.shape[2]), np.empty(T.A.shape[1:])
    e.motion.start_of(T, whole.nodes, U, i, P, joined)
    return joined


def value_at(e, T, whole, U, i: int, t: float, dof: int) -> float:
    """Return the displacement at the time ``t`` behind a node: beside a top it differs from that to second order only."""
    y = np.empty(T.A.shape[1])
    e.motion.advance(T, int(whole.nodes[i, AFTER]), started(e, T, whole, U, i), t, y)
    return float(y[dof])


def arc_row(e, T, whole, U, i: int, t: float, dof: int) -> np.ndarray:
    """Return the derivative (1 + ns,) of the displacement at a top, ``t`` behind node ``i``, in the time and state of that node."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    base, period = i * (1 + ns), 2.0 * np.pi / T.flat[0]
    before, after, P, dw = np.empty(nx), np.empty(nx), np.empty((ns, nx)), np.empty(nx - ns)
    before[:ns] = U[base + 1:base + 1 + ns]
    e.kernel.forcing(T, U[base] * period, before)
    e.kernel.forcing_rate(T, before, dw)
    node = whole.nodes[i]
    e.kernel.reset(T, int(node[BEFORE]), int(node[GUARD]), closed_in.py_func(node), before, after, P)
    f, y, Phi = np.empty(ns), np.empty(ns), np.empty((ns, ns))
    e.kernel.field(T, int(node[AFTER]), after, f)
    e.kernel.arc(T, int(node[AFTER]), after, t, y, Phi)
    moved = P[:, ns:] @ dw - f
    return np.append(Phi[dof] @ moved * period, Phi[dof] @ P[:, :ns])
