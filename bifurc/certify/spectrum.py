"""Multipliers in balls: the derivative over a period through its events, eigenvalue enclosures, and how many lie inside the circle.

Between events the derivative is exp(B s); through an event, in the joined state, S = R + (B+ R x - R B- x) G / (G B- x).  How many
zeros of the characteristic polynomial lie inside the unit circle follows from the signs of a Schur-Cohn table (P. Henrici, Applied
and Computational Complex Analysis I (1974), theorem 6.8b): with T p = conj(p_0) p - p_n p*, it is the number of negative products
of the constants of T p, T^2 p, ...
"""
from .arithmetic.balls import flint
from .arithmetic.forms import Form, hull


def saltations(pieces, solved) -> list | None:
    """Return the derivatives of all events, in the arithmetic of what was evaluated (balls or forms); None at zero impact speed."""
    jumps: list = []
    for i, G in enumerate(pieces.G):
        R, x = pieces.R[i].parts[0], solved.x[i].parts[0]
        if G is None:
            jumps.append(R)
            continue
        before, after, row = pieces.B[i - 1].parts[0], pieces.B[i].parts[0], G.parts[0]
        arriving = before * x
        speed = (row * arriving)[0, 0]
        if hull(speed).contains(0):
            return None
        jump = after * (R * x) - R * arriving
        jumps.append(R + jump * row * (1 / speed if not isinstance(speed, Form) else speed.reciprocal()))
    return jumps


def monodromy(flows, jumps, ns: int, kept=(), rows=()):
    """Return the derivative of the period map just before the first event, without the states that label a family.

    Parameters
    ----------
    flows, jumps : list of arb_mat (nx, nx)
        exp(B s) behind each event, and the derivative of each event.
    ns, kept, rows : int, tuple of int, list of lists of arb
        Number of states; places and rows of what labels the family.
    """
    M = None
    for Phi, S in zip(flows, jumps, strict=True):
        step = Phi * S
        M = step if M is None else step * M
    assert M is not None
    return reduced(M, ns, kept, rows)


def reduced(M, ns: int, kept, rows):
    """Return a matrix (arb_mat) on the perturbations that do not change the labels of a family, see `Labels.reduced`."""
    free = [c for c in range(ns) if c not in kept]
    return flint().arb_mat(len(free), len(free), [
        sum((-M[i, c] * row[j] for c, row in zip(kept, rows, strict=True)), M[i, j]) for i in free for j in free])


def characteristic(M) -> list:
    """Return the coefficients of det(z - M), ascending."""
    poly = M.charpoly()
    return [poly[k] for k in range(M.nrows() + 1)]


def inside_count(coefficients: list) -> int | None:
    """Return how many zeros of a real polynomial lie inside the unit circle, none being on it; None: undecided."""
    p = list(coefficients)
    while len(p) > 1 and p[0] == 0:  # zeros at the origin, exactly
        p = p[1:]
    count = len(coefficients) - len(p)
    sign = 1
    while len(p) > 1:
        first, last = p[0], p[-1]
        constant = first * first - last * last
        if constant > 0:
            pass
        elif constant < 0:
            sign = -sign
        else:
            return None
        if sign < 0:
            count += 1
        p = [first * a - last * b for a, b in zip(p[:-1], p[:0:-1], strict=True)]
        scale = max((abs(float(v.mid())) for v in p), default=0.0)
        if scale > 0.0:
            p = [v / scale for v in p]
    return count


def stable(coefficients: list) -> bool | None:
    """Return whether all zeros lie inside the unit circle (True), some outside (False), or what is undecided (None)."""
    degree = len(coefficients) - 1
    found = inside_count(coefficients)
    if found is not None:
        return found == degree
    if abs(coefficients[0]) > 1:
        return False  # the product of the multipliers
    for z in (1, -1):  # one real zero beyond 1 or -1 at least
        value = flint().arb(0)
        for c in reversed(coefficients):
            value = value * z + c
        if value * (1 if z == 1 or degree % 2 == 0 else -1) < 0:
            return False
    return None


def eigenvalues(M) -> list:
    """Return enclosures (acb) of the eigenvalues of a real matrix of balls, one each; wide where none can be isolated."""
    acb, arb = flint().acb, flint().arb
    size = M.nrows()
    if size == 0:
        return []
    if size == 1:
        return [acb(M[0, 0])]
    if size == 2:
        half = (M[0, 0] + M[1, 1]) / 2
        d = ((M[0, 0] - M[1, 1]) / 2) * ((M[0, 0] - M[1, 1]) / 2) + M[0, 1] * M[1, 0]
        if d > 0:
            root = d.sqrt()
            return [acb(half + root), acb(half - root)]
        if d < 0:
            root = (-d).sqrt()
            return [acb(half, root), acb(half, -root)]
        reach = abs(d).upper().sqrt().upper()
        wide = acb(half + arb(0, reach), arb(0, reach))
        return [wide, wide]
    whole = flint().acb_mat(M)
    try:
        return whole.eig(multiple=True)
    except (ValueError, ZeroDivisionError):
        reach = arb(0)
        for i in range(size):
            reach = reach.max(sum((abs(M[i, j]) for j in range(size)), arb(0)))
        radius = reach.upper()
        return [acb(arb(0, radius), arb(0, radius))] * size
