"""The text of a lap through several modes: elastic stops, dry friction, and both together, in lanes sorted by mode.

Every mode has a list of its own of the lanes that are in it, so that a substep is the same straight line for all lanes of
a list, with the numbers of that mode.  On the fixed substep number k the motion of a mode and its guards are

    x(s) = A(s) q + B(s) v + C_k(s),     guard(s) = D(s) q + E(s) v + F_k(s),     polynomials of order ORDER in s.

An event is a zero of a guard at s.  The candidates of the guard are tried in order: the state at s is taken back to the
start of the substep along the candidate's own motion, since there its polynomials stand, and what they say of [s, h] decides.
The lane then moves to the list of its new mode.

Nothing is taken on trust, by the bounds of `bifurc.basins.lanestext`: a lane stays in the lap only while they prove that it
met no guard, or one and only once, that the candidates before the one taken are forbidden, and that no guard of the one
taken is met in the rest of the substep.  A guard that is zero at s must fall from there (a zero of first or second order:
leaving a stop, leaving stick).  All other lanes are marked in the row ASIDE, and the caller takes their whole period
again by the certified march.  The numbers are those of `bifurc.basins.lanesplan`.
"""
from ..flow.polynomial import SLOPE_ERROR
from .lanestext import CONVERGED, GUESSES

ORDER = 14  # of the polynomials: two more than without modes, since a state is carried back by their slopes
MANY = ORDER + 1
NOISE = 7e-15  # of the sum of all terms of the polynomial of a guard: values below it are zero
FAR = 1e150  # of a state; beyond it the motion is lost
ANY, NONE = -1, -2  # in place of the mode that laps: all do; none does, and all lanes take the certified march
# numbers of a mode: substep and flow (5), A and B, then those of its guards; of a mode on a substep: what the forcing adds
# to the state after it (2), C_k, then those of its guards
FIXED, STEPPED = 5 + 2 * MANY, 2 + MANY
# of a guard: value and slope h/3 by q and v (4), bound (3), noise (3), speed that it sets: by q, and 1 (2), D, E; on a substep:
# what the forcing adds to value and slope h/3 at both ends (4), F_k
OF_GUARD, OF_GUARD_STEPPED = 12 + 2 * MANY, 4 + MANY
# integers of a mode: its guards; then of each guard: what it does (KICKS, STOPS), whether it counts as a hit, its candidates,
# then they
CANDIDATES = 6
NOTHING, KICKS, STOPS, UNKNOWN = range(4)  # what an event does to the speed; UNKNOWN: left to the certified march
SCRATCH = ("EQ", "EV", "BUSY", "S", "SPEED", "VERDICT", "XS", "VS", "LQ", "LV", "LS", "LSPEED", "BQ", "BV", "LX", "LY", "FATE",
           "MQ", "MV")


def modes_text(guards: int, lanes: int) -> str:
    """Return the source of ``lap`` for scenes whose modes have at most so many guards."""
    cap = lanes + 8
    numbers = {"CAP": cap, "FIXED": FIXED, "STEPPED": STEPPED, "OF_GUARD": OF_GUARD, "OF_GUARD_STEPPED": OF_GUARD_STEPPED,
               "PER_MODE": FIXED + guards * OF_GUARD, "PER_STEP": STEPPED + guards * OF_GUARD_STEPPED, "WHOLE": 3 + CANDIDATES,
               "WHOLES": 1 + guards * (3 + CANDIDATES), "UNKNOWN": UNKNOWN, "KICKS": KICKS, "STOPS": STOPS, "SPACE": 17 * lanes,
               "TOPS": 17 * lanes + len(SCRATCH) * cap, "LISTS": 17 * lanes + (len(SCRATCH) + guards) * cap,
               "ALLOW": 16.0 / 3.0, "STEEP": SLOPE_ERROR * 128.0, "CONVERGED": CONVERGED, "FAR": FAR}
    numbers |= {name: 17 * lanes + i * cap for i, name in enumerate(SCRATCH)}
    numbers |= {name: i * cap for i, name in enumerate(("LIST", "TODO", "PLACE", "WAITING", "GONE", "INTO", "IDS"))}
    numbers |= {name: i * lanes for i, name in enumerate(("Q", "V", "Q0", "V0", "HITS", "LEAST", "ASIDE", "EVENTS"))}
    head = "\n".join(f"AT_{name} = {value!r}" for name, value in numbers.items())
    guesses = "\n        ".join(GUESSES * (
        "u = u - (left + u * (d1 + u * (d2 + u * d3))) / (d1 + u * (2.0 * d2 + 3.0 * d3 * u))", "u = min(max(u, 0.0), 1.0)"))
    text = _TEXT.replace("GUESSES", guesses)
    for name, found in (
            ("LOAD_PLACE", _load(("a", "N", "o + 5"), ("b", "N", f"o + {5 + MANY}"), ("c", "F", "t + 2"))),
            ("LOAD_GUARD", _load(("d", "N", "i + 12"), ("e", "N", f"i + {12 + MANY}"), ("f", "F", "j + 4"))),
            ("SUM_GUARD", _sum("g", "d", "e", "f", "q", "v")), ("SUM_FIRST", _sum("g", "d", "e", "f", "q0", "v0")),
            ("SUM_PLACE", _sum("p", "a", "b", "c", "q", "v")),
            ("GUARD_AT", _horner("g", "s", "value", "slope")), ("GUARD_BEND", _horner("g", "s", "value", "slope", "bend")),
            ("PLACE_AT", _horner("p", "s", "place", "rate")), ("DRIVEN_AT", _horner("c", "s", "place", "rate")),
            ("BACK_A", _horner("a", "back", "ax", "av")), ("BACK_B", _horner("b", "back", "bx", "bv"))):
        text = text.replace(f"        {name}\n", found)
    return f"{head}\n\n\n{text}"


def spaces(guards: int, lanes: int) -> tuple[int, int, int, int]:
    """Return the floats and whole numbers of scratch that the lap takes: behind the rows of the march, and those for each mode."""
    cap = lanes + 8
    return (len(SCRATCH) + guards) * cap, 4 * cap, 6 * cap, cap + 1


def _load(*rows: tuple[str, str, str]) -> str:
    """Lines that take polynomials from arrays: name, array, place."""
    return "".join(f"    {', '.join(f'{name}_{j}' for name, _, _ in rows)} = "
                   f"{', '.join(f'{array}[{at} + {j}]' for _, array, at in rows)}\n" for j in range(MANY))


def _sum(made: str, by_q: str, by_v: str, free: str, q: str, v: str) -> str:
    """Lines that sum a polynomial."""
    return "".join(f"        {made}_{j} = {by_q}_{j} * {q} + ({by_v}_{j} * {v} + {free}_{j})\n" for j in range(MANY))


def _horner(name: str, at: str, value: str, slope: str, bend: str = "") -> str:
    """Lines for value, slope and half the second derivative of a polynomial."""
    lines = [f"{made} = {name}_{ORDER}" for made in (value, slope, bend) if made]
    for j in range(ORDER - 1, 0, -1):
        lines += [f"{value} = {value} * {at} + {name}_{j}", f"{slope} = {slope} * {at} + {value}"]
        if bend and j > 1:
            lines.append(f"{bend} = {bend} * {at} + {slope}")
    lines.append(f"{value} = {value} * {at} + {name}_0")
    return "".join(f"        {line}\n" for line in lines)


_TEXT = '''@njit
def screen(full, guards, q, v, x, y, top, N, o, F, t):
    """Carry the lanes of a mode over a substep; write the largest value that each guard may take."""
    e00, e01, e10, e11, w0, w1 = N[o + 1], N[o + 2], N[o + 3], N[o + 4], F[t], F[t + 1]
    for l in range(full):
        x[l], y[l] = e00 * q[l] + (e01 * v[l] + w0), e10 * q[l] + (e11 * v[l] + w1)
    for g in range(guards):
        i, j = o + AT_FIXED + g * AT_OF_GUARD, t + AT_STEPPED + g * AT_OF_GUARD_STEPPED
        gq, gv, sq, sv, r0, r1, r2 = N[i], N[i + 1], N[i + 2], N[i + 3], N[i + 4], N[i + 5], N[i + 6]
        p, m, n, k = F[j], F[j + 1], F[j + 2], F[j + 3]
        u = top[g * AT_CAP:(g + 1) * AT_CAP]
        for l in range(full):
            left, right = gq * q[l] + (gv * v[l] + p), gq * x[l] + (gv * y[l] + n)
            inner, outer = left + (sq * q[l] + (sv * v[l] + m)), right - (sq * x[l] + (sv * y[l] + k))
            u[l] = max(max(left, right), max(inner, outer)) + (r0 * abs(q[l]) + (r1 * abs(v[l]) + r2))


@njit
def roots(W, full, g, N, o, F, t):
    """Find the zero of guard ``g`` and the state there; verdict 1: found, 0: proved that there is none, -1: unclear."""
    h, e00, e01, e10, e11, w0, w1 = N[o], N[o + 1], N[o + 2], N[o + 3], N[o + 4], F[t], F[t + 1]
    i, j = o + AT_FIXED + g * AT_OF_GUARD, t + AT_STEPPED + g * AT_OF_GUARD_STEPPED
    gq, gv, sq, sv, r0, r1, r2 = N[i], N[i + 1], N[i + 2], N[i + 3], N[i + 4], N[i + 5], N[i + 6]
    p, m, n, k = F[j], F[j + 1], F[j + 2], F[j + 3]
        LOAD_PLACE
        LOAD_GUARD
    for l in range(full):
        q, v = W[AT_EQ + l], W[AT_EV + l]
        x, y = e00 * q + (e01 * v + w0), e10 * q + (e11 * v + w1)
        left, right = gq * q + (gv * v + p), gq * x + (gv * y + n)
        rise0, rise1 = sq * q + (sv * v + m), sq * x + (sv * y + k)
        inner0, inner1, rise = left + rise0, right - rise1, right - left
        bound = r0 * abs(q) + (r1 * abs(v) + r2)
        SUM_GUARD
        bend0, bend1, allow = left - 2.0 * inner0 + inner1, inner0 - 2.0 * inner1 + right, AT_ALLOW * bound
        d1, d2, d3 = 3.0 * rise0, 3.0 * bend0, bend1 - bend0  # the cubic, over u = s / h
        u = -left / rise
        GUESSES
        s = h * u
        GUARD_AT
        s = min(max(s - value / slope, 0.0), h)
        GUARD_BEND
        unit = 1.0 / slope
        step = value * unit
        step = step * (1.0 + bend * unit * step)  # Chebyshev's, of third order
        s = s - step
        speed = slope - 2.0 * bend * step
        SUM_PLACE
        PLACE_AT
        steep, middle = AT_STEEP * bound, inner1 - inner0
        concave, convex = (bend0 < -allow) & (bend1 < -allow), (bend0 > allow) & (bend1 > allow)
        rising = (rise0 > steep) & (middle > steep) & (rise1 > steep)
        falling = (rise0 < -steep) & (middle < -steep) & (rise1 < -steep)
        found = ((left < 0.0) & (right >= 0.0) & (concave | convex | rising) & (abs(step) <= AT_CONVERGED * h)
                 & (s >= 0.0) & (s <= h) & (speed > 0.0))
        none = (left < 0.0) & (right < 0.0) & (convex | rising | falling | (concave & ((rise0 <= 0.0) | (rise1 >= 0.0))))
        W[AT_VERDICT + l] = 1.0 if found else (0.0 if none else -1.0)
        W[AT_S + l], W[AT_SPEED + l], W[AT_XS + l], W[AT_VS + l] = s, speed, place, rate


@njit
def back(W, full, N, o, F, t):
    """Take states at s back to the start of the substep along the motion of a mode, and to its end."""
    e00, e01, e10, e11, w0, w1 = N[o + 1], N[o + 2], N[o + 3], N[o + 4], F[t], F[t + 1]
        LOAD_PLACE
    for l in range(full):
        s = W[AT_LS + l]
        DRIVEN_AT
        q, v, back = W[AT_LQ + l] - place, W[AT_LV + l] - rate, -s
        BACK_A
        BACK_B
        q0, v0 = ax * q + bx * v, av * q + bv * v
        W[AT_BQ + l], W[AT_BV + l] = q0, v0
        W[AT_LX + l], W[AT_LY + l] = e00 * q0 + (e01 * v0 + w0), e10 * q0 + (e11 * v0 + w1)
        W[AT_FATE + l] = 1.0


@njit
def admit(W, full, g, N, o, F, t):
    """Whether guard ``g`` of the mode that follows stays inside from s on; fate 1: proved so far, -1: outside at s, 0: unclear."""
    h = N[o]
    i, j = o + AT_FIXED + g * AT_OF_GUARD, t + AT_STEPPED + g * AT_OF_GUARD_STEPPED
    gq, gv, sq, sv, r0, r1, r2 = N[i], N[i + 1], N[i + 2], N[i + 3], N[i + 4], N[i + 5], N[i + 6]
    z0, z1, z2, n, k = N[i + 7], N[i + 8], N[i + 9], F[j + 2], F[j + 3]
        LOAD_GUARD
    for l in range(full):
        q0, v0, x, y, s = W[AT_BQ + l], W[AT_BV + l], W[AT_LX + l], W[AT_LY + l], W[AT_LS + l]
        SUM_FIRST
        GUARD_AT
        span = h - s
        rest = span / h
        short = rest * rest
        later = short * short * (r0 * abs(q0) + (r1 * abs(v0) + r2))
        noise = z0 * abs(q0) + (z1 * abs(v0) + z2)
        end = gq * x + (gv * y + n)
        inner, outer = slope * span / 3.0, end - rest * (sq * x + (sv * y + k))
        apart = (value < -noise) & (max(max(value, end), max(value + inner, outer)) + later < 0.0)
        leaves = (abs(value) <= noise) & (inner <= noise) & (outer + AT_ALLOW * later < -noise) & (end < -noise)
        sign = 1.0 if apart | leaves else (-1.0 if value > noise else 0.0)
        W[AT_FATE + l] = min(W[AT_FATE + l], sign)


@njit
def fill(W, first, count):
    """Repeat the last entry of a list to a whole number of vectors."""
    for e in range(count, (count + 7) // 8 * 8):
        W[first + e] = W[first + count - 1]


@njit
def follow(W, index, c, count, m, at, k, steps, numbers, grid, I, first):
    """Put the lanes of a list into the modes that follow their event; return how many wait for the end of the substep.

    ``at`` is the place of the event in the integers of mode ``m``, ``c`` how many lanes wait already.
    """
    for i in range(I[m, at + 2]):
        if count == 0:
            break
        target = I[m, at + 3 + i]
        o, t = target * AT_PER_MODE, (target * steps + k) * AT_PER_STEP
        fill(W, AT_LQ, count)
        fill(W, AT_LV, count)
        fill(W, AT_LS, count)
        full = (count + 7) // 8 * 8
        back(W, full, numbers, o, grid, t)
        for g in range(I[target, first]):
            admit(W, full, g, numbers, o, grid, t)
        left = 0
        for e in range(count):
            l, place = index[AT_TODO + e], index[AT_PLACE + e]
            if W[AT_FATE + e] > 0.0:
                W[AT_EVENTS + l] += 2.0 if i > 0 and I[m, at] == AT_KICKS else 1.0  # friction turns round at the same instant
                if I[m, at + 1] == 1:
                    W[AT_HITS + l] += 1.0
                    W[AT_LEAST + l] = min(W[AT_LEAST + l], W[AT_LSPEED + e])
                index[AT_WAITING + c], index[AT_GONE + c], index[AT_INTO + c] = l, place, target
                W[AT_MQ + c], W[AT_MV + c] = W[AT_LX + e], W[AT_LY + e]
                c += 1
            elif W[AT_FATE + e] == 0.0:
                W[AT_ASIDE + l] = 1.0
            else:
                index[AT_TODO + left], index[AT_PLACE + left] = l, place
                for row in (AT_LQ, AT_LV, AT_LS, AT_LSPEED):
                    W[row + left] = W[row + e]
                left += 1
        count = left
    for e in range(count):
        W[AT_ASIDE + index[AT_TODO + e]] = 1.0
    return c


@njit
def meet(W, index, c, n, m, g, now, k, steps, numbers, grid, I, first):
    """Take lanes of mode ``m`` that may meet guard ``g`` in this substep through the event; return how many wait."""
    guards, ids, start = I[m, first], AT_IDS + m * AT_CAP, AT_LISTS + (4 * m + 2 * now) * AT_CAP
    top = W[AT_TOPS + g * AT_CAP:AT_TOPS + (g + 1) * AT_CAP]
    count = 0
    for l in range(n):
        index[count] = l
        count += top[l] >= 0.0
    if count == 0:
        return c
    for e in range(count):
        l = index[e]
        W[AT_EQ + e], W[AT_EV + e] = W[start + l], W[start + AT_CAP + l]
        busy = 0.0
        for other in range(guards):
            if other != g and W[AT_TOPS + other * AT_CAP + l] >= 0.0:
                busy = 1.0
        W[AT_BUSY + e] = busy
    fill(W, AT_EQ, count)
    fill(W, AT_EV, count)
    o = m * AT_PER_MODE
    roots(W, (count + 7) // 8 * 8, g, numbers, o, grid, (m * steps + k) * AT_PER_STEP)
    at, i = first + 1 + g * AT_WHOLE, o + AT_FIXED + g * AT_OF_GUARD
    what, one, two = I[m, at], numbers[i + 10], numbers[i + 11]
    todo = 0
    for e in range(count):
        if W[AT_VERDICT + e] == 0.0:
            continue
        place = index[e]
        l = index[ids + place]
        if W[AT_VERDICT + e] < 0.0 or W[AT_BUSY + e] > 0.0 or what == AT_UNKNOWN:
            W[AT_ASIDE + l] = 1.0
            continue
        q, v, speed = W[AT_XS + e], W[AT_VS + e], W[AT_SPEED + e]
        if what == AT_KICKS:
            v -= (1.0 + one) * speed / two
        elif what == AT_STOPS:
            v = one * q + two
        W[AT_LQ + todo], W[AT_LV + todo], W[AT_LS + todo], W[AT_LSPEED + todo] = q, v, W[AT_S + e], speed
        index[AT_TODO + todo], index[AT_PLACE + todo] = l, place
        todo += 1
    return follow(W, index, c, todo, m, at, k, steps, numbers, grid, I, first)


@njit
def lap(W, index, count, numbers, grid, I, modes, limit):
    """Carry the first ``count`` lanes of ``W`` over a forcing period; write the ``modes`` of those not set aside."""
    many, first = I.shape[0], 3 + GUARDS * (4 + I[0, 2])
    steps, counts = grid.size // (many * AT_PER_STEP), AT_IDS + many * AT_CAP
    for m in range(many):
        index[counts + m] = 0
    for l in range(count):
        W[AT_HITS + l], W[AT_LEAST + l], W[AT_ASIDE + l], W[AT_EVENTS + l] = 0.0, np.inf, 0.0, 0.0
        m = modes[l]
        n, start = index[counts + m], AT_LISTS + 4 * m * AT_CAP
        W[start + n], W[start + AT_CAP + n] = W[AT_Q + l], W[AT_V + l]
        index[AT_IDS + m * AT_CAP + n] = l
        index[counts + m] += 1
    now, top = 0, W[AT_TOPS:AT_LISTS]
    for k in range(steps):
        c = 0
        for m in range(many):
            n = index[counts + m]
            if n == 0:
                continue
            a, b = AT_LISTS + (4 * m + 2 * now) * AT_CAP, AT_LISTS + (4 * m + 2 - 2 * now) * AT_CAP
            screen((n + 7) // 8 * 8, I[m, first], W[a:a + AT_CAP], W[a + AT_CAP:a + 2 * AT_CAP], W[b:b + AT_CAP],
                   W[b + AT_CAP:b + 2 * AT_CAP], top, numbers, m * AT_PER_MODE, grid, (m * steps + k) * AT_PER_STEP)
            begun = c
            for g in range(I[m, first]):
                c = meet(W, index, c, n, m, g, now, k, steps, numbers, grid, I, first)
            for i in range(begun + 1, c):  # places in order; they come in few runs that are in order
                place, j = index[AT_GONE + i], i
                while j > begun and index[AT_GONE + j - 1] > place:
                    index[AT_GONE + j] = index[AT_GONE + j - 1]
                    j -= 1
                index[AT_GONE + j] = place
            ids = AT_IDS + m * AT_CAP
            for i in range(c - 1, begun - 1, -1):  # the last lane fills the last gap
                n -= 1
                place = index[AT_GONE + i]
                W[b + place], W[b + AT_CAP + place], index[ids + place] = W[b + n], W[b + AT_CAP + n], index[ids + n]
            index[counts + m] = n
        for i in range(c):
            m = index[AT_INTO + i]
            n, b = index[counts + m], AT_LISTS + (4 * m + 2 - 2 * now) * AT_CAP
            W[b + n], W[b + AT_CAP + n], index[AT_IDS + m * AT_CAP + n] = W[AT_MQ + i], W[AT_MV + i], index[AT_WAITING + i]
            index[counts + m] += 1
        now = 1 - now
    for m in range(many):
        a = AT_LISTS + (4 * m + 2 * now) * AT_CAP
        for i in range(index[counts + m]):
            l = index[AT_IDS + m * AT_CAP + i]
            q, v = W[a + i], W[a + AT_CAP + i]
            if W[AT_ASIDE + l] == 0.0 and abs(q) < AT_FAR and abs(v) < AT_FAR and W[AT_EVENTS + l] <= limit:
                W[AT_Q + l], W[AT_V + l], modes[l] = q, v, m
            else:
                W[AT_ASIDE + l] = 1.0
'''
