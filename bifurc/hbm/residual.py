"""Residual of a balance and its derivatives: dynamic stiffness, excitation, and the forces of contacts along the motion.

    (K - k^2 nu^2 M) a_k + k nu C b_k = e_k + R^T f_k (cosines),   (K - k^2 nu^2 M) b_k - k nu C a_k = ... (sines)

Derivatives are exact, also that by a parameter of the system, given the derivative of the packed numbers by it.

One file, because following contacts, summing their forces and joining them to the linear part is one evaluation.
"""
from typing import NamedTuple

import numpy as np

from .._jit import WHOLE, apart, both, leaf, njit
from ..solve.dense import lessened
from .contacts.common import (
    ASKED,
    CHOSEN,
    FOLLOWED,
    GUARD,
    MODE,
    NEXT,
    NOT_FINITE,
    NOT_SETTLED,
    PASSED,
    ROUNDING,
    TOUCHED,
    WRITER,
    Contact,
    Segments,
    Space,
    Tabulated,
    choices,
    guard_of,
)
from .contacts.event_driven import crest, exact, followed_on, overshoot
from .contacts.sampled import sampled
from .contacts.spectra import Scratch, Slopes, Sums, divisors, gather, joined, signals
from .tables import CHOOSES, HEAD, INTERNAL, MEMORIES, MEMORY, MODES, MOST_GUARDS, PAIRED, Grid, Room, core, expressions, structure
from .waves import size, value

TOUCH = 0.5  # part of a guard's size below zero up to which it may count as a touch where events are missing
TOGETHER = 1e-6  # relative difference of near misses that are taken at once
ATTEMPTS = 6  # passes along a contact until it has the events that are asked for
ALL = 2.0  # above the height of any event
UNIT = 1 << 14  # of what an order of events counts beside events: more than a contact has


@leaf
def summed(factors, table, count, out):
    """Write the sum of the first ``count`` columns of a table's rows (nk, .) with ``factors`` (nk,); four rows at a time."""
    m = factors.size - factors.size % 4
    for n in range(count):
        out[n] = 0.0
    for i in range(0, m, 4):
        a0, a1, a2, a3 = factors[i], factors[i + 1], factors[i + 2], factors[i + 3]
        t0, t1, t2, t3 = table[i], table[i + 1], table[i + 2], table[i + 3]
        for n in range(count):
            out[n] += a0 * t0[n] + a1 * t1[n] + a2 * t2[n] + a3 * t3[n]
    for i in range(m, factors.size):
        a0, t0 = factors[i], table[i]
        for n in range(count):
            out[n] += a0 * t0[n]


@leaf
def synthesised(waves, cosines, sines, c, U, dU, ddU, twice, half, factors):
    """Write values and derivatives by phase of the rows ``c`` (nr, mi) on a grid, from its tables (nk, grid + 1).

    The grid is its own mirror image about half the period: there cosines repeat, and sines change their sign.
    ``half`` (6, grid // 2 + 1) and ``factors`` (6, nk) are overwritten.
    """
    last = cosines.shape[1] - 1
    count = last // 2 + 1
    even, odd, deven, dodd, ddeven, ddodd = half[0], half[1], half[2], half[3], half[4], half[5]
    for row in range(len(c)):
        for j in range(1, waves.size, 2):
            k, i = waves[j], j // 2
            a, b = c[row, j], c[row, j + 1]
            factors[0, i], factors[1, i], factors[2, i], factors[3, i] = a, b, k * b, k * a
            factors[4, i], factors[5, i] = k * (k * a), k * (k * b)
        summed(factors[0], cosines, count, even)
        summed(factors[1], sines, count, odd)
        summed(factors[2], cosines, count, deven)
        summed(factors[3], sines, count, dodd)
        for n in range(count):
            U[row, last - n], dU[row, last - n] = c[row, 0] + (even[n] - odd[n]), deven[n] + dodd[n]
            U[row, n], dU[row, n] = c[row, 0] + (even[n] + odd[n]), deven[n] - dodd[n]
        if twice:
            summed(factors[4], cosines, count, ddeven)
            summed(factors[5], sines, count, ddodd)
            for n in range(count):
                ddU[row, last - n], ddU[row, n] = ddodd[n] - ddeven[n], -ddeven[n] - ddodd[n]


@leaf
def arose(contact, grid, rates, segments, n, a):
    """Return how high the guard that ended segment ``n`` would rise behind it, as part of its size; negative after a touch.

    ``a`` (mi,) is overwritten; ``rates`` (M, G, grid + 1) as of `event_driven.exact`.
    """
    samples = grid.samples
    waves, A = contact.waves, contact.A
    m, g, stop = segments.path[n, MODE], segments.path[n, GUARD], segments.ends[n, 0]
    guard_of(contact, m, g, segments.zs[n, :A[A.shape[0] - 1, 0, MEMORY]], a)
    bound = size(a)
    if bound == 0.0:
        return 0.0
    if samples == 0:
        return overshoot(waves, a, stop, rates[m, g])
    h = 2.0 * np.pi / samples
    top = value(waves, a, stop)
    if top[1] <= 0.0:
        return top[0] / bound
    i = np.floor((crest(waves, a, stop) - stop) / h)  # the samples on both sides of the maximum
    return max(value(waves, a, stop + i * h)[0], value(waves, a, stop + (i + 1.0) * h)[0]) / bound


@leaf
def threshold(contact, grid, rates, segments, wanted, a, heights):
    """Return the height up to which events are ignored so that about ``wanted`` of them are left; ``a`` (mi,) and ``heights``, one
    an event, are overwritten."""
    events = segments.counts[0] - 1
    for n in range(events):
        heights[n] = arose(contact, grid, rates, segments, n, a)
    for i in range(1, events):  # by insertion
        n = i
        while n > 0 and heights[n - 1] > heights[n]:
            heights[n - 1], heights[n] = heights[n], heights[n - 1]
            n -= 1
    drop = (events - wanted + 1) // 2
    top = 2.0 * heights[drop - 1] + ROUNDING  # not much more: on the way from a virgin start all of them are smaller
    return min(top, 0.5 * (heights[drop - 1] + heights[drop])) if drop < events else top


class Work(NamedTuple):
    """Arrays that are overwritten while contacts are followed."""

    half: np.ndarray  # these two: see `synthesised`
    factors: np.ndarray
    scratch: np.ndarray  # these three: see `contacts.common.Space`
    flags: np.ndarray
    p: np.ndarray
    heights: np.ndarray  # of events, see `threshold`


@njit
def work(S, grid: Grid, room: Room):
    """Return arrays to follow contacts with."""
    M, G, mi, (waves, nodes) = S[MODES], S[MOST_GUARDS], S[INTERNAL], grid.cosines.shape
    scratch, flags = np.empty((8, max(mi, M, G, room.zs.shape[2]))), np.empty((3, max(M, G)), np.int64)
    return Work(np.empty((6, nodes // 2 + 1)), np.empty((6, waves)), scratch, flags, np.empty((S[HEAD + mi - 1] + 1, 2)),
                np.empty(room.ends.shape[1]))


@both
def followed(S, flat, grid: Grid, c, v, listed, room: Room):
    """Follow all contacts along rows with coefficients ``c``, ``v``, into ``room``; return the code of a `ContactStatus`.

    ``listed`` (nc,): events of each contact, -1: as they come, see `order_of`.  Where a contact has more, the least of them are
    ignored; where it has fewer, the guards that come nearest to firing count as touches: so the equations of an order of
    events go on smoothly beyond the point where the order changes, as far as a corrector looks.
    """
    return followed_in(S, flat, grid, c, v, listed, room, work(S, grid, room))


@leaf
def followed_in(S, flat, grid: Grid, c, v, listed, room: Room, work: Work):
    """Do what `followed` says, without counting references to arrays."""
    samples, cosines, sines, excite, dexcite = grid
    zs, sources, counts = room.zs, room.sources, room.counts
    nr, nodes = len(c), cosines.shape[1]
    for row in range(nr):
        for j in range(c.shape[1]):
            if not np.isfinite(c[row, j]) or not np.isfinite(v[row, j]):
                return NOT_FINITE
    waves, _, excited, contacts = structure(S)
    X, loose = expressions(S, flat)
    U, dU, ddU, V = room.grids[0], room.grids[1], room.grids[2], room.grids[3]
    synthesised(waves, cosines, sines, c, U, dU, ddU, samples == 0, work.half, work.factors)
    rate = flat[0]
    for row in range(nr):
        for n in range(nodes):
            V[row, n] = v[row, 0] + rate * dU[row, n]
        if samples == 0:
            for n in range(nodes):
                ddU[row, n] *= rate
    tabulated = Tabulated(U, V, dU, ddU, excite, dexcite)
    space = Space(work.scratch, work.flags, work.p, room.tables)
    for k in range(len(contacts)):
        skip, touch, contact = 0.0, 0.0, Contact(waves, excited, contacts[k], X[k], loose[k], c, v)
        segments = Segments(room.paths[k], room.ends[k], zs[k], sources[k], counts[k])
        wanted, by = max(listed[k], 0) % UNIT, -2 - listed[k] if listed[k] < -1 else -1
        for _ in range(ATTEMPTS):
            if samples:
                status = sampled(contact, tabulated, skip, touch, segments, space)
            else:
                status = exact(contact, tabulated, skip, touch, segments, space, room.rates[k])
            if status != FOLLOWED:
                return status
            if contacts[k, contacts.shape[1] - 1, 0, CHOOSES] > 0:
                sources[k, CHOSEN:ASKED] = choices(contacts[k], room.paths[k], counts[k, 0])
                order = max(listed[k], 0)
                for i in range(ASKED - CHOSEN):
                    order //= UNIT
                    sources[k, ASKED + i] = sources[k, CHOSEN + i] if listed[k] == -1 else order % UNIT
            more = surplus(wanted, sources[k], counts[k])
            events = wanted + more
            wrote = int(sources[k, WRITER])
            if listed[k] == -1 or (events == wanted and (events > 0 or wrote == by)):
                break
            if events > wanted or (events == wanted and by < 0):
                if touch > 0.0:
                    break
                if wanted == 0 and by < 0 and contacts[k, contacts.shape[1] - 1, 0, MEMORY] > 0:
                    new = ALL  # in one mode from a virgin start on; without memory either mode may be that of the period
                else:
                    left = counts[k, 0] - 1 - more
                    new = threshold(contact, grid, room.rates[k], segments, left, work.scratch[0, :waves.size], work.heights)
                if new <= skip:
                    break
                skip = new
            elif skip > 0.0 or (touch > 0.0 and sources[k, NEXT] < -TOUCH):
                break
            else:
                touch = ROUNDING if touch == 0.0 else -(1.0 + TOGETHER) * sources[k, NEXT]
    return FOLLOWED


@leaf
def followed_again(S, flat, c, v, room: Room, far, scratch, p):
    """Follow all contacts along rows that are next to those along which they were followed last; return whether that is possible:
    it is with the same events, each moved by less than ``far``, see `event_driven.followed_on`; the last two arguments are those
    of `Work`."""
    waves, _, excited, contacts = structure(S)
    X, loose = expressions(S, flat)
    for k in range(len(contacts)):
        Z = contacts[k, contacts.shape[1] - 1, 0, MEMORY]
        if not followed_on(Contact(waves, excited, contacts[k], X[k], loose[k], c, v),
                           Segments(room.paths[k], room.ends[k], room.zs[k], room.sources[k], room.counts[k]), far, scratch[0, :Z],
                           scratch[1, :Z], p, scratch[2, :waves.size]):
            return False
    return True


@leaf
def surplus(wanted, source, counts):
    """Return how many events a contact that was followed has more than an order asks for: ``wanted``, but see `order_of`.

    What is counted as a touch is an event there and one back.  Of contacts that open as often, one that closes otherwise than the
    order says has one event more, or one less; one that opens otherwise up to two.
    """
    passed = int(source[PASSED]) if source[TOUCHED] > 0.0 else 0
    more, opened = counts[0] - 1 + passed - wanted, 2 * int(source[CHOSEN + 2] - source[ASKED + 2])
    if opened > 0 or opened + passed < 0:
        return more if more * opened > 0 else opened
    either = abs(source[CHOSEN] - source[ASKED]) + 2.0 * abs(source[CHOSEN + 1] - source[ASKED + 1])
    return 0 if opened == 0 and abs(more) <= either else more


@leaf
def kept(listed, sources, counts):
    """Return whether the contacts that were followed have the events ``listed`` (nc,) asks for: where they cannot, it is far away.

    Memory of a contact that always stays in one mode is that of the same writer.
    """
    for k in range(len(listed)):
        if listed[k] == -1:
            continue
        by = -2 - listed[k] if listed[k] < -1 else -1
        if surplus(max(listed[k], 0) % UNIT, sources[k], counts[k]) or (max(listed[k], 0) == 0 and int(sources[k, WRITER]) != by):
            return False
    return True


@leaf
def assembled(S, R, flat, dflat, x, F, J, slopes, f, wide):
    """Write residual ``f`` (slots n,) and with ``slopes`` derivatives ``wide`` (slots n, slots n + 1), last by the parameter."""
    waves, place, _, _ = structure(S)
    (M, C, K), E = core(S, flat)
    (dM, dC, dK), dE = core(S, dflat)
    n, m, nr = len(M), place.size, len(F)
    nu, dnu = flat[0], dflat[0]
    size, mi = m * n, waves.size
    if slopes:
        wide[:] = 0.0
    for i in range(m):
        slot = place[i]
        k = waves[slot]
        w, dw = k * nu, k * dnu
        other, way = (i - 1, -w) if slot % 2 == 0 else (i + 1, w)
        for a in range(n):
            total = -E[i, a]
            for r in range(nr):
                if R[r, a] != 0.0:
                    total -= R[r, a] * F[r, i]
            for b in range(n):
                total += (K[a, b] - w * w * M[a, b]) * x[i * n + b]
                if k > 0:
                    total += way * C[a, b] * x[other * n + b]
            f[i * n + a] = total
            if not slopes:
                continue
            slope = -dE[i, a]
            for r in range(nr):
                if R[r, a] != 0.0:
                    slope -= R[r, a] * J[r, i, 0, mi]
            for b in range(n):
                slope += (dK[a, b] - w * w * dM[a, b] - 2.0 * w * dw * M[a, b]) * x[i * n + b]
                wide[i * n + a, i * n + b] += K[a, b] - w * w * M[a, b]
                if k > 0:
                    turn = 1.0 if way > 0.0 else -1.0
                    slope += turn * (w * dC[a, b] + dw * C[a, b]) * x[other * n + b]
                    wide[i * n + a, other * n + b] += way * C[a, b]
            wide[i * n + a, size] = slope
    if not slopes:
        return
    if n == 1 and m == mi:  # of one coordinate slots lie side by side
        for r in range(nr):
            for t in range(nr):
                weight = R[r, 0] * R[t, 0]
                if weight != 0.0:
                    for i in range(m):
                        lessened(wide[i, :m], weight, J[r, i, t, :m])
        return
    for r in range(nr):
        for a in range(n):
            if R[r, a] == 0.0:
                continue
            for t in range(nr):
                for b in range(n):
                    weight = R[r, a] * R[t, b]
                    if weight == 0.0:
                        continue
                    for i in range(m):
                        for j in range(m):
                            wide[i * n + a, j * n + b] -= weight * J[r, i, t, place[j]]


@both
def motion(S, R, flat, dflat, x, c, v, cp, vp):
    """Write the coefficients (nr, mi) of the rows' coordinates and speeds, and their derivatives by the parameter."""
    moved_rows(S, R, flat, dflat, x, c, v, cp, vp, np.empty(S[INTERNAL]))


@leaf
def moved_rows(S, R, flat, dflat, x, c, v, cp, vp, line):
    """Do what `motion` says; ``line`` (mi,) is overwritten."""
    _, place, _, _ = structure(S)
    n = R.shape[1]
    c[:] = 0.0
    for r in range(len(c)):
        for a in range(n):
            weight = R[r, a]
            if weight != 0.0:
                for i in range(place.size):
                    c[r, place[i]] += weight * x[i * n + a]
    signals(S, flat, dflat, c, v, cp, vp, line)


def order_of(room: Room) -> np.ndarray:
    """Return the order of events of the contacts that were followed (nc,): the number of events of each.

    Of one that always stays in one mode with memory that mode m wrote before, -2 - m; with virgin memory 0.  With it, in powers
    of `UNIT`, how many contacts slip at once as they close, slip down as they open, and open.  Where one of the first two changes,
    a stay in stick or slip has no duration; the force is zero there and its rate the same both ways, so that the equations need no
    order to be smooth.
    """
    orders = []
    for count, source in zip(room.counts[:, 0].tolist(), room.sources.tolist(), strict=True):
        stays = count == 1 and source[WRITER] >= 0.0
        chosen = sum(int(found) * UNIT**(1 + i) for i, found in enumerate(source[CHOSEN:ASKED]))
        orders.append(-2 - int(source[WRITER]) if stays else count - 1 + chosen)
    return np.array(orders, np.int64)


def events_of(listed) -> int:
    """Return how many events a period has by the orders of events of all contacts (nc,), see `order_of`."""
    return int((np.maximum(listed, 0) % UNIT).sum())


@both
def linearised(S, R, flat, dflat, x, grid: Grid, slopes, listed, room: Room, far):
    """Write residual and derivatives of the balance at the packed motion ``x`` into ``room``.

    Spectra, forces and derivatives of laws must be there (or zeros); those of the contacts are added.

    Parameters
    ----------
    S, R
        Structure, see `tables`, and rows.
    flat, dflat : ndarray
        Numbers of the system and their derivatives by the parameter.
    slopes : bool
        False: no derivatives.
    listed : int (nc,)
        Events of each contact, see `followed`.
    far : float
        Where it is not zero, the contacts have the events of the last call, for a motion next to this one, each at a phase (rad) no
        farther away: they are not looked for again.

    Returns
    -------
    int
        Code of a `ContactStatus`; `NOT_SETTLED` where they cannot have those events.
    """
    return linearised_in(S, R, flat, dflat, x, grid, slopes, listed, room, far, tools(S, grid, room))


class Tools(NamedTuple):
    """Arrays that are overwritten while a balance is linearised."""

    work: Work
    scratch: Scratch
    D: np.ndarray  # these three: see `contacts.spectra.divisors`, `joined`
    line: np.ndarray
    ways: np.ndarray


@njit
def tools(S, grid: Grid, room: Room):
    """Return arrays to linearise with."""
    L, Q, M, mi = room.spectra.shape[3], S[PAIRED], S[MODES], S[INTERNAL]
    space, D = work(S, grid, room), np.empty((L, 2))
    scratch = Scratch(np.empty((4, Q * mi + 1)), space.p, np.empty((M, L, 2)), np.empty((3, L, 2)),
                      np.empty((S[MEMORIES], Q * mi + 1)))
    divisors(L, grid.samples, D)
    return Tools(space, scratch, D, np.empty(mi), np.empty((2, 2 * L - 1)))


@apart(WHOLE, counted=False)
def linearised_in(S, R, flat, dflat, x, grid: Grid, slopes, listed, room: Room, far, tools: Tools):
    """Do what `linearised` says, without counting references to arrays; ``tools`` are overwritten."""
    space, scratch, D, line, ways = tools
    waves, place, excited, contacts = structure(S)
    X, loose = expressions(S, flat)
    dX, dloose = expressions(S, dflat)
    c, v, cp, vp = room.rows[0], room.rows[1], room.rows[2], room.rows[3]
    moved_rows(S, R, flat, dflat, x, c, v, cp, vp, line)
    if far > 0.0:
        status = FOLLOWED if followed_again(S, flat, c, v, room, far, space.scratch, space.p) else NOT_SETTLED
    else:
        status = followed_in(S, flat, grid, c, v, listed, room, space)
    if status != FOLLOWED:
        return status
    sums = Sums(room.spectra, room.F, room.J)
    for k in range(len(contacts)):
        gather(Contact(waves, excited, contacts[k], X[k], loose[k], c, v), Slopes(dX[k], dloose[k], flat[0], cp, vp), place,
               Segments(room.paths[k], room.ends[k], room.zs[k], room.sources[k], room.counts[k]), grid.samples, D, slopes, sums,
               scratch)
    joined(waves, place, flat[0], room.rows, slopes, sums, line, ways)
    assembled(S, R, flat, dflat, x, room.F, room.J, slopes, room.f, room.wide)
    return FOLLOWED
