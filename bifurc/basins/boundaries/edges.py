"""Edge states: the motion that stays on the boundary between two basins, and the saddle it settles on.

Two starts that lead to different attractors are brought together by bisection and followed; when they have parted, they
are brought together again (J. Skufca, J. Yorke, B. Eckhardt 2006).  The motion between them stays near the boundary
and settles on what attracts there: a saddle, which Newton on the event sequence then finds to rounding.
"""
from dataclasses import dataclass, field

import numpy as np

from ... import plotting
from ...checks import PLACE, array, checked, many, of
from ...content import Content
from ...notebook import Notebook
from ...orbits.orbit import PeriodicOrbit
from ..maps.basin_map import BasinMap
from .search import EdgeStatus, Search
from .stable import stable_set
from .unstable import unstable_set


@dataclass(frozen=True, eq=False)
class EdgeState(Content, Notebook):
    """Edge state: the saddle on the boundary between two basins, and the motion along it.  Made by `edge_state`.

    Attributes
    ----------
    basins : BasinMap
    pair : tuple of int
        The two labels.
    saddle : PeriodicOrbit or None
        Unstable; its multipliers tell in how many directions.
    status : EdgeStatus
    points : ndarray
        Section points (k, ns) of the motion along the boundary, one a forcing period.
    gap : float
        Largest scaled distance to which its two neighbours had separated.
    third : dict
        Other labels met between the two -> number of starts that led there.
    jumps : int
        Times that starts 1e-11 apart separated by more than any slope explains.
    """

    _facts = ("pair", "message", "unstable_directions")

    basins: BasinMap = field(repr=False)
    pair: tuple[int, int]
    saddle: PeriodicOrbit | None
    status: EdgeStatus
    points: np.ndarray = field(repr=False)
    gap: float
    third: dict
    jumps: int

    @property
    def success(self) -> bool:
        """Whether a saddle was found."""
        return self.status is EdgeStatus.SADDLE

    @property
    def message(self) -> str:
        """The status as a sentence, with what else was met."""
        met = ", ".join(f"label {label}: {count} starts" for label, count in sorted(self.third.items()))
        return self.status.sentence + (f" Met between them: {met}." if met else "")

    @property
    def sections(self) -> np.ndarray:
        """States (k, ns) of the saddle at phase 0; none where it was not found."""
        return self.points[:0] if self.saddle is None else self.saddle.sections

    @property
    def unstable_directions(self) -> int:
        """Number of multipliers outside the unit circle; 1: its stable set can be the boundary."""
        return 0 if self.saddle is None else int(np.count_nonzero(np.abs(self.saddle.multipliers) > 1.0))

    def unstable_set(self, **options):
        """Return the unstable set of the saddle, see `bifurc.basins.boundaries.unstable.unstable_set`."""
        return unstable_set(self, **options)

    def stable_set(self, **options):
        """Return the stable set of the saddle: the boundary through it, see `bifurc.basins.boundaries.stable.stable_set`."""
        return stable_set(self, **options)

    @checked()
    def plot(self, ax=None, unstable=None, stable=None):
        """Draw the saddle, and its unstable and stable sets, on the basin map; return the axes."""
        return plotting.plot_edge(self, ax, unstable, stable)

    def __repr__(self):
        met = f", {sum(self.third.values())} starts in other basins" if self.third else ""
        return f"EdgeState(between {self.pair[0]} and {self.pair[1]}: {self.status}, {self.saddle!r}{met})"


@checked(pair=of(many, of=PLACE, count=2), starts=of(array, axes=(2,)))
def edge_state(basins: BasinMap, pair: tuple[int, int] = (0, 1), *, starts=None, max_periods: int = 400) -> EdgeState:
    """Return the saddle on the boundary between two basins.

    Parameters
    ----------
    basins : BasinMap
    pair : tuple of int
        Labels of the two basins.
    starts : array_like, optional
        One start in each (2, ns); default: the closest cells of the two in the map.
    max_periods : int
        Forcing periods for which the motion on the boundary is followed.

    Returns
    -------
    EdgeState
        Look at ``success``, ``status`` and ``message``.

    Raises
    ------
    ValueError
        Labels the map has not, starts that do not lead to the two.

    References
    ----------
    J. D. Skufca, J. A. Yorke, B. Eckhardt, Phys. Rev. Lett. 96 (2006) 174101.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator(omega=1.4)
    >>> basins = bf.basins_of_attraction(system, bf.Grid(q0=(-3, 1, 20), v0=(-4, 4, 20)))
    >>> bf.edge_state(basins).saddle.stable
    False
    """
    if not isinstance(basins, BasinMap):
        raise ValueError(f"basins = {basins!r} is not allowed; it must be a BasinMap, see basins_of_attraction")
    a, b = pair
    pair = a, b
    count = len(basins.attractors)
    if count < 2:
        raise ValueError(f"the map has {count} attractor{'' if count == 1 else 's'}: there is no boundary between two basins")
    if a == b or not (0 <= a < count and 0 <= b < count):
        raise ValueError(f"pair = {pair!r} is not allowed; it must be two different labels of the map, 0 to {count - 1}")
    search = Search(basins, (int(a), int(b)))
    if starts is None:
        ends = search.closest_cells()
        if ends is None:
            return _result(search, None, EdgeStatus.NO_BOUNDARY)
    else:
        ends = np.array(starts, float)
        if ends.shape != (2, search.scale.size) or not np.isfinite(ends).all():
            raise ValueError(f"starts = {starts!r} are not allowed; they must be two states (2, {search.scale.size})")
        if search.label(ends).tolist() != [a, b]:
            raise ValueError(f"starts = {starts!r} lead to {search.label(ends).tolist()}, not to the pair {pair!r}")
    return _result(search, *search.track(ends, max_periods))


def _result(search: Search, saddle: PeriodicOrbit | None, status: EdgeStatus) -> EdgeState:
    """Return what a search found."""
    points = np.array(search.points).reshape(-1, search.scale.size)
    return EdgeState(search.basins, search.pair, saddle, status, points, search.gap, search.third, search.jumps)
