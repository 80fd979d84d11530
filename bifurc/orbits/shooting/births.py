"""Orders of the trivial zeros of guards that are laws, just after an event, from samples of the event.

Where guards are affine the derivatives that an event makes vanish follow from linear algebra (`signature.start_orders`).  A
law is asked at states on the surface of the event, drawn at random and put there by Newton: a derivative of a guard that is
zero at all of them vanishes by what the event says.
"""
import numpy as np

from ...compose.natural import natural_length, natural_rate
from ...compose.scene import Scene
from ...compose.tables import ORDER
from ...compose.writer import kernels
from ...elements import Circle
from ...flow.linear import ModeField

SAMPLES = 6
TRIALS = 400  # drawn at most
NEWTON = 30
ZERO = 1e-7  # of the largest term of the series on its step: a smaller term vanishes
PROPORTIONAL = 1e-6  # relative spread of the ratio of a leading rate to the arriving speed
MOST = 5  # orders looked at


def needs_samples(T, before: int, guard: int, after: int) -> bool:
    """Return whether a guard that takes part is a law, or a speed that a law changes: falling friction lets go with no
    acceleration."""
    n, pushed = T.LP.shape[2], T.LP[after].any(axis=0)
    return guard >= 0 and bool(law_guards(T, before, guard, after)
                               or T.G[after, :T.n_guards[after], n:2 * n][:, pushed].any())


def law_guards(T, before: int, guard: int, after: int) -> bool:
    """Return whether a guard that takes part is a law."""
    return guard >= 0 and bool(T.LG[before, guard].any() or T.LG[after, :T.n_guards[after]].any())


def sampled_orders(scene: Scene, T, before: int, guard: int, after: int) -> np.ndarray:
    """Return the order of the trivial zero of every guard of ``after`` just after the event, as `signature.start_orders`."""
    orders = np.zeros(int(T.n_guards[after]), np.int64)
    samples = list(_samples(scene, T, before, guard))
    if not samples:
        return orders
    terms_of, rule = kernels(scene, "bifurc.flow.laws.guards").guard_terms, kernels(scene, "bifurc.flow.rule")
    y, P, a, size = np.empty(scene.ns + scene.nw), np.empty((scene.ns, scene.ns + scene.nw)), *np.empty((2, ORDER + 1))
    speeds, field = np.array([speed for _, speed in samples]), ModeField(scene, T, after)
    for q in range(len(orders)):
        terms, shortest = [], []
        for x, _ in samples:
            rule.jump(T, before, guard, 0, x, y, P)
            terms_of(T, after, q, y, np.abs(y), a, size)
            terms.append(a[:MOST + 1].copy())
            shortest.append(fastest(field, y))
        # the steps of the tables know nothing of stiff laws
        step = min(0.25 * T.step[after], float(np.median(shortest)))
        terms_ = np.array(terms) * step ** np.arange(MOST + 1)
        top = np.abs(terms_).max(axis=1)
        for order in range(MOST):
            leading = terms_[:, order]
            if np.any(np.abs(leading) > ZERO * top):
                ratio = leading / speeds
                own = np.ptp(ratio) > PROPORTIONAL * np.abs(ratio).max()
                orders[q] = -order if own and not (T.kick[before, guard] and order == 1) else order  # it throws back
                break
    return orders


def fastest(field: ModeField, y) -> float:
    """Return the time in which a state (nx,) changes fastest in a mode; inf where that is not defined."""
    J = field.jacobian(y[:field.scene.ns])
    return 1.0 / max(float(np.abs(np.linalg.eigvals(J)).max()), 1e-300) if np.isfinite(J).all() else np.inf


def _samples(scene: Scene, T, before: int, guard: int):
    """Yield joined states (nx,) at which the guard fires, and the speed with which it arrives."""
    kernel = kernels(scene)
    rng, length, rate = np.random.default_rng(1), natural_length(T), natural_rate(T)
    ns, nx, found = scene.ns, scene.ns + scene.nw, 0
    held = [row for k in range(int(T.n_holds[before])) for row in (T.H[before, k], T.S[before, k]) if row[:ns].any()]
    row, f, dw = np.empty(nx), np.empty(ns), np.empty(nx - ns)
    for _ in range(TRIALS):
        x = np.empty(nx)
        x[:ns] = length * rng.normal(size=ns)
        x[scene.n:2 * scene.n] *= rate
        angle = rng.uniform(0.0, 2.0 * np.pi) * np.array(scene.harmonics, float)
        x[ns], x[ns + 1::2], x[ns + 2::2] = 1.0, np.cos(angle), np.sin(angle)
        for _ in range(NEWTON):
            kernel.guard_gradient(T, before, guard, x, row)
            curved = curved_rests(scene, before, x)
            rows = np.array([row.copy(), *held, *(slope for _, slope in curved)])
            values = np.array([kernel.guard_value(T, before, guard, x), *(h @ x for h in held), *(value for value, _ in curved)])
            step = np.linalg.lstsq(rows[:, :ns], values)[0]
            x[:ns] -= step
            if not np.isfinite(x).all() or np.abs(step).max() <= 1e-15 * np.abs(x[:ns]).max():
                break
        if not np.isfinite(x).all() or np.abs(step).max() > 1e-12 * np.abs(x[:ns]).max():
            continue
        kernel.guard_gradient(T, before, guard, x, row)
        kernel.field(T, before, x, f)
        kernel.forcing_rate(T, x, dw)
        speed = float(row[:ns] @ f + row[ns:] @ dw)
        if speed > 1e-3 * float(np.abs(row[:ns]) @ np.abs(f)):
            yield x, speed
            found += 1
            if found == SAMPLES:
                return


def curved_rests(scene: Scene, mode: int, x) -> list[tuple[float, np.ndarray]]:
    """Return value and gradient (nx,) of everything that constraints on circles keep at zero in a mode, at ``x`` (nx,)."""
    found, n = [], scene.n
    for element, key in zip(scene.system.elements, scene.keys[mode], strict=True):
        site = element.site(n)
        if not isinstance(site, Circle):
            continue
        p, v = site.R @ x[:n] - np.array(site.centre), site.R @ x[n:2 * n]
        r = float(np.hypot(*p))
        normal = p / r if r > 0.0 else np.array([1.0, 0.0])  # as `curve.polar`
        tangent = np.array([-normal[1], normal[0]])
        for hold in element.mode(key, scene.system.core).hold:
            unit, across = (normal, tangent @ v) if hold.row == 0 else (tangent, -(normal @ v))
            gradient = np.zeros(x.size)
            gradient[:n], gradient[n:2 * n] = (across / max(r, 1e-300) * tangent) @ site.R, unit @ site.R
            value = float(unit @ v)
            if hold.row == 1:
                value += site.surface_speed + site.spin * r
                gradient[:n] += site.spin * normal @ site.R
            found.append((value, gradient))
            if hold.surface is not None:
                depth = np.zeros(x.size)
                depth[:n] = normal @ site.R
                found.append((r - site.radius, depth))
    return found
