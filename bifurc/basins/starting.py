"""In which mode a start begins: the clear cases, compiled; the rest goes to `bifurc.flow.settle`."""
import numpy as np

from .._jit import njit
from ..flow.scan import NOISE, PENETRATION

BEYOND = -1  # the start lies beyond a rigid stop
UNCLEAR = -2  # on a surface, or with no clear mode: Python decides


@njit
def begin(T, candidates, X, modes):
    """Write into ``modes`` (N,) the mode in which each of the starts ``X`` (N, ns) at phase 0 begins.

    ``candidates`` are scene modes in the order they are tried (`Scene.start_modes`).
    """
    G, H, S, LG, n_guards, n_holds, kick = T.G, T.H, T.S, T.LG, T.n_guards, T.n_holds, T.kick
    ns, nx = T.A.shape[1], T.A.shape[2]
    x = np.empty(nx)
    scale = np.ones(nx)
    for c in range(ns, nx):  # w = (1, cos 0, sin 0, ...)
        x[c] = 1.0 if c == ns or (c - ns) % 2 == 1 else 0.0
    for i in range(X.shape[0]):
        for c in range(ns):
            x[c] = X[i, c]
            scale[c] = abs(x[c])
        modes[i] = UNCLEAR
        beyond = False
        for k in range(candidates.shape[0]):
            m = candidates[k]
            good = True
            for h in range(n_holds[m]):
                speed, speeds, place, places = 0.0, 0.0, 0.0, 0.0
                for c in range(nx):
                    speed += H[m, h, c] * x[c]
                    speeds += abs(H[m, h, c]) * scale[c]
                    place += S[m, h, c] * x[c]
                    places += abs(S[m, h, c]) * scale[c]
                good = good and abs(speed) <= NOISE * speeds and abs(place) <= NOISE * places
            clear = True
            for g in range(n_guards[m]):
                value, size = 0.0, 0.0
                for c in range(nx):
                    value += G[m, g, c] * x[c]
                    size += abs(G[m, g, c]) * scale[c]
                if value > PENETRATION * size:
                    good = False
                    beyond = beyond or kick[m, g] == 1
                elif value >= -NOISE * size:
                    clear = False
                for r in range(LG.shape[2]):  # the guard also feels a law
                    clear = clear and LG[m, g, r] == 0.0
            if not clear:
                beyond = False
                break
            if good:
                modes[i] = m
                break
        if beyond and modes[i] == UNCLEAR:
            modes[i] = BEYOND
