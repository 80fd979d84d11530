"""Explicit Runge-Kutta methods of fixed step for x'' = f(t, x, x'), written so that only the values of f are kept.

With the stages' velocities V_i = v + h sum_j a_ij f_j put into X_i = x + h sum_j a_ij V_j,

    X_i = x + c_i h v + h^2 sum_j (a^2)_ij f_j,    x(h) = x + h v + h^2 sum_j (b a)_j f_j,    v(h) = v + h sum_j b_j f_j.
"""
from typing import NamedTuple

import numpy as np

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


# Dormand and Prince, 12 stages of order 8 (Hairer, Norsett, Wanner, Solving ordinary differential equations I, 1993, code
# DOP853): rows of a, then b; missing entries are 0
_RK8: tuple[dict[int, float], ...] = (
    {},
    {0: 0.05260015195876773},
    {0: 0.0197250569845379, 1: 0.0591751709536137},
    {0: 0.02958758547680685, 2: 0.08876275643042054},
    {0: 0.2413651341592667, 2: -0.8845494793282861, 3: 0.924834003261792},
    {0: 0.037037037037037035, 3: 0.17082860872947386, 4: 0.12546768756682242},
    {0: 0.037109375, 3: 0.17025221101954405, 4: 0.06021653898045596, 5: -0.017578125},
    {0: 0.03709200011850479, 3: 0.17038392571223998, 4: 0.10726203044637328, 5: -0.015319437748624402,
     6: 0.008273789163814023},
    {0: 0.6241109587160757, 3: -3.3608926294469414, 4: -0.868219346841726, 5: 27.59209969944671,
     6: 20.154067550477894, 7: -43.48988418106996},
    {0: 0.47766253643826434, 3: -2.4881146199716677, 4: -0.590290826836843, 5: 21.230051448181193,
     6: 15.279233632882423, 7: -33.28821096898486, 8: -0.020331201708508627},
    {0: -0.9371424300859873, 3: 5.186372428844064, 4: 1.0914373489967295, 5: -8.149787010746927,
     6: -18.52006565999696, 7: 22.739487099350505, 8: 2.4936055526796523, 9: -3.0467644718982196},
    {0: 2.273310147516538, 3: -10.53449546673725, 4: -2.0008720582248625, 5: -17.9589318631188, 6: 27.94888452941996,
     7: -2.8589982771350235, 8: -8.87285693353063, 9: 12.360567175794303, 10: 0.6433927460157636},
)
_RK8_WEIGHTS = (
    {0: 0.054293734116568765, 5: 4.450312892752409, 6: 1.8915178993145003, 7: -5.801203960010585,
     8: 0.3111643669578199, 9: -0.1521609496625161, 10: 0.20136540080403034, 11: 0.04471061572777259}
)
_RK4: tuple[dict[int, float], ...] = ({}, {0: 0.5}, {1: 0.5}, {2: 1.0})
_RK4_WEIGHTS = {0: 1.0 / 6.0, 1: 1.0 / 3.0, 2: 1.0 / 3.0, 3: 1.0 / 6.0}


def nystrom(method: Method) -> Nystrom:
    """Return the coefficients of a method."""
    order, rows, weights = {Method.RK4: (4, _RK4, _RK4_WEIGHTS), Method.RK8: (8, _RK8, _RK8_WEIGHTS)}[method]
    a = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        for j, value in row.items():
            a[i, j] = value
    b = np.zeros(len(rows))
    for j, value in weights.items():
        b[j] = value
    return Nystrom(order, a.sum(axis=1), a @ a, a, b @ a, b)
