"""Law functions of a scene without laws.  The module written for a scene with laws takes this one's place."""
import numpy as np

from .._jit import njit

FIRST = np.zeros(1, np.int64)  # first row of the law that owns a row
COUNT = np.zeros(1, np.int64)  # number of rows of that law
WIDTH = 1  # largest number of rows of one law


@njit
def forces(T, m, u, s, f):
    """Write the force of every law row at the nodes: ``u``, ``s`` and ``f`` are (rows, nodes)."""


@njit
def slopes(T, m, u, s, f, fu, fs):
    """Write force and derivatives ``fu``, ``fs`` (rows, WIDTH, nodes) in the coordinates and speeds of the law's own rows."""
