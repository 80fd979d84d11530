"""A smooth map given as a function, as a system whose cycles are found, traced and followed."""
import numpy as np

from .base import Map, Piece

COMPLEX = 1e-30  # imaginary step of derivatives
REAL = 7e-4  # relative step of fourth-order differences, where the function takes no complex numbers


class SmoothMap(Map):
    """A smooth map: ``x' = function(x, **parameters)``.

    Parameters
    ----------
    function : callable
        ``function(x, **parameters)`` with ``x`` (..., d) returns (..., d); best written so that it takes complex numbers too.
    dimension : int
        d.
    slope : callable, optional
        Its derivative (..., d, d), called alike; by default by a complex step, or by differences if the function refuses.
    **parameters : float
        By the names of the function's arguments.

    Examples
    --------
    >>> from bifurc.continuation.maps import SmoothMap
    >>> import bifurc as bf
    >>> logistic = SmoothMap(lambda x, a: a * x * (1.0 - x), 1, a=2.8)
    >>> branch = bf.trace(logistic.find(1, guess=0.6), "a", bounds=(2.5, 3.5))
    >>> round(branch.special_points[0].parameter, 10)
    3.0
    """

    def __init__(self, function, dimension: int, slope=None, **parameters):
        if not callable(function):
            raise ValueError(f"function must be callable, got {function!r}")
        if not (isinstance(dimension, int) and dimension >= 1):
            raise ValueError(f"dimension = {dimension!r} must be a whole number of at least 1")
        self.function, self.dimension, self._slope = function, dimension, slope
        self.names = tuple(parameters)
        self.pieces = {"-": _Whole(self)}
        super().__init__(**parameters)

    def _values(self):
        return {name: np.asarray(v)[..., None] if np.ndim(v) else v for name, v in self.parameters.items()}

    def step(self, x):
        """See `Map.step`."""
        return np.asarray(self.function(np.asarray(x), **self._values()))

    def slope(self, x):
        """See `Map.slope`."""
        x = np.asarray(x, float)
        if self._slope is not None:
            return np.asarray(self._slope(x, **self._values()), float)
        columns = []
        for k in range(self.dimension):
            try:
                moved = x.astype(complex)
                moved[..., k] += 1j * COMPLEX
                columns.append(np.imag(self.step(moved)) / COMPLEX)
            except TypeError:  # a function of real numbers only
                columns.append(self._difference(x, k))
        return np.stack(columns, axis=-1)

    def _difference(self, x, k):
        h = REAL * max(1.0, float(np.abs(x[..., k]).max()))
        total = 0.0
        for j, weight in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
            moved = x.copy()
            moved[..., k] += j * h
            total = total + weight * self.step(moved)
        return total / (12.0 * h)

    def piece_of(self, x):
        """See `Map.piece_of`."""
        return "-"


class _Whole(Piece):
    """The only piece."""

    def __init__(self, owner):
        self.owner = owner

    def image(self, u, p):
        return np.reshape(p.step(u), p.dimension).astype(float), np.reshape(p.slope(u), (p.dimension, p.dimension))
