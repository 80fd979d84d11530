"""How far a balance is from the motion: one Newton step in more harmonics, whose residual the kept ones leave.

To first order the step is the error (Urabe 1965 bounds it with the same residual), and a tenth more is stated; it holds
what truncation does to the kept harmonics as well.  What lies beyond that set is estimated from how the step falls
towards its end.
"""
import numpy as np

from .balance import Balance
from .condensation.condensed import Condensed
from .layout import Layout
from .status import ContactStatus

LARGE = 700  # unknowns up to which the step is solved with all couplings
ROUGH = 0.01  # of the motion: a step so large is made twice
SAFETY = 1.1  # an elastic slider was 7 % farther than the step says, with five harmonics
NEXT = 2  # the doubled set reaches to this many times the top harmonic;
FAR, FEW = 4, 600  # where there are no more unknowns than these, to so many: what lies beyond twice the top harmonic moved the kept
# ones of a slider as much again


def longer(layout: Layout, factor: int = NEXT) -> Layout:
    """Return the layout with the harmonics up to ``factor`` times its top; only odd ones if it holds only odd ones."""
    step = 2 if all(k % 2 for k in layout.harmonics) else 1
    stop = factor * layout.top + 1 if layout.top > 1 else 4
    return Layout((*layout.harmonics, *range(layout.top + step, stop, step)), layout.n, layout.periods)


def truncation(balance: Balance, x, condensed: Condensed | None = None) -> np.ndarray | None:
    """Return an estimate (n,) of the largest distance of each coordinate from the motion; None where it cannot be made.

    Parameters
    ----------
    balance : Balance
    x : ndarray (size,)
        Its solution.
    condensed : Condensed, optional
        The same balance in few coordinates, in which the step is then made.
    """
    layout = balance.layout
    more = longer(layout, FAR if FAR * layout.size <= FEW else NEXT)
    moved, step = layout.moved(x, more), None
    for samples in dict.fromkeys((0, balance.samples)):  # events found exactly tell what samples leave out, too
        wide = Balance(balance.system, more, samples if samples == 0 or samples > 4 * more.top else 8 * more.top)
        longer_set = None if condensed is None else Condensed(wide, like=condensed)
        step = _step(wide, moved, layout, longer_set)
        if step is not None and np.isfinite(step).all():
            break
    if step is None or not np.isfinite(step).all():
        return None
    sizes = _sizes(more, step)
    if np.abs(step).max() > ROUGH * np.abs(moved).max():  # far from the motion one step is not all
        again = _step(wide, moved - step, layout, longer_set)
        if again is None or not np.isfinite(again).all():
            return None
        sizes = sizes + _sizes(more, again)
    new = np.array([k not in layout.harmonics for k in more.harmonics])
    upper = sizes[new]
    # the sum beyond the end, as of a series that falls by the same factor from one doubling to the next
    half = len(upper) // 2
    first, last = upper[:half].sum(axis=0), upper[half:].sum(axis=0)
    ratio = np.divide(last, first, out=np.zeros_like(last), where=first > 0.0)
    tail = last * np.clip(ratio, 0.0, 0.9) / (1.0 - np.clip(ratio, 0.0, 0.9))
    return SAFETY * (sizes.sum(axis=0) + tail)


def _sizes(layout: Layout, step) -> np.ndarray:
    """Return the amplitude of every harmonic of every coordinate (harmonics, n) of a step (size,)."""
    return np.array([[abs(layout.phasor(step, k, dof)) for dof in range(layout.n)] for k in layout.harmonics])


def _step(wide: Balance, moved, layout: Layout, condensed: Condensed | None) -> np.ndarray | None:
    """Return Newton's step (size,) in the larger set, in few coordinates, or in new harmonics alone if it is large; None where
    there is none."""
    if condensed is not None:
        return moved - condensed.stepped(moved, condensed.size <= LARGE)
    more = wide.layout
    status, f, J = wide.linearised(moved, slopes=more.size <= LARGE)
    if status is not ContactStatus.FOLLOWED:
        return None
    f = f.copy()
    if more.size <= LARGE:
        try:
            step = np.linalg.solve(J[:, :-1], f)
        except np.linalg.LinAlgError:
            return None
    else:
        step = np.zeros(more.size)
        for k in more.harmonics:
            if k not in layout.harmonics:
                slot = more.slot(k) * layout.n
                phasor = np.linalg.solve(wide.stiffness(k), f[slot:slot + layout.n] - 1j * f[slot + layout.n:slot + 2 * layout.n])
                step[slot:slot + layout.n], step[slot + layout.n:slot + 2 * layout.n] = phasor.real, -phasor.imag
    return step
