"""The text of a one-period batch step of one mass with one rigid stop: `several_modes` for a single mode and a single event.

A substep is one loop over all starts and one over those that may meet the stop: an impact leaves the mode as it is, so that no list
has to be kept.  This is 1.3 times as fast as `several_modes`, 1.5 times where the mass comes to rest (problem A and a slow load in
`studies.kernel_throughput`).

Bounds are those of `several_modes`: a start stays in the batch only while they prove that it met the stop not at all, or once, and
left it for the rest of the substep.  All others (grazes, repeated impacts, rest), and those in another mode, take the whole period
by `bifurc.ensemble.batch.certified`.
"""
from .several_modes import filled, layout, records, strides

ROWS = ("ASIDE", "LOW", "TOP", "EY", "EV", "FQ", "FV", "SPEED", "FAIL")  # of scratch


def step_text(size: int) -> str:
    """Return the source of ``period_step`` for ``size`` starts in a batch."""
    numbers = layout(1, 1, size) | strides(*records(1, 1))
    numbers |= {name: numbers["FIRST"] + i * numbers["CAP"] for i, name in enumerate(ROWS)}
    return filled(_TEXT, 1, numbers, {})


def spaces(size: int) -> tuple[int, int, int, int]:
    """Return the floats and whole numbers of scratch of the step: behind the rows of the driver, and those for each mode."""
    return len(ROWS) * (size + 8), 0, 0, 0


_TEXT = '''@fused
def steps(W, index, count, home, modes, N, F):
    """Carry the first ``count`` starts over a forcing period in their free mode; mark in ASIDE those that are not proved."""
    o, i, h = 0, AT_GUARDS, N[0]
    per, reach = 1.0 / h, N[AT_GUARDS + AT_ON_REACH]
    for l in range(count):
        W[AT_LOW + l] = np.inf
        W[AT_ASIDE + l] = 1.0 if modes[l] != home else 0.0
    for k in range(F.size // AT_PER_STEP):
        t = k * AT_PER_STEP
        j = t + AT_FORCED
        LOAD_FLOW
        LOAD_GUARD
        for l in range(count):
            y0, y1 = W[l], W[AT_SIZE + l]
            x{k} = SUM[ e{k}_{c} * y{c} ; w{k} ]
            LARGEST
            W[AT_TOP + l] = largest
        c = 0
        for l in range(count):
            index[c] = l
            c += W[AT_TOP + l] >= 0.0
        for e in range(c):
            W[AT_EY + e], W[AT_EV + e] = W[index[e]], W[AT_SIZE + index[e]]
        for l in range(count):
            y0, y1 = W[l], W[AT_SIZE + l]
            x{k} = SUM[ e{k}_{c} * y{c} ; w{k} ]
            W[l], W[AT_SIZE + l] = x0, x1
        if c == 0:
            continue
        full = (c + 7) // 8 * 8  # whole vectors: the last entry is repeated
        for e in range(c, full):
            W[AT_EY + e], W[AT_EV + e] = W[AT_EY + c - 1], W[AT_EV + c - 1]
        LOAD_KICKED
        LOAD_SERIES
        for e in range(full):
            y0, y1 = W[AT_EY + e], W[AT_EV + e]
            x{k} = SUM[ e{k}_{c} * y{c} ; w{k} ]
            GUARD_OVER
            ROOT
            rest = h - s
            REBOUND
            W[AT_FQ + e], W[AT_FV + e], W[AT_SPEED + e] = x0, x1, speed
            W[AT_FAIL + e] = 0.0 if found & stays else (-1.0 if none else 1.0)
        for e in range(c):
            if W[AT_FAIL + e] < 0.0:  # no impact
                continue
            l = index[e]
            W[l], W[AT_SIZE + l] = W[AT_FQ + e], W[AT_FV + e]
            W[AT_EVENTS + l] += 1.0
            W[AT_LOW + l] = min(W[AT_LOW + l], W[AT_SPEED + e])
            W[AT_ASIDE + l] += W[AT_FAIL + e]


@njit
def period_step(W, index, count, given, modes, limit, spare):
    """Carry the first ``count`` starts of ``W`` over a forcing period, and ``modes`` with them; write what the driver reads."""
    home, many, y, tally = given.I[0, 0], given.I[0, 1], spare[0], spare[1]
    size = given.grid.size // many
    steps(W, index, count, home, modes, given.numbers[home * AT_PER_MODE:], given.grid[home * size:(home + 1) * size])
    for l in range(count):
        if W[AT_ASIDE + l] > 0.0:
            y[{k}] = W[(AT_NS + {k}) * AT_SIZE + l]
            tally[0], tally[1], tally[2] = 0.0, 0.0, np.inf
            status, modes[l] = period(given, modes[l], spare, limit)
            W[{k} * AT_SIZE + l] = y[{k}]
            W[AT_EVENTS + l], W[AT_LOW + l] = tally[1], tally[2]
            if status != DONE:
                W[AT_FOUND + l] = -2.0 - status
    for l in range(count):
        W[AT_HITS + l] += W[AT_EVENTS + l]
        W[AT_LEAST + l] = min(W[AT_LEAST + l], W[AT_LOW + l])
'''
