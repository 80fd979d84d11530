"""Writes straight-line source for one scene: the march through impacts and rest, term by term.

What a person would write by hand for exactly this oscillator: one rigid stop, one harmonic, no loop over states, no
effect that is not there. It uses the package's `first_zero` and otherwise only scalars. The numbers are literals (the
source then holds for one set of parameters) or places of an array that is read when it runs.
"""
import numpy as np

from bifurc.compose.tables import ORDER, Tables
from bifurc.flow.chatter import CLOSE

HEAD = '''"""One impact oscillator, its numbers written out."""
import numba
import numpy as np

from bifurc.flow.affine.polynomial import first_zero


@numba.njit(error_model="numpy", nogil=True)
def march(X, periods, limit, k):
    """March the starts X (N, {ns}) in place over forcing periods; return how many were given up."""
    a, out, stack = np.empty({rows}), np.empty(3), np.empty(64)
    lost = 0
    for i in range(X.shape[0]):
        rest = False
        {load}
        for _ in range(periods):
            left, w1, w2 = {period}, 1.0, 0.0
            order, known, fresh, events = 0, 0.0, True, 0
            value = slope = 0.0
            while left > {tiny}:
                if not rest:
{free}
                else:
{held}
            if events > limit:
                lost += 1
                break
        {store}
    return lost
'''

STEP = '''
if fresh:
    value = {g}
    slope = ({gs}) * {third}
    if order == 1:
        value, slope = 0.0, known * {third}
{new}
n1, n2 = {c} * w1 - {s} * w2, {s} * w1 + {c} * w2
e = {bound}
high = {gn}
slope1 = ({gsn}) * {third}
b1, b2 = value + slope, high - slope1
if fresh and order > 0:
    clear = order == 1 and b1 < 0.0 and b2 + 16.0 / 3.0 * e < 0.0 and high < 0.0
else:
    clear = max(max(value, high), max(b1, b2)) + e < 0.0
found = False
part = min({h}, left)
if not clear:
    if not fresh:
        order = 0
{series}
    if order == 1:
        a[1] = known
    first_zero(a, order, part, {noise}, out, stack)
    found = out[0] < np.inf
if not found and left >= {h}:
    {take}
    value, slope, fresh = high, slope1, False
    left -= {h}
    continue
s = out[0] if found else part
{polynomials}
if not found:
    left = 0.0
    continue
left -= s
events += 1
if events > limit:
    left = 0.0
    continue
angle = {omega} * ({period} - left)
w1, w2 = np.cos(angle), np.sin(angle)
fresh = True
'''

IMPACT = '''
{place} = {gap}
arrive = out[1]
{speed} = 0.0
push = {push}
span = 2.0 * {r} * arrive
unit = {close} * push
if push > 0.0 and span <= unit * {h} and span * {kappa} <= unit and span * abs({push_rate}) <= unit * push:
    rest, order = True, 0
else:
    known = -{r} * arrive
    {speed} = known
    order = 1
'''

RELEASE = '''
rest, order = False, 3
'''


class Numbers:
    """Texts of numbers: themselves, or the places of an array."""

    def __init__(self, literal: bool):
        self.literal = literal
        self.values: list[float] = []

    def text(self, value) -> str:
        """Return the text that stands for a number."""
        if self.literal:
            return repr(float(value))
        self.values.append(float(value))
        return f"k[{len(self.values) - 1}]"

    def linear(self, row: np.ndarray, names: list[str], sizes: bool = False) -> str:
        """Return the text of a linear form, terms that are zero left out; an empty name stands for 1."""
        terms = []
        for value, name in zip(row, names, strict=True):
            if value != 0.0:
                factor = f"abs({name})" if sizes else name
                terms.append(f"{self.text(value)} * {factor}" if name else self.text(value))
        return " + ".join(terms) or "0.0"


def written(T: Tables, literal: bool = True) -> tuple[str, np.ndarray]:
    """Return the source for a scene of a free mode and a mode at rest on one rigid stop above, and its numbers.

    Parameters
    ----------
    T : Tables
        Of the scene, any number of degrees of freedom; one harmonic, k = 1.
    literal : bool
        Numbers as literals; else the source reads them from the array that is returned.
    """
    if T.n_guards.tolist() != [1, 1] or sorted(T.n_holds.tolist()) != [0, 1] or T.harmonics.tolist() != [1]:
        raise ValueError("the scene must have one rigid stop and one harmonic")
    ns = T.A.shape[1]
    free, held = (0, 1) if T.n_holds[0] == 0 else (1, 0)
    omega = float(T.flat[0])
    period = 2.0 * np.pi / omega
    names = [f"y{i}" for i in range(ns)]
    k = Numbers(literal)
    blocks = [_indent(_step(T, m, names, omega, period, k) + end, 20)
              for m, end in ((free, _impact(T, free, held, names, k)), (held, RELEASE))]
    text = HEAD.format(ns=ns, rows=ORDER + 1, load="; ".join(f"{name} = X[i, {i}]" for i, name in enumerate(names)),
                       period=k.text(period), tiny=k.text(4.0 * np.finfo(float).eps * period), free=blocks[0],
                       held=blocks[1],
                       store="; ".join(f"X[i, {i}] = {name}" for i, name in enumerate(names)))
    return text, np.array(k.values)


def _step(T: Tables, m: int, names: list[str], omega: float, period: float, k: Numbers) -> str:
    n = len(names) // 2
    x = [*names, "", "w1", "w2"]
    h = float(T.step[m])
    new = [*(f"n{name}" for name in names), "", "n1", "n2"]
    polynomials = []
    for i in range(n):
        rows = [k.linear(T.YT[m, i, :, j], x) for j in range(ORDER + 1)]
        if all(row == "0.0" for row in rows[1:]):
            polynomials.append(f"q{i}, u{i} = {rows[0]}, 0.0")
            continue
        polynomials += [f"c{j} = {row}" for j, row in enumerate(rows)]
        polynomials.append(f"p, d = c{ORDER}, 0.0")
        polynomials += [f"d = d * s + p; p = p * s + c{j}" for j in range(ORDER - 1, -1, -1)]
        polynomials.append(f"q{i}, u{i} = p, d")
    polynomials.append(", ".join(names) + " = " + ", ".join([f"q{i}" for i in range(n)] + [f"u{i}" for i in range(n)]))
    return STEP.format(
        g=k.linear(T.G[m, 0], x), gs=k.linear(T.GT[m, 0, :, 1], x), gn=k.linear(T.G[m, 0], new),
        gsn=k.linear(T.GT[m, 0, :, 1], new), third=k.text(h / 3.0), h=k.text(h), c=k.text(T.turn[m, 1]),
        s=k.text(T.turn[m, 2]), new="\n".join(f"n{name} = {k.linear(T.E[m, i], x)}" for i, name in enumerate(names)),
        bound=k.linear(T.G4[m, 0], x, sizes=True),
        series="\n".join(f"    a[{j}] = {k.linear(T.GT[m, 0, :, j], x)}" for j in range(ORDER + 1)),
        noise=f"{4.0 * np.finfo(float).eps!r} * ({k.linear(np.abs(T.G[m, 0]), x, sizes=True)})",
        take=", ".join([*names, "w1", "w2"]) + " = " + ", ".join([*(f"n{name}" for name in names), "n1", "n2"]),
        polynomials="\n".join(polynomials), omega=k.text(omega), period=k.text(period))


def _impact(T: Tables, free: int, held: int, names: list[str], k: Numbers) -> str:
    ns, n = len(names), len(names) // 2
    x = [*names, "", "w1", "w2"]
    place = int(np.argmax(np.abs(T.G[free, 0, :n])))
    push = 2.0 * T.GT[free, 0, :, 2]
    rate = push[:ns] @ T.A[held]
    omega = float(T.flat[0])
    rate[ns + 1] += omega * push[ns + 2]
    rate[ns + 2] -= omega * push[ns + 1]
    r = T.ratio[free, 0]
    return IMPACT.format(place=names[place], speed=names[n + place],
                         gap=k.text(-T.G[free, 0, ns] / T.G[free, 0, place]), push=k.linear(push, x),
                         r=k.text(r), close=k.text(CLOSE * (1.0 - r)), h=k.text(T.step[free]),
                         kappa=k.text(abs(push[:ns] @ T.B[free, 0])), push_rate=f"({k.linear(rate, x)})")


def _indent(text: str, by: int) -> str:
    return "\n".join(" " * by + line if line else line for line in text.strip("\n").splitlines())
