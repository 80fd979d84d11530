"""One impact in n forcing periods against one rigid stop: orbits, multipliers, folds, flips in closed form.

    x'' + 2 zeta x' + x = force cos(omega t + phase),   x <= gap,   v+ = -restitution v-

With the state y- = (gap, v) before the impact, P(t) the steady response and E the unforced flow over n periods,

    y- - P = E (R y- - P)   gives   P = y- + (1 + r) v a,   a = (I - E)^-1 E (0, 1),

and the steady response lies on the ellipse P1**2 + (P2/omega)**2 = A**2: one quadratic in v, then the phase.
"""
from dataclasses import dataclass

from mpmath import matrix, mp, mpf

from .oscillator import Oscillator, first_arrival, highest, number


@dataclass(frozen=True)
class ImpactOrbit:
    """One impact per n periods: time of the impact in [0, n T), speed before it, multipliers, admissibility."""

    motion: Oscillator
    gap: object
    restitution: object
    n: int
    time: object
    speed: object
    multipliers: tuple
    admissible: bool
    margin: object  # gap minus the highest interior maximum; negative: the arc passes through the stop

    def state(self, t):
        """State (x, v) at time t; at the impact itself the state after it."""
        span = self.n * self.motion.period
        since = (number(t) - self.time) % span
        return self.motion.flow(self.time, self.gap, -self.restitution * self.speed, self.time + since)


def coefficients(motion, r, n):
    """Return (a1, a2), the response (I - E)^-1 E (0, 1) of the unforced flow over n periods, and E."""
    e11, e12, e21, e22 = motion.homogeneous(n * motion.period)
    det = (1 - e11) * (1 - e22) - e12 * e21
    a1 = ((1 - e22) * e12 + e12 * e22) / det
    a2 = (e21 * e12 + (1 - e11) * e22) / det
    return a1, a2, (e11, e12, e21, e22)


def ellipse(motion, gap, r, n, v):
    """Residual A**2 - P1**2 - (P2/omega)**2 of the orbit condition at the impact speed v."""
    a1, a2, _ = coefficients(motion, r, n)
    return motion.amplitude**2 - (gap + (1 + r) * a1 * v) ** 2 - ((1 + (1 + r) * a2) * v / motion.omega) ** 2


def speeds(motion, gap, r, n):
    """Real impact speeds of the orbit condition, of either sign, increasing (v < 0: virtual)."""
    a1, a2, _ = coefficients(motion, r, n)
    p, q = (1 + r) * a1, (1 + (1 + r) * a2) / motion.omega
    a, b, c = p**2 + q**2, 2 * gap * p, gap**2 - motion.amplitude**2
    disc = b**2 - 4 * a * c
    if disc < 0:
        return []
    return sorted([(-b - mp.sqrt(disc)) / (2 * a), (-b + mp.sqrt(disc)) / (2 * a)])


def impact_time(motion, gap, r, n, v):
    """Time of the impact in [0, n T), in the forcing period that starts at 0."""
    a1, a2, _ = coefficients(motion, r, n)
    p1, p2 = gap + (1 + r) * a1 * v, (1 + (1 + r) * a2) * v
    # P = Re z, P' = -omega Im z with z = force * receptance * exp(i (omega t + phase))
    angle = mp.arg(mp.mpc(p1, -p2 / motion.omega)) - mp.arg(motion.force * motion.receptance) - motion.phase
    return (angle % (2 * mp.pi)) / motion.omega


def monodromy(motion, gap, r, n, v):
    """Trace and determinant of E S, S the saltation of the impact."""
    e11, e12, e21, e22 = coefficients(motion, r, n)[2]
    t = impact_time(motion, gap, r, n, v)
    g = (1 + r) * (motion.load(t)[0] - motion.stiffness * gap) / v
    return -r * (e11 + e22) + g * e12, r**2 * (e11 * e22 - e12 * e21)


def roots_of(trace, det):
    """Both eigenvalues of a 2 x 2 matrix: larger modulus first, of a complex pair the one above the real axis."""
    root = mp.sqrt(mp.mpc(trace**2 / 4 - det))
    return tuple(trace / 2 + (root if trace >= 0 or root.imag else -root) * sign for sign in (1, -1))


def orbits(zeta, omega, force, gap, restitution, n=1, phase=0, samples=400):
    """All n-1 orbits with v > 0, by increasing speed, each with an interior check of its arc."""
    motion = Oscillator(zeta, omega, force, phase=phase)
    gap, r = number(gap), number(restitution)
    found = []
    for v in speeds(motion, gap, r, n):
        if v <= 0:
            continue
        t = impact_time(motion, gap, r, n, v)
        found.append(_orbit(motion, gap, r, n, t, v, roots_of(*monodromy(motion, gap, r, n, v)), samples))
    return found


def _orbit(motion, gap, r, n, t, v, multipliers, samples):
    end = t + n * motion.period
    top = highest(motion, t, gap, -r * v, end, samples=samples)[0]
    hit = first_arrival(motion, t, gap, -r * v, end - mpf(10) ** -12 * motion.period, gap, from_surface=True)
    return ImpactOrbit(motion, gap, r, n, t, v, multipliers, bool(top < gap and hit is None), gap - top)


def resonant_orbit(force, restitution):
    """Impact speed pi force/(1 + r) of the 1-1 orbit of the undamped oscillator at omega = 1; both multipliers are -r.

    Over a period the unforced flow is the identity and the load adds pi force (sin t0, cos t0) to a state at time t0:
    the impact falls at t0 = 0, where momentum balance is (1 + r) v = pi force.  Any gap; the multipliers follow from
    the trace -2 r and the determinant r**2 of the saltation matrix.
    """
    return mp.pi * number(force) / (1 + number(restitution))


def grazing_force(zeta, omega, gap):
    """Load at which the steady response touches the stop."""
    return abs(number(gap)) / abs(Oscillator(zeta, omega, 1).receptance)


def grazing_frequencies(zeta, force, gap):
    """Both omega at which the steady response touches the stop, increasing."""
    zeta, force, gap = number(zeta), number(force), number(gap)
    m = 1 - 2 * zeta**2
    root = mp.sqrt(m**2 - 1 + (force / gap) ** 2)
    return tuple(mp.sqrt(m + s * root) for s in (-1, 1) if m + s * root > 0)


def special_forces(zeta, omega, gap, restitution, n=1):
    """Fold and flip of the n-1 branch in the load: dict kind -> (force, speed); formal where not admissible.

    The trace is affine in 1/v: trace = alpha + beta/v with beta = -(1 + r) e12 omega**2 gap; so v in closed form from
    trace = +-(1 + det), then the load from the ellipse.
    """
    motion = Oscillator(zeta, omega, 1)
    gap, r = number(gap), number(restitution)
    a1, a2, (e11, e12, e21, e22) = coefficients(motion, r, n)
    w2 = motion.omega**2
    # load - gap = x''+2 zeta x'+(x - gap) of the steady response: (1 - w2) P1 + 2 zeta P2 - gap
    alpha = -r * (e11 + e22) + (1 + r) * e12 * (
        (1 - w2) * (1 + r) * a1 + 2 * motion.zeta * (1 + (1 + r) * a2))
    beta = -(1 + r) * e12 * w2 * gap
    det = r**2 * (e11 * e22 - e12 * e21)
    result = {}
    for kind, target in (("fold", 1 + det), ("period_doubling", -(1 + det))):
        v = beta / (target - alpha)
        amplitude = mp.hypot(gap + (1 + r) * a1 * v, (1 + (1 + r) * a2) * v / motion.omega)
        result[kind] = (amplitude / abs(motion.receptance), v)
    return result


def special_frequency(kind, zeta, force, gap, restitution, n, omega, speed):
    """Fold ('fold') or flip ('period_doubling') of the n-1 branch in omega near a guess; returns (omega, speed)."""
    gap, r = number(gap), number(restitution)
    sign = {"fold": -1, "period_doubling": 1}[kind]

    def equations(w, v):
        motion = Oscillator(zeta, w, force)
        trace, det = monodromy(motion, gap, r, n, v)
        return ellipse(motion, gap, r, n, v), 1 + sign * trace + det

    solution = mp.findroot(equations, (number(omega), number(speed)), tol=mpf(10) ** (-2 * mp.dps + 12), maxsteps=40)
    return solution[0], solution[1]


def branch_speed(zeta, omega, force, gap, restitution, n=1, upper=True):
    """Impact speed of the upper (larger) or lower solution; None where there is none."""
    found = [v for v in speeds(Oscillator(zeta, omega, force), number(gap), number(restitution), n) if v > 0]
    if not found or (not upper and len(found) < 2):
        return None
    return found[-1] if upper else found[0]


def special_frequencies(zeta, force, gap, restitution, n=1, low=0.5, high=2.0, samples=600):
    """All folds and flips of the n-1 branches, admissible or formal, for omega in (low, high); both roots are scanned.

    Returns a list of (kind, omega, speed, admissible).
    """
    gap_, r = number(gap), number(restitution)
    hits = []
    for branch in (0, 1):
        previous, absent = None, False
        for i in range(samples + 1):
            w = number(low) + (number(high) - number(low)) * i / samples
            motion = Oscillator(zeta, w, force)
            found = speeds(motion, gap_, r, n)
            if len(found) < 2 or found[branch] <= 0:
                if previous is not None and len(found) < 2:
                    hits.append(("fold", previous[0], previous[1]))
                previous, absent = None, len(found) < 2
                continue
            v = found[branch]
            trace, det = monodromy(motion, gap_, r, n, v)
            now = (w, v, 1 - trace + det, 1 + trace + det)
            if absent:
                hits.append(("fold", w, v))
            if previous is not None:
                for kind, k in (("fold", 2), ("period_doubling", 3)):
                    if previous[k] * now[k] < 0:
                        hits.append((kind, (previous[0] + w) / 2, (previous[1] + v) / 2))
            previous, absent = now, False
    result = []
    for kind, w, v in hits:
        try:
            w, v = special_frequency(kind, zeta, force, gap, restitution, n, w, v)
        except (ValueError, ZeroDivisionError):
            continue
        if any(kind == k and abs(w - w0) < 1e-12 for k, w0, *_ in result):
            continue
        found = [o for o in orbits(zeta, w, force, gap, restitution, n) if abs(o.speed - v) < mpf(10) ** -9]
        result.append((kind, w, v, bool(found and found[0].admissible)))
    return sorted(result, key=lambda row: row[1])


def differenced_monodromy(motion, gap, r, start, span, h=None):
    """Trace and determinant of the map over ``span`` from (t, x, v), by central differences through the true events."""
    h = mpf(10) ** (-mp.dps // 3) if h is None else h
    t0, x0, v0 = start
    columns = []
    for dx, dv in ((h, 0), (0, h)):
        up = simulate(motion, gap, r, t0, x0 + dx, v0 + dv, t0 + span)[0]
        down = simulate(motion, gap, r, t0, x0 - dx, v0 - dv, t0 + span)[0]
        columns.append([(a - b) / (2 * h) for a, b in zip(up, down, strict=True)])
    m = matrix(2, 2)
    for j in range(2):
        for i in range(2):
            m[i, j] = columns[j][i]
    return m


def simulate(motion, gap, r, t, x, v, t1, side=1, limit=2000):
    """March through impacts only (no sticking) to t1; returns ((x, v), [(time, speed before), ...])."""
    events, surface = [], False
    while True:
        hit = first_arrival(motion, t, x, v, t1, side * gap, side=side, from_surface=surface)
        if hit is None:
            return motion.flow(t, x, v, t1), events
        speed = side * motion.flow(t, x, v, hit)[1]
        events.append((hit, speed))
        if len(events) > limit:
            raise RuntimeError("more impacts than the reference march is made for")
        t, x, v, surface = hit, side * gap, -side * r * speed, True


def several_impacts(motion, gap, r, n, times, speeds_before, side=1):
    """Refine an orbit of period n T with listed impacts: Newton on (t_i, v_i) in mpmath; returns (times, speeds)."""
    k = len(times)
    span = n * motion.period

    def equations(*unknowns):
        t, v = unknowns[:k], unknowns[k:]
        rows = []
        for i in range(k):
            end = t[i + 1] if i + 1 < k else t[0] + span
            x1, v1 = motion.flow(t[i], side * gap, -side * r * v[i], end)
            rows += [x1 - side * gap, v1 - side * v[(i + 1) % k]]
        return rows

    start = [number(a) for a in times] + [number(a) for a in speeds_before]
    solution = mp.findroot(equations, start, tol=mpf(10) ** (-2 * mp.dps + 14), maxsteps=40)
    return [solution[i] for i in range(k)], [solution[k + i] for i in range(k)]


def product_multipliers(motion, gap, r, n, times, speeds_before, side=1):
    """Multipliers of an orbit with listed impacts as the product of flows and saltations."""
    k, span = len(times), n * motion.period
    m = mp.eye(2)
    for i in range(k):
        t, v = times[i], speeds_before[i]
        end = times[i + 1] if i + 1 < k else times[0] + span
        g = (1 + r) * (motion.load(t)[0] - motion.stiffness * side * gap) / (side * v)
        e11, e12, e21, e22 = motion.homogeneous(end - t)
        m = matrix([[e11, e12], [e21, e22]]) * matrix([[-r, 0], [g, -r]]) * m
    return roots_of(m[0, 0] + m[1, 1], m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0])


def branch_points_by_scan(zeta, force, gap, r, n, low, high, samples=20001):
    """Folds and flips of the n-1 branch in omega, admissible or not, as (kind, omega, speed) guesses from a fine scan.

    The speed solves a quadratic at each omega: folds are zeros of its discriminant with v > 0, flips are sign changes of
    1 + trace + det along either root.  Where a root comes from v = 0 the test starts with the sign of -e12, the limit of
    the trace there, so that a flip next to a graze is not lost.  Plain numpy, gap > 0.
    """
    import numpy as np

    w = np.linspace(low, high, samples)
    t = n * 2 * np.pi / w
    wd = np.sqrt(1 - zeta**2)
    d, c, s = np.exp(-zeta * t), np.cos(wd * t), np.sin(wd * t) / wd
    e11, e12, e21, e22 = d * (c + zeta * s), d * s, -d * s, d * (c - zeta * s)
    det = (1 - e11) * (1 - e22) - e12 * e21
    a1, a2 = e12 / det, (e21 * e12 + (1 - e11) * e22) / det
    p, q = (1 + r) * a1, (1 + (1 + r) * a2) / w
    size2 = force**2 / ((1 - w**2) ** 2 + (2 * zeta * w) ** 2)
    quad, lin, con = p**2 + q**2, gap * p, gap**2 - size2
    disc = lin**2 - quad * con
    root = np.sqrt(np.maximum(disc, 0.0))
    found = []
    for i in np.flatnonzero(disc[1:] * disc[:-1] < 0):
        v = -(lin / quad)[i]
        if v > 0:
            found.append(("fold", (w[i] + w[i + 1]) / 2, v))
    for sign in (-1, 1):
        v = (-lin + sign * root) / quad
        there = (disc > 0) & (v > 0)
        p1, p2 = gap + p * v, (1 + (1 + r) * a2) * v
        with np.errstate(divide="ignore", invalid="ignore"):
            g = (1 + r) * ((1 - w**2) * p1 + 2 * zeta * p2 - gap) / v
        test = np.where(there, 1 - r * (e11 + e22) + g * e12 + r**2 * d**2, -np.sign(e12))
        live = there | (disc > 0)
        for i in np.flatnonzero((test[1:] * test[:-1] < 0) & live[1:] & live[:-1] & (there[1:] | there[:-1])):
            j = i if there[i] else i + 1
            found.append(("period_doubling", w[j], v[j]))
    return sorted(found, key=lambda row: row[1])
