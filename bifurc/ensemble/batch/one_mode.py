"""The text of the batch step: one forcing period of many starts side by side, in straight lines that the compiler makes vectors of.

All starts stand at the same phase.  On the fixed substep number k of the period the free motion is

    x(s) = A(s) q + B(s) v + C_k(s),        A, B, C_k polynomials of order ORDER in s,

so a substep without an event costs four products, and one with an event is solved on a compacted list: the coefficients
of x are summed once, the root of the cubic through values and slopes of both ends is the first guess, and two steps follow.  An
impact changes the velocity by dv and nothing else, so that the state at the end of the substep is that of the motion
without the impact plus dv (B, B')(h - s): no new expansion is needed.

Nothing is taken on trust.  The cubic differs from the guard by at most h^4/384 times the bound on its fourth derivative
(Birkhoff and Priver 1967); a start stays in the batch only while that bound proves that it met no guard, or one and
only once, with a converged root, and left it for the rest of the substep.  All others (grazes, repeated impacts, rest)
are marked in the row ASIDE, and the caller takes the whole period again by the certified integration.
"""
from ...flow.affine.polynomial import SLOPE_ERROR

ORDER = 12  # of the polynomials on a substep: 4e-16 of the state on a substep that turns by TURN
TURN = 0.4  # largest scaled angle of a substep
GUESSES = 3  # steps of Newton on the cubic
CONVERGED = 1e-6  # of a substep is the longest last step: what it leaves is its cube
# rows: state; state at the start of the period; impacts and least speed of arrival in it; whether the start is
# deferred; largest guard by its bound; then the compacted list: state before, state after, speed, whether it is deferred
ROWS = ("Q", "V", "Q0", "V0", "HITS", "LEAST", "ASIDE", "TOP", "EQ", "EV", "FQ", "FV", "SPEED", "FAIL")
GRID = 7  # numbers of a substep before those of its guards: see `bifurc.ensemble.batch.packing.Numbers`


def step_text(guards: int, size: int, moving: bool) -> str:
    """Return the source of ``period_step`` for a free mode with 0, 1 or 2 rigid stops.

    Parameters
    ----------
    guards : int
    size : int
        Rows have so many entries; a multiple of 8.
    moving : bool
        Whether the place of a stop depends on time.

    Notes
    -----
    ``numbers`` holds, in this order: h; E (4); bound on the fourth derivative, times h^4/384, of the guards by |q|, |v|, 1
    (3); factor of the position (its sign and size) and restitution of every guard (2 each); A and B (ORDER+1 each).
    ``grid`` (substeps, ...) holds the state at the end of a substep that starts at rest at 0 (2); C_k (ORDER+1); then for
    every guard its value and slope for a mass at rest at 0, at both ends (4), and where the stops move the polynomial of
    that value (ORDER+1).
    """
    write = _Lines()
    write.line(0, "@njit")
    write.line(0, "def period_step(W, index, count, P, numbers, grid, I, modes, limit):")
    write.line(1, '"""Carry the first ``count`` starts over a forcing period in their free mode."""')
    for i, name in enumerate(ROWS):
        write.line(1, f"{name} = {i * size}")
    write.line(1, "h, e00, e01, e10, e11, r0, r1, r2 = (" + ", ".join(f"numbers[{i}]" for i in range(8)) + ")")
    for g in range(guards):
        write.line(1, f"sign{g}, ratio{g} = numbers[{8 + 2 * g}], numbers[{9 + 2 * g}]")
    start = 8 + 2 * guards
    for j in range(ORDER + 1):
        write.line(1, f"a{j}, b{j} = numbers[{start + j}], numbers[{start + ORDER + 1 + j}]")
    write.line(1, "third, per = h / 3.0, 1.0 / h")
    write.line(1, "for l in range(count):")
    write.line(2, "W[HITS + l] = 0.0")
    write.line(2, "W[LEAST + l] = np.inf")
    write.line(2, "W[ASIDE + l] = 0.0")
    write.line(1, "for k in range(grid.shape[0]):")
    write.line(2, "f0, f1 = grid[k, 0], grid[k, 1]")
    if not guards:
        write.line(2, "for l in range(count):")
        _step(write, 3)
        return write.text()
    base = 2 + ORDER + 1
    block = 4 + (ORDER + 1 if moving else 0)
    for g in range(guards):
        at = base + g * block
        write.line(2, f"p{g}, m{g} = grid[k, {at}], grid[k, {at + 1}] * third")
        write.line(2, f"n{g}, o{g} = grid[k, {at + 2}], grid[k, {at + 3}] * third")
    write.line(2, "for l in range(count):")
    write.line(3, "q, v = W[Q + l], W[V + l]")
    write.line(3, "x, y = e00 * q + (e01 * v + f0), e10 * q + (e11 * v + f1)")
    write.line(3, "r, t = q + v * third, x - y * third")
    for g in range(guards):
        write.line(3, f"top{g} = max(max(sign{g} * x + n{g}, sign{g} * r + (p{g} + m{g})), sign{g} * t + (n{g} - o{g}))")
    top = "top0" if guards == 1 else "max(top0, top1)"
    write.line(3, f"W[TOP + l] = {top} + (r0 * abs(q) + (r1 * abs(v) + r2))")
    write.line(2, "c = 0")
    write.line(2, "for l in range(count):")
    write.line(3, "index[c] = l")
    write.line(3, "c += W[TOP + l] >= 0.0")
    write.line(2, "for e in range(c):")
    write.line(3, "W[EQ + e], W[EV + e] = W[Q + index[e]], W[V + index[e]]")
    write.line(2, "for l in range(count):")
    _step(write, 3)
    write.line(2, "if c == 0:")
    write.line(3, "continue")
    write.line(2, "full = (c + 7) // 8 * 8  # whole vectors: the last entry is repeated")
    write.line(2, "for e in range(c, full):")
    write.line(3, "W[EQ + e], W[EV + e] = W[EQ + c - 1], W[EV + c - 1]")
    for j in range(ORDER + 1):
        write.line(2, f"c{j} = grid[k, {2 + j}]")
    if moving:
        for g in range(guards):
            for j in range(ORDER + 1):
                write.line(2, f"z{g}_{j} = grid[k, {base + g * block + 4 + j}]")
    write.line(2, "for e in range(full):")
    _event(write, 3, guards, moving)
    write.line(2, "for e in range(c):")
    write.line(3, "l = index[e]")
    write.line(3, "W[Q + l], W[V + l] = W[FQ + e], W[FV + e]")
    write.line(3, "W[HITS + l] += 1.0")
    write.line(3, "W[LEAST + l] = min(W[LEAST + l], W[SPEED + e])")
    write.line(3, "W[ASIDE + l] += W[FAIL + e]")
    return write.text()


def _step(write: "_Lines", depth: int) -> None:
    """The free motion over a substep."""
    write.line(depth, "q, v = W[Q + l], W[V + l]")
    write.line(depth, "W[Q + l], W[V + l] = e00 * q + (e01 * v + f0), e10 * q + (e11 * v + f1)")


def _event(write: "_Lines", depth: int, guards: int, moving: bool) -> None:
    """One entry of the list: root, impact, rest of the substep, and what must hold for it to be right."""
    line = write.line
    line(depth, "q, v = W[EQ + e], W[EV + e]")
    line(depth, "x, y = e00 * q + (e01 * v + f0), e10 * q + (e11 * v + f1)")
    names = ("sign", "ratio", "p", "m", "n", "o")
    if guards == 1:
        line(depth, f"{', '.join(names)} = {', '.join(f'{name}0' for name in names)}")
    else:  # the guard that is crossed; the other one must stay inside by its bound
        line(depth, "first = sign0 * x + n0 >= 0.0")
        for name in names:
            line(depth, f"{name} = {name}0 if first else {name}1")
            line(depth, f"other_{name} = {name}1 if first else {name}0")
    line(depth, "left, right, rise0, rise1 = sign * q + p, sign * x + n, sign * v * third + m, sign * y * third + o")
    line(depth, "inner0, inner1, rise = left + rise0, right - rise1, right - left")
    line(depth, "bound = r0 * abs(q) + (r1 * abs(v) + r2)")
    for j in range(ORDER + 1):
        shift = f" + (z0_{j} if first else z1_{j})" if moving and guards == 2 else (f" + z0_{j}" if moving else "")
        if j == 0 and not moving:
            shift = " + p"
        line(depth, f"g{j} = sign * (a{j} * q + (b{j} * v + c{j})){shift}")
    line(depth, "bend0, bend1, allow = left - 2.0 * inner0 + inner1, inner0 - 2.0 * inner1 + right, (16.0 / 3.0) * bound")
    line(depth, "d1, d2, d3 = 3.0 * rise0, 3.0 * bend0, bend1 - bend0  # the cubic, over u = s / h")
    line(depth, "u = -left / rise")
    for _ in range(GUESSES):
        line(depth, "u = u - (left + u * (d1 + u * (d2 + u * d3))) / (d1 + u * (2.0 * d2 + 3.0 * d3 * u))")
        line(depth, "u = min(max(u, 0.0), 1.0)")
    line(depth, "s = h * u")
    _horner(write, depth, "g", "s", "value", "slope")
    line(depth, "s = min(max(s - value / slope, 0.0), h)")
    _horner(write, depth, "g", "s", "value", "slope", "bend")
    line(depth, "unit = 1.0 / slope")
    line(depth, "step = value * unit")
    line(depth, "step = step * (1.0 + bend * unit * step)  # Chebyshev's, of third order")
    line(depth, "s = s - step")
    line(depth, "speed = slope - 2.0 * bend * step")
    line(depth, "after = -ratio * speed")
    line(depth, "dv = (after - speed) / sign")
    line(depth, "span = h - s")
    _horner(write, depth, "b", "span", "value", "slope")
    line(depth, "x, y = x + value * dv, y + slope * dv")
    line(depth, "rest = span * per")
    line(depth, "short = rest * rest")
    line(depth, "later = short * short * (bound + r1 * abs(dv))")
    line(depth, "final = sign * x + n")
    line(depth, "inner2 = final - rest * (sign * y * third + o)")
    line(depth, f"steep = {SLOPE_ERROR * 128.0!r} * bound")
    line(depth, "single = (((bend0 < -allow) & (bend1 < -allow)) | ((bend0 > allow) & (bend1 > allow))")
    line(depth, "          | ((rise0 > steep) & (inner1 - inner0 > steep) & (rise1 > steep)))")
    line(depth, "good = ((left < 0.0) & (right >= 0.0) & single & (abs(step) <= "
                f"{CONVERGED!r} * h) & (s >= 0.0) & (s <= h) & (speed > 0.0)")
    line(depth, "        & (after < 0.0) & (final < 0.0) & (inner2 + (16.0 / 3.0) * later < 0.0))")
    if guards == 2:
        line(depth, "end, rate = e00 * q + (e01 * v + f0), e10 * q + (e11 * v + f1)")
        line(depth, "near, far = other_sign * q + other_p, other_sign * end + other_n")
        line(depth, "far = max(max(near, far), max(near + (other_sign * v * third + other_m), "
                    "far - (other_sign * rate * third + other_o)))")
        line(depth, "good = good & (far + bound + 1.5 * h * abs(dv * other_sign) < 0.0)  # the impact moves it by B dv")
    line(depth, "W[FQ + e], W[FV + e], W[SPEED + e] = x, y, speed")
    line(depth, "W[FAIL + e] = 0.0 if good else 1.0")


def _horner(write: "_Lines", depth: int, name: str, at: str, value: str, slope: str, bend: str = "") -> None:
    """Value, slope and half the second derivative of the polynomial ``name``0 ... at ``at``."""
    write.line(depth, f"{value} = {name}{ORDER}")
    write.line(depth, f"{slope} = {name}{ORDER}")
    if bend:
        write.line(depth, f"{bend} = {name}{ORDER}")
    for j in range(ORDER - 1, 0, -1):
        write.line(depth, f"{value} = {value} * {at} + {name}{j}")
        write.line(depth, f"{slope} = {slope} * {at} + {value}")
        if bend and j > 1:
            write.line(depth, f"{bend} = {bend} * {at} + {slope}")
    write.line(depth, f"{value} = {value} * {at} + {name}0")


class _Lines:
    """Lines of source."""

    def __init__(self) -> None:
        self._lines: list[str] = []

    def line(self, depth: int, text: str) -> None:
        """Add a line."""
        self._lines.append("    " * depth + text)

    def text(self) -> str:
        """Return all lines."""
        return "\n".join(self._lines) + "\n"
