"""In which mode a start begins: the clear cases; the rest goes to `bifurc.flow.settle`."""
import numpy as np

from ..compose.tables import Tables
from ..flow.scan import NOISE, PENETRATION

BEYOND = -1  # the start lies beyond a rigid stop
UNCLEAR = -2  # on a surface, or with no clear mode: all elements decide together


def begin(T: Tables, candidates: np.ndarray, X: np.ndarray, modes: np.ndarray) -> None:
    """Write into ``modes`` (N,) the mode in which each of the starts ``X`` (N, ns) at phase 0 begins.

    ``candidates`` are scene modes in the order they are tried (`Scene.start_modes`).
    """
    ns, nx = T.A.shape[1], T.A.shape[2]
    x = np.zeros((len(X), nx))
    x[:, :ns] = X
    x[:, ns] = 1.0
    x[:, ns + 1::2] = 1.0  # cos 0; forcing has the rounding of its amplitude
    scale = np.abs(x)
    scale[:, ns:] = 1.0
    modes[:] = UNCLEAR
    open_, beyond = np.ones(len(X), bool), np.zeros(len(X), bool)
    for m in candidates.tolist():
        good, clear = open_.copy(), np.ones(len(X), bool)
        for rows in (T.H[m, :T.n_holds[m]], T.S[m, :T.n_holds[m]]):
            good &= (np.abs(x @ rows.T) <= NOISE * (scale @ np.abs(rows).T)).all(axis=1)
        for g in range(T.n_guards[m]):
            value, size = x @ T.G[m, g], scale @ np.abs(T.G[m, g])
            past = value > PENETRATION * size
            good &= ~past
            beyond |= open_ & past & (T.kick[m, g] == 1)
            clear &= past | (value < -NOISE * size)
            if T.LG[m, g].any():  # the guard also feels a law
                clear[:] = False
        modes[good & clear] = m
        beyond &= clear | ~open_
        open_ &= clear & ~good
    modes[open_ & beyond] = BEYOND
