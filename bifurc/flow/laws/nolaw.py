"""Law functions of a scene without laws.  The module written for a scene with laws takes this one's place."""
import numpy as np

from ..._jit import njit

DOFS = 1  # degrees of freedom
ROWS = 0  # rows of all laws
FORCES = 0  # rows of force laws, the first ones
ACTING = 0  # and of reactions of constraints on curves, behind them; what is left are guards, impulses, and starts on curves
WIDTH = 1  # largest number of rows of one law
SOURCE = np.zeros(1, np.int64)  # row whose coordinates, speeds and accelerations a row sees: itself, or the same of an earlier law
FIRST = np.zeros(1, np.int64)  # first row of the law that owns a row
COUNT = np.zeros(1, np.int64)  # number of rows of that law


@njit
def forces(law, acts, m, nodes, local):
    """Write the forces ``local[2]`` (rows, nodes) of all laws from coordinates ``local[0]`` and speeds ``local[1]``."""


@njit
def reactions(law, acts, m, nodes, local):
    """Write the reactions ``local[2]`` of constraints on curves, from accelerations ``local[3]`` too."""


@njit
def watches(law, acts, m, nodes, local):
    """Write the values ``local[2]`` of guards that are laws."""


@njit
def slopes(law, acts, m, h, nodes, local, slope):
    """Write derivatives ``slope`` (2, rows, WIDTH, nodes) of the forces by coordinates and speeds of the own rows."""


@njit
def reaction_slopes(law, acts, m, h, nodes, local, slope):
    """As `slopes` for reactions, with the derivatives ``slope[2]`` by accelerations."""


@njit
def watch_slopes(law, acts, m, h, nodes, local, slope):
    """As `slopes` for the values of guards, with the derivatives ``slope[2]`` by accelerations."""


@njit
def kicks(law, acts, m, nodes, owner, closes, local):
    """Write the impulses ``local[2]`` that an element gives at an event; ``closes``: at the end of a complete chattering."""


@njit
def kick_slopes(law, acts, m, h, nodes, owner, closes, local, slope):
    """As `slopes` for impulses."""


@njit
def rests(law, acts, m, nodes, local):
    """Write into ``local[2]`` what must be zero, relative to its terms, where a constraint on a curve begins."""


@njit
def rest_moves(law, acts, m, h, nodes, local, slope):
    """Write into ``slope`` what must be added to coordinates (0) and speeds (1) of a row for `rests` to be zero."""


@njit
def rest_slopes(law, acts, m, nodes, local, slope):
    """Write the derivatives of `rest_moves` into ``slope``: of coordinates by coordinates (0), of speeds by coordinates (1) and by
    speeds (2) of the own rows."""
