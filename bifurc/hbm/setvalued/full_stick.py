"""Rest under set-valued friction: the load fits between the bounds, so no contact ever slips."""
import numpy as np

from ..layout import Layout
from .equations import Balance, Contact, Linear, SetValuedResult, SetValuedStatus
from .sign_pattern import Pattern, grid_size, on_grid

ROUNDING = 1e-12  # over the limit: by so much a force may exceed its bounds


def at_rest(balance: Balance, tolerance: float, iterations: int) -> SetValuedResult | None:
    """Return the solution without any slip, if its forces fit between the bounds; None otherwise.

    The contacts are tied (s = 0 in the kept harmonics) by multipliers whose means, arbitrary there, are chosen in the
    middle of what the bounds leave.
    """
    layout, contacts = balance.layout, balance.contacts
    if any(np.any(contact.speed) for contact in contacts):
        return None
    rows = np.array([contact.row for contact in contacts])
    first, slots = int(layout.mean), layout.slots
    x, lam = np.zeros(layout.size), np.zeros((slots, len(rows)))
    waving = np.arange(slots) >= first
    ties = np.zeros((0, layout.size)) if isinstance(balance.rest, Linear) else _ties(layout, rows, waving)
    count = 0
    middle = np.array([0.5 * (contact.upper[0] + contact.lower[0]).real for contact in contacts])
    for _ in range(4):  # the means of the multipliers move the mean position only
        if first:
            lam[0] = middle
        if isinstance(balance.rest, Linear):
            x, lam[waving] = _tied(layout, balance.rest, rows, lam)
            count = 1
        for _ in range(0 if isinstance(balance.rest, Linear) else iterations):
            count += 1
            r, j = balance.rest(x)
            if not (np.isfinite(r).all() and np.isfinite(j).all()):
                return None
            r = r + (lam @ rows).ravel()
            stiff = _stiffness(j)
            saddle = np.block([[j, stiff * ties.T], [stiff * ties, np.zeros((len(ties), len(ties)))]])
            right = -np.concatenate([r, stiff * (ties @ x)])
            step = np.linalg.lstsq(saddle, right, rcond=1e-13)[0]
            x = x + step[:layout.size]
            lam[waving] += stiff * step[layout.size:].reshape(-1, len(rows))
            if np.abs(right).max() <= tolerance or np.abs(step[:layout.size]).max() <= 1e-14 * (np.abs(x).max() + 1e-300):
                break
        r = balance.rest(x)[0] + (lam @ rows).ravel()
        size = float(np.abs(r).max())
        if size > 1e3 * tolerance:
            return None
        room, now = [], lam[0].copy() if first else np.zeros(len(rows))
        for i, contact in enumerate(contacts):
            low, high = allowance(layout, lam[:, i], contact)
            if high < low <= high + ROUNDING * contact.limit:  # the load just fits
                low = high = 0.5 * (low + high)
            room.append((low, high))
            now[i] += 0.5 * (low + high) if np.isfinite(low + high) else 0.0
        if any(low > high for low, high in room):
            return None
        if not first:
            if any(low > 0.0 or high < 0.0 for low, high in room):
                return None
            break
        if np.abs(now - middle).max() <= 1e-12 * max(contact.limit for contact in contacts):
            break
        middle = now
    kinds = tuple(Pattern(np.zeros(1, complex), np.zeros(1, complex), np.zeros(0), np.zeros(1, int)) for _ in contacts)
    return SetValuedResult(x, SetValuedStatus.RESTS, size, count, balance.evaluations, np.zeros(len(contacts)), kinds, (),
                           tuple(room))


def _ties(layout: Layout, rows, waving) -> np.ndarray:
    """Return the rows of every slot but the mean, (slots of waves times contacts, size)."""
    blocks = np.zeros((int(waving.sum()), len(rows), layout.slots, layout.n))
    for i, slot in enumerate(np.flatnonzero(waving)):
        blocks[i, :, slot, :] = rows
    return blocks.reshape(-1, layout.size)


def _tied(layout: Layout, rest: Linear, rows, lam) -> tuple[np.ndarray, np.ndarray]:
    """Return coefficients and multipliers (without means) of a linear system, harmonic by harmonic."""
    n, m, first = layout.n, len(rows), int(layout.mean)
    Z = rest.blocks.reshape(layout.slots, n, layout.slots, n)
    load = layout.matrix(rest.load)
    x, found = np.zeros((layout.slots, n)), np.zeros((layout.slots - first, m))
    if first:
        x[0] = np.linalg.lstsq(Z[0, :, 0, :], load[0] - lam[0] @ rows, rcond=None)[0]
    for j in range(first, layout.slots, 2):
        stiffness = Z[j, :, j, :] + 1j * Z[j, :, j + 1, :]
        stiff = _stiffness(stiffness)
        saddle = np.block([[stiffness, stiff * rows.T], [stiff * rows, np.zeros((m, m))]])
        answer = np.linalg.lstsq(saddle, np.concatenate([load[j] - 1j * load[j + 1], np.zeros(m)]), rcond=1e-13)[0]
        x[j], x[j + 1] = answer[:n].real, -answer[:n].imag
        found[j - first], found[j - first + 1] = stiff * answer[n:].real, -stiff * answer[n:].imag
    return x.ravel(), found


def _stiffness(matrix) -> float:
    """Return by what ties are multiplied beside a dynamic stiffness: which singular values are zero is no matter of units."""
    return float(np.abs(matrix).max()) or 1.0


def allowance(layout: Layout, force, contact: Contact) -> tuple[float, float]:
    """Return how far the mean of a contact force (slots,) may be shifted down and up inside the bounds.

    The first exceeds the second when no shift fits.
    """
    first, k = int(layout.mean), layout.positive
    c = np.zeros(layout.top + 1, complex)
    if first:
        c[0] = force[0]
    c[k] = force[first::2] - 1j * force[first + 1::2]
    count = 4 * grid_size(max(layout.top, len(contact.upper)))
    r, up, low = on_grid(c, count), on_grid(contact.upper, count), on_grid(contact.lower, count)
    apart = up < low
    up, low = np.where(apart, 0.0, up), np.where(apart, 0.0, low)
    return float((low - r).max()), float((up - r).min())
