"""Contacts followed at samples of the motion: guards are checked at every sample, modes change between two of them."""
import numpy as np

from ..._jit import leaf
from ..tables import ALGEBRAIC, GUARDS, MEMORY, PAIRS, SILENT, THEN, TRIAL, WRITES
from .common import (
    FOLLOWED,
    INCONSISTENT,
    NEXT,
    NOT_SETTLED,
    PASSED,
    PERIODS,
    TOO_MANY,
    TOUCHED,
    WRITER,
    WROTE,
    again,
    begin,
    ended,
    filled,
    missed,
    repeats,
    resting,
    writer,
)


@leaf
def guard_at(values, X, A, nx, m, g, z, j):
    """Return a guard at sample ``j``, from its table without memory."""
    own = A[A.shape[0] - 1, 0]
    total, row, first = values[m, g, j], own[PAIRS] + g, nx + 2 * own[PAIRS]
    for i in range(z.size):
        total += X[m, row, first + i] * z[i]
    return total


@leaf
def broken(values, X, A, nx, m, z, j, tried):
    """Return the first guard of mode ``m`` that is positive at sample ``j``, or -1; ``tried``: but those with a trial."""
    for g in range(A[m, 0, GUARDS]):
        if tried and A[m, 1 + g, TRIAL] >= 0:
            continue
        if guard_at(values, X, A, nx, m, g, z, j) > 0.0:
            return g
    return -1


@leaf
def next_of(values, X, A, nx, m, z, j):
    """Return (guard, mode) that follow mode ``m`` at sample ``j``; guard -1: it stays.  ``z`` is the memory before the sample."""
    every = m < 0  # False, but no literal
    for g in range(A[m, 0, GUARDS]):
        b, h = m, g
        if A[m, 1 + g, TRIAL] >= 0:
            b = A[m, 1 + g, TRIAL]
            h = broken(values, X, A, nx, b, z, j, every)
            if h < 0:
                return g, b
        if guard_at(values, X, A, nx, m, g, z, j) <= 0.0:
            continue
        for i in range(THEN, A.shape[2]):
            d = A[b, 1 + h, i]
            if d == m:
                break
            if d >= 0 and broken(values, X, A, nx, d, z, j, not every) < 0:
                return g, d
    return -1, m


@leaf
def quiet(values, algebraic, X, A, nx, m, z, start):
    """Return the first sample from ``start`` on at which mode ``m`` may be left, or the number of samples.

    What `next_of` decides, without calls: a mode that writes memory stays while every mode that is tried instead is broken.
    """
    own = A[A.shape[0] - 1, 0]
    Q, N, first, guards = own[PAIRS], values.shape[2] - 1, nx + 2 * own[PAIRS], A[m, 0, GUARDS]
    if A[m, 0, WRITES] <= 0:
        for g in range(guards):
            offset = 0.0
            for i in range(z.size):
                offset += X[m, Q + g, first + i] * z[i]
            for j in range(start, N):
                if values[m, g, j] + offset > 0.0:
                    N = j  # the other guards are looked at up to here
                    break
        return N
    for j in range(start, N):
        before = j - 1 if j else N - 1
        for g in range(guards):
            b = A[m, 1 + g, TRIAL]
            stays = b < 0
            if b >= 0:
                for h in range(A[b, 0, GUARDS]):
                    total = values[b, h, j]
                    for i in range(z.size):
                        total += X[b, Q + h, first + i] * (algebraic[m, i, before] if A[m, 0, ALGEBRAIC + i] > 0 else z[i])
                    if total > 0.0:
                        stays = True
                        break
            total = values[m, g, j]
            for i in range(z.size):
                total += X[m, Q + g, first + i] * (algebraic[m, i, before] if A[m, 0, ALGEBRAIC + i] > 0 else z[i])
            if not stays or total > 0.0:
                return j
    return N


@leaf
def sampled(contact, tabulated, skip, touch, segments, space):
    """Follow a contact at the samples of one period that repeats; arguments and result as of `event_driven.exact`.

    Predictor and corrector, so that forces are continuous in the samples: a mode that writes memory is left for one that
    keeps it as soon as that one is admissible with the memory of the sample before; where it is not, its own broken guard
    says which mode goes on.
    """
    waves, excited, A, X, _, c, _ = contact
    U, V, _, _, excite, _ = tabulated
    path, ends, _, source, count = segments
    scratch, _, p, tables = space
    N, most, own, nx = U.shape[1] - 1, len(ends), A[A.shape[0] - 1, 0], excited.size
    Z, turn, modes, Q, G = own[MEMORY], 2.0 * np.pi, A.shape[0] - 1, own[PAIRS], A.shape[1] - 1
    a, z, z0 = scratch[0, :waves.size], scratch[6, :Z], scratch[7, :Z]
    values, algebraic = tables[0], tables[1]
    z[:] = 0.0
    m, wrote = begin(contact, skip, z, p, a)
    if m < 0:
        return INCONSISTENT
    for n in range(modes):
        for g in range(A[n, 0, GUARDS]):
            filled(X[n, Q + g], own, U, V, excite, 1.0, values[n, g])
        for i in range(Z):
            if A[n, 0, ALGEBRAIC + i] > 0:
                filled(X[n, Q + G + i], own, U, V, excite, 1.0, algebraic[n, i])
    at, ignored = 0.0, False
    for period in range(PERIODS):
        m0, events = m, 0
        for i in range(Z):
            z0[i] = z[i]
        source[0], source[1], source[NEXT], source[PASSED], source[TOUCHED] = wrote, at, -np.inf, 0.0, touch
        j = -1
        while True:
            j += 1
            if touch == 0.0 and j < N:
                new = quiet(values, algebraic, X, A, nx, m, z, j)
                ignored = ignored and new == j
                j = new
            if j >= N:
                break
            for i in range(Z):
                if A[m, 0, ALGEBRAIC + i] > 0:
                    z[i] = algebraic[m, i, j - 1 if j else N - 1]
            which, after = next_of(values, X, A, nx, m, z, j)
            if which < 0:
                ignored = False
                if touch == 0.0:
                    continue
                which = near(values, X, A, nx, m, z, j, touch, source)
                if which < 0 or (period > 0 and events == 0 and resting(A, m, which, turn * j / N, source, 1.5 * turn / N)):
                    continue
                after = writer(A, m, which)
            elif ignored or (period > 0 and events == 0 and resting(A, m, which, turn * j / N, source, 1.5 * turn / N)) or (
                    skip > 0.0 and A[m, 0, WRITES] <= 0 and rise(values, X, A, nx, m, which, z, j) < skip):
                ignored = True
                continue
            if events >= most - 1:
                return TOO_MANY
            stop = turn * j / N
            closed = period > 0 and touch == 0.0 and again(A, m, which, after, segments, events, stop, 0.0)
            ended(segments, events, m, which, after, stop, turn * (j - 1) / N, z)
            if A[m, 0, WRITES] > 0:
                wrote, at, path[events, WROTE] = m, ends[events, 1], m
            if closed:  # as in `exact`
                count[1] = period + 1
                return FOLLOWED
            events += 1
            m = after
        ended(segments, events, m, -1, m, turn, turn, z)
        count[0], count[1] = events + 1, period + 1
        if m == m0 and wrote == int(source[WRITER]) and repeats(A, m, z, z0, c):
            return FOLLOWED
    return NOT_SETTLED


@leaf
def round_at(values, X, A, nx, m, g, z, j):
    """Return a guard at sample ``j`` modulo the period."""
    return guard_at(values, X, A, nx, m, g, z, j % (values.shape[2] - 1))


@leaf
def spread(values, X, A, nx, m, g, z):
    """Return a size of a guard: its largest value at a sample, and that of what memory adds."""
    own, top = A[A.shape[0] - 1, 0], 1e-300
    for j in range(values.shape[2]):
        top = max(top, abs(values[m, g, j]))
    for i in range(z.size):
        top += abs(X[m, own[PAIRS] + g, nx + 2 * own[PAIRS] + i] * z[i])
    return top


@leaf
def rise(values, X, A, nx, m, g, z, j):
    """Return how high a guard would rise from sample ``j`` on, as part of its size."""
    top = round_at(values, X, A, nx, m, g, z, j)
    for i in range(1, values.shape[2] - 1):
        new = round_at(values, X, A, nx, m, g, z, j + i)
        if new < top:
            break
        top = new
    return top / spread(values, X, A, nx, m, g, z)


@leaf
def near(values, X, A, nx, m, z, j, touch, source):
    """Return a guard of mode ``m`` with a maximum among the samples at ``j`` that is a touch to be followed; -1: none."""
    for g in range(A[m, 0, GUARDS]):
        if A[m, 1 + g, SILENT] > 0:
            continue
        here = round_at(values, X, A, nx, m, g, z, j)
        if round_at(values, X, A, nx, m, g, z, j - 1) < here and round_at(values, X, A, nx, m, g, z, j + 1) <= here:
            if missed(here / spread(values, X, A, nx, m, g, z), touch, writer(A, m, g) >= 0, source):
                return g
    return -1
