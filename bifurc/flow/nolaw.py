"""Law functions of a scene without laws.  The module written for a scene with laws takes this one's place."""
import numpy as np

from .._jit import njit

NAME = "bifurc_step_nolaw"  # of the step as a symbol
DOFS = 0  # degrees of freedom; 0: as the tables say
ROWS = 0  # rows of all laws
FIRST = np.zeros(1, np.int64)  # first row of the law that owns a row
COUNT = np.zeros(1, np.int64)  # number of rows of that law
WIDTH = 1  # largest number of rows of one law


@njit
def forces(law, acts, m, nodes, local):
    """Write the forces ``local[2]`` (rows, nodes) of all laws from coordinates ``local[0]`` and speeds ``local[1]``."""


@njit
def slopes(law, acts, m, h, nodes, local, slope):
    """Write derivatives ``slope`` (2, rows, WIDTH, nodes) of the forces by coordinates and speeds of the own rows."""
