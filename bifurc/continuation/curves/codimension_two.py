"""Codimension-2 points on curves of special points: what is tested along a curve of every kind.

The multipliers of a problem are the roots mu of det J(mu) = 0 with J(mu) = J(0) + mu C (`wrapped_jacobian`): of the closing
columns of an event sequence, or of the closing point of a cycle.  On a curve, with w, v the null vectors of J(+-1),

* fold: fold-flip where J(-1) is singular too, 1:1 resonance where w^T C v = 0 (a double multiplier 1),
* flip: fold-flip where J(1) is singular too, 1:2 resonance where w^T C v = 0, generalised flip where the cubic coefficient of
  the doubled equations vanishes,
* torus: strong resonances where the pair on the circle has the angle 0, pi, 2 pi / 3, pi / 2,
* grazing: resonant where s_k = h E^k B = 0 or a multiplier of the touching orbit is +-1, degenerate where the apex acceleration
  vanishes, double where another maximum touches.

References
----------
Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory (2004), chapter 9; W. Govaerts, Numerical Methods for Bifurcations of
Dynamical Equilibria (2000); D. J. W. Simpson, R. Ghosh, arXiv 2602.22797 (resonant grazing).
"""
from functools import partial

import numpy as np

from ..conditions import smallest
from ..grazing.following import POWERS, Touching
from ..kinds import SpecialPointKind
from ..problem import Monitor

STEP = 2e-2  # scaled step of directional Taylor coefficients
K = SpecialPointKind


def watched(base, condition, kind):
    """Return ``(monitors, function)`` for a curve of ``kind``: ``function(problem, x)`` gives their values.

    ``x`` (n + 1,) are unknowns and the first parameter; ``problem`` is that at the second.
    """
    if isinstance(condition, Touching) and condition.constant:  # nothing tells one instant of the touch from another
        return (), None
    if isinstance(condition, Touching):
        monitors = (Monitor(K.DEGENERATE_GRAZING, boundary=True), Monitor(K.DOUBLE_GRAZING, boundary=True),
                    Monitor(K.RESONANT_GRAZING, "fold"), Monitor(K.RESONANT_GRAZING, "flip"),
                    *(Monitor(K.RESONANT_GRAZING, f"s_{k}") for k in range(1, POWERS + 1)))
        return monitors, condition.values
    if kind is K.NEIMARK_SACKER:  # behind 1:1 and 1:2 the pair is real: no torus
        kinds = (K.RESONANCE_1_1, K.RESONANCE_1_2, K.RESONANCE_1_3, K.RESONANCE_1_4)
        return tuple(Monitor(kind, boundary=kind in kinds[:2]) for kind in kinds), cosines
    if not base.wraps:
        return (), None
    if kind is K.FOLD:
        return (Monitor(K.FOLD_FLIP), Monitor(K.RESONANCE_1_1)), _joined(second(-1.0), double(1.0))
    if kind is K.PERIOD_DOUBLING:
        return ((Monitor(K.FOLD_FLIP), Monitor(K.RESONANCE_1_2), Monitor(K.GENERALIZED_FLIP)),
                _joined(second(1.0), double(-1.0), cubic_coefficient))
    return (), None


def _joined(*functions):
    return partial(_values, functions)


def _values(functions, problem, x):
    return [function(problem, x) for function in functions]


def pencil_at(problem, x, mu):
    """Return J(mu) and C (n, n) in scaled unknowns."""
    scale = problem.scale[:-1]
    one, zero = (problem.wrapped_jacobian(x, value) * scale for value in (1.0, 0.0))
    return one + (mu - 1.0) * (one - zero), one - zero


def second(mu):
    """Return the test for a further multiplier ``mu``."""
    return partial(_second, mu)


def _second(mu, problem, x):
    return smallest(pencil_at(problem, x, mu)[0])[0]


def double(mu):
    """Return the test for a double multiplier ``mu`` where one is there: w^T C v, whose sign does not depend on those of w, v."""
    return partial(_double, mu)


def _double(mu, problem, x):
    J, C = pencil_at(problem, x, mu)
    _, w, v = smallest(J)
    return float(w @ C @ v)


def cosines(problem, x):
    """Return tests of 1:1, 1:2, 1:3, 1:4 from cos(theta) of the pair of multipliers whose product is nearest to 1.

    The first two are negative where the pair is complex.
    """
    c = problem.pencil(x)
    if c is not None and c.size == 3:  # smooth where the two meet
        cosine = -0.5 * c[1] / c[2]
    else:
        mu = problem.multipliers_at(x) if c is None else np.roots(c[::-1])
        cosine = min((abs(mu[i] * mu[j] - 1.0), 0.5 * float(np.real(mu[i] + mu[j])))
                     for i in range(len(mu)) for j in range(i))[1]
    return [cosine - 1.0, -1.0 - cosine, cosine + 0.5, cosine]


def cubic_coefficient(problem, x):
    """Return the cubic coefficient of the doubled equations at a flip: its zero is a generalised flip.

    With F(U) = 0 run through twice, a the Taylor coefficients of F along a direction, phi and psi the null vectors of F_1:
    psi [a_3(phi) + F_2(phi, eta)], F_1 eta = -a_2(phi) (Lyapunov and Schmidt; Golubitsky and Schaeffer 1985).
    """
    twice, X = problem.repeated(x)
    scale = twice.scale[:-1]
    p = float(X[-1])
    nodes = np.arange(-4, 5)
    invert = np.linalg.inv(np.vander(nodes, increasing=True))

    def along(direction):
        values = [np.reshape(twice.residual(X[:-1] + STEP * k * scale * direction, p), scale.size) for k in nodes]
        return (invert @ values)[:4] / STEP**np.arange(4)[:, None]
    J = twice.wrapped_jacobian(X, 1.0) * scale
    _, psi, phi = smallest(J)
    first = along(phi)
    u, s, vt = np.linalg.svd(J)
    eta = -vt[:-1].T @ ((u[:, :-1].T @ first[2]) / s[:-1])
    size = float(np.linalg.norm(eta))
    mixed = np.zeros_like(phi)
    if size > 0.0:
        root = np.sqrt(0.5)
        mixed = size * (along(root * (phi + eta / size))[2] - along(root * (phi - eta / size))[2])
    return float(psi @ (first[3] + mixed))
