"""Explicit Runge-Kutta methods of fixed step for x'' = f(t, x, x'), written so that only the values of f are kept.

With the stages' velocities V_i = v + h sum_j a_ij f_j put into X_i = x + h sum_j a_ij V_j,

    X_i = x + c_i h v + h^2 sum_j (a^2)_ij f_j,    x(h) = x + h v + h^2 sum_j (b a)_j f_j,    v(h) = v + h sum_j b_j f_j.
"""
from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from ...enumerations import DescribedEnum


class Method(DescribedEnum):
    """Which method carries smooth fields."""

    RK4 = "rk4", "Classical Runge-Kutta method, 4 stages, order 4."
    RK8 = "rk8", "Method of Dormand and Prince, 12 stages, order 8."


class Nystrom(NamedTuple):
    """Coefficients of a method in the form above."""

    order: int
    c: np.ndarray  # (stages,) times
    position: np.ndarray  # (stages, stages) a^2
    velocity: np.ndarray  # (stages, stages) a
    last_position: np.ndarray  # (stages,) b a
    last_velocity: np.ndarray  # (stages,) b


def nystrom(method: Method) -> Nystrom:
    """Return the coefficients of a method.

    Those of order 8 are in scipy (Hairer, Norsett, Wanner, Solving ordinary differential equations I, 1993, code DOP853).
    """
    if method is Method.RK8:
        order, a, b = 8, DOP853.A, DOP853.B
    else:
        order, a, b = 4, np.diag([0.5, 0.5, 1.0], -1), np.array([1.0, 2.0, 2.0, 1.0]) / 6.0
    return Nystrom(order, a.sum(axis=1), a @ a, a, b @ a, b)
