"""The text of a one-period batch step of one mass with one rigid stop: `several_modes` for a single mode and a single event.

An impact changes the velocity by dv and nothing else, so that the state at the end of a substep is that of the motion without
the impact plus dv (B, B')(h - s), with the column B of the velocity in the motion: the mode that follows is the same, and no list
has to be kept.  It is 1.6 times as fast as `several_modes` (24.9 to 15.6 million starts x periods a CPU-second in problem A of
`studies.kernel_throughput`).

Nothing is taken on trust, by the bounds of `several_modes`: a start stays in the batch only while they prove that it met the stop
not at all, or once, and left it for the rest of the substep.  All others (grazes, repeated impacts, rest) are marked in the row
ASIDE, as are those in another mode, and the caller takes their whole period again by `bifurc.ensemble.batch.certified`: the rule
of the general integration at the events of this one stop, twice as fast where the mass comes to rest.  The numbers are those of
the mode in `bifurc.ensemble.batch.tables`.
"""
from .several_modes import MANY, ONE, filled, horner, layout, place, records

ROWS = ("EQ", "EV", "FQ", "FV", "SPEED", "FAIL", "TOP")  # of scratch: states before and after an event, what is known of it


def step_text(size: int) -> str:
    """Return the source of ``period_step`` for ``size`` starts in a batch."""
    mode, numbers = records(1, 1)[0], layout(1, 1, size) | ONE
    numbers |= {name: numbers["FIRST"] + i * numbers["CAP"] for i, name in enumerate(ROWS)}
    column = place(mode, "place") + MANY  # of the velocity
    words = {"LOAD_COLUMN": [f"b_{j} = N[o + {column + j}]" for j in range(MANY)],
             "COLUMN_AT": horner("b", "span", "value", "slope")}
    return filled(_TEXT, 1, numbers, words)


def spaces(size: int) -> tuple[int, int, int, int]:
    """Return the floats and whole numbers of scratch of the step: behind the rows of the driver, and those for each mode."""
    return len(ROWS) * (size + 8), 0, 0, 0


_TEXT = '''@fused
def period_step(W, index, count, T, numbers, grid, I, modes, limit):
    """Carry the first ``count`` starts over a forcing period in their free mode."""
    home, size = I[0, 0], grid.size // I[0, 1]
    N, F = numbers[home * AT_PER_MODE:(home + 1) * AT_PER_MODE], grid[home * size:(home + 1) * size]
    o, i, h = 0, AT_GUARDS, N[0]
    per, kick = 1.0 / h, N[AT_GUARDS + AT_ADDED + 1]
    for l in range(count):
        W[AT_HITS + l] = 0.0
        W[AT_LEAST + l] = np.inf
        W[AT_ASIDE + l] = 1.0 if modes[l] != home else 0.0
    for k in range(size // AT_PER_STEP):
        t = k * AT_PER_STEP
        j = t + AT_FORCED
        LOAD_FLOW
        LOAD_GUARD
        for l in range(count):
            y0, y1 = W[l], W[AT_SIZE + l]
            x{k} = SUM[ e{k}_{c} * y{c} ; w{k} ]
            GUARD_OVER
            W[AT_TOP + l] = max(max(left, right), max(left + rise0, right - rise1)) + bound
        c = 0
        for l in range(count):
            index[c] = l
            c += W[AT_TOP + l] >= 0.0
        for e in range(c):
            W[AT_EQ + e], W[AT_EV + e] = W[index[e]], W[AT_SIZE + index[e]]
        for l in range(count):
            y0, y1 = W[l], W[AT_SIZE + l]
            x{k} = SUM[ e{k}_{c} * y{c} ; w{k} ]
            W[l], W[AT_SIZE + l] = x0, x1
        if c == 0:
            continue
        full = (c + 7) // 8 * 8  # whole vectors: the last entry is repeated
        for e in range(c, full):
            W[AT_EQ + e], W[AT_EV + e] = W[AT_EQ + c - 1], W[AT_EV + c - 1]
        LOAD_COLUMN
        LOAD_SERIES
        for e in range(full):
            y0, y1 = W[AT_EQ + e], W[AT_EV + e]
            x{k} = SUM[ e{k}_{c} * y{c} ; w{k} ]
            GUARD_OVER
            ROOT
            dv, span = kick * speed, h - s
            COLUMN_AT
            x0, x1 = x0 + value * dv, x1 + slope * dv
            right = SUM[ g{c} * x{c} ; n ]
            RISE1
            rest_of = span * per
            later = AT_ALLOW * rest_of**4 * (bound + r1 * abs(dv))
            W[AT_FQ + e], W[AT_FV + e], W[AT_SPEED + e] = x0, x1, speed
            left_it = found & (right < 0.0) & (right - rest_of * rise1 + later < 0.0)
            W[AT_FAIL + e] = 0.0 if left_it else (-1.0 if none else 1.0)
        for e in range(c):
            if W[AT_FAIL + e] < 0.0:  # no impact
                continue
            l = index[e]
            W[l], W[AT_SIZE + l] = W[AT_FQ + e], W[AT_FV + e]
            W[AT_HITS + l] += 1.0
            W[AT_LEAST + l] = min(W[AT_LEAST + l], W[AT_SPEED + e])
            W[AT_ASIDE + l] += W[AT_FAIL + e]
'''
