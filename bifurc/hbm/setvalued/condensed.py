"""A linear system condensed to the coordinates that friction touches: per harmonic, S = Z_bb - Z_bi Z_ii^-1 Z_ib.

The balance then costs what the contacts cost, however many other coordinates there are.
"""
from dataclasses import dataclass, replace

import numpy as np

from ..balance import Balance as Core
from ..layout import Layout
from .equations import Contact, Linear

WORST = 1e12  # condition of the inner stiffness from which the coordinates are kept (an undamped inner resonance)


@dataclass(frozen=True)
class Condensed:
    """The condensed balance and the way back.

    Attributes
    ----------
    layout : Layout
        Of the touched coordinates.
    rest : Linear
    contacts : list of Contact
        With rows over the touched coordinates.
    touched : ndarray (n,), bool
    inner : dict
        Harmonic to (Z_ii^-1 Z_ib, Z_ii^-1 f_i).
    whole : Layout
        Of all coordinates.
    """

    layout: Layout
    rest: Linear
    contacts: list[Contact]
    touched: np.ndarray
    inner: dict
    whole: Layout

    def expanded(self, x, load: bool = True) -> np.ndarray:
        """Return the packed coefficients of all coordinates; ``load=False``: of a change of the touched ones."""
        out = {}
        for k in self.layout.harmonics:
            q = np.array([self.layout.phasor(x, k, dof) for dof in range(self.layout.n)])
            full = np.zeros(self.whole.n, complex)
            full[self.touched] = q
            by, free = self.inner[k]
            full[~self.touched] = (free if load else 0.0) - by @ q
            out[k] = full
        return self.whole.pack(out)

    def restricted(self, x) -> np.ndarray:
        """Return the packed coefficients of the touched coordinates."""
        return self.whole.matrix(x)[:, self.touched].ravel()


def condensed(core: Core, contacts) -> Condensed | None:
    """Return the condensed balance; None where every coordinate is touched, or other forces are not linear.

    Parameters
    ----------
    core : Balance
    contacts : sequence of Contact
    """
    layout = core.layout
    touched = np.zeros(layout.n, bool)
    for contact in contacts:
        touched |= contact.row != 0.0
    if core.parts.contacts or core.parts.laws or touched.all() or not touched.any():
        return None
    small = Layout(layout.harmonics, int(touched.sum()), layout.periods)
    m, first = small.n, int(small.mean)
    blocks, load = np.zeros((small.slots, m, small.slots, m)), np.zeros((small.slots, m))
    inner = {}
    for k in layout.harmonics:
        Z = core.stiffness(k)
        slot = layout.slot(k)
        f = core.numbers.E[slot] - (1j * core.numbers.E[slot + 1] if k else 0.0)
        own = Z[np.ix_(~touched, ~touched)]
        if np.linalg.cond(own) > WORST:
            return None
        coupling = Z[np.ix_(touched, ~touched)]
        by, free = np.linalg.solve(own, Z[np.ix_(~touched, touched)]), np.linalg.solve(own, f[~touched])
        inner[k] = by, free
        S, g = Z[np.ix_(touched, touched)] - coupling @ by, f[touched] - coupling @ free
        j = small.slot(k)
        blocks[j, :, j, :], load[j] = S.real, g.real
        if k:
            blocks[j + 1, :, j + 1, :], load[j + 1] = S.real, -g.imag
            blocks[j, :, j + 1, :], blocks[j + 1, :, j, :] = S.imag, -S.imag
    assert first == int(layout.mean)
    return Condensed(small, Linear(blocks.reshape(small.size, small.size), load.ravel()),
                     [replace(contact, row=contact.row[touched]) for contact in contacts], touched, inner, layout)
