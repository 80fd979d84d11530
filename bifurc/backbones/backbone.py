"""Backbone curves: frequency and damping of a nonlinear mode over its amplitude."""
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import plotting
from ..checks import array, checked, of
from ..orbits.balance.method import HarmonicBalance
from ..system import System
from .modes import ExtendedMode, extended_mode

HALVINGS = 6  # of a step in amplitude at which Newton fails


@dataclass(frozen=True)
class Backbone:
    """Modes over amplitude.

    Attributes
    ----------
    modes : tuple of ExtendedMode
        In the order of the amplitudes.
    message : str
        Empty, or why it ends early.
    """

    modes: tuple[ExtendedMode, ...] = field(repr=False)
    message: str

    @property
    def amplitude(self) -> np.ndarray:
        """Amplitudes (k,), length."""
        return np.array([mode.amplitude for mode in self.modes])

    @property
    def first_harmonic(self) -> np.ndarray:
        """Amplitudes (k,) of the first harmonic."""
        return np.array([mode.first_harmonic for mode in self.modes])

    @property
    def omega(self) -> np.ndarray:
        """Frequencies (k,)."""
        return np.array([mode.omega for mode in self.modes])

    @property
    def damping(self) -> np.ndarray:
        """Modal damping ratios (k,)."""
        return np.array([mode.damping for mode in self.modes])

    def __repr__(self):
        if not self.modes:
            return f"Backbone(no mode: {self.message})"
        return (f"Backbone({len(self.modes)} modes, amplitude {self.amplitude[0]:.6g} to {self.amplitude[-1]:.6g}, omega "
                f"{self.omega.min():.6g} to {self.omega.max():.6g})")

    @checked()
    def plot(self, axes=None):
        """Draw amplitude over frequency and damping over amplitude; return the axes."""
        return plotting.plot_backbone(self, axes)


@checked(amplitudes=of(array, axes=(0, 1)))
def backbone(system: System, amplitudes, *, dof: int = 0, mode: int = 0, method: HarmonicBalance | None = None) -> Backbone:
    """Return the modes of a system at rising (or falling) amplitudes, each started from the last.

    Parameters
    ----------
    system, dof, mode, method
        As for `extended_mode`.
    amplitudes : array_like (k,)
        Of coordinate `dof` where it turns, length, of one sign.

    Returns
    -------
    Backbone
        It ends where Newton fails, and says so.

    Examples
    --------
    >>> import bifurc as bf
    >>> found = bf.backbone(bf.systems.duffing_oscillator(zeta=0.0), [0.1, 0.5, 1.0])
    >>> round(float(found.omega[-1]), 10)
    1.317776065
    """
    values = np.atleast_1d(np.asarray(amplitudes, float))
    if values.ndim != 1 or not values.size or not np.isfinite(values).all() or not (np.all(values > 0.0) or np.all(values < 0.0)):
        raise ValueError(f"backbone: amplitudes = {amplitudes!r} is not allowed; it must be a row of finite numbers of one sign")
    options: dict[str, Any] = {"dof": dof, "mode": mode, "method": method}
    found: list[ExtendedMode] = []
    last: ExtendedMode | None = None
    for value in values:
        new = extended_mode(system, value, guess=last, **options)
        if not new.success and last is not None:
            new = _stepped(system, last, float(value), options)
        if not new.success:
            return Backbone(tuple(found), f"at the amplitude {value:g}: {new.message}")
        last = new
        found.append(new)
    return Backbone(tuple(found), "")


def _stepped(system: System, last: ExtendedMode, value: float, options: dict) -> ExtendedMode:
    """Return the mode at an amplitude reached in smaller steps, or the one that failed."""
    step = value - last.amplitude
    least = abs(step) * 0.5**HALVINGS
    while True:
        aim = value if abs(step) >= abs(value - last.amplitude) else last.amplitude + step
        new = extended_mode(system, aim, guess=last, **options)
        if new.success and aim == value:
            return new
        if new.success:
            last = new
        elif abs(step) <= least:
            return new
        else:
            step *= 0.5
