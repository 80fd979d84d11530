"""Backbone curves: frequency and damping of a nonlinear mode over its amplitude."""
import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .. import plotting
from ..checks import array, checked, of, refused
from ..content import Content
from ..orbits.balance.method import HarmonicBalance
from ..system import System
from .modes import ExtendedMode, extended_mode

HALVINGS = 6  # of a step in amplitude at which Newton fails
BEGINNINGS = 24  # halvings of the first amplitude until the linear mode is near


@dataclass(frozen=True, eq=False)
class Backbone(Content):
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
    values = np.atleast_1d(amplitudes)
    if not (np.all(values > 0.0) or np.all(values < 0.0)):
        raise refused("backbone", "amplitudes", values.tolist(), "finite numbers of one sign")
    options: dict[str, Any] = {"dof": dof, "mode": mode, "method": method}
    found: list[ExtendedMode] = []
    for value in map(float, values):
        new = extended_mode(system, value, **options) if not found else _reached(system, found[-1], value, options)
        if not new.success and not found:
            new = _begun(system, value, options)
        if not new.success:
            return Backbone(tuple(found), f"at the amplitude {value:g}: {new.message}{_overdamped(found)}")
        found.append(new)
    return Backbone(tuple(found), "")


def _overdamped(found: list[ExtendedMode]) -> str:
    """Return what there is to say of modes that end where contacts take out more than a swing holds."""
    if not found or found[-1].damping < 1.0:
        return ""
    return (f" The damping ratio of the last mode is {found[-1].damping:.3g}: contacts take out in a period more than the motion "
            "holds. Whether there is a mode beyond is undecided; a softer contact or a spring beside it has one.")


def _begun(system: System, value: float, options: dict) -> ExtendedMode:
    """Return the mode at an amplitude, come from the first smaller one to which the linear mode leads, or one that failed."""
    for k in range(1, BEGINNINGS + 1):
        small = extended_mode(system, value * 0.5**k, **options)
        if small.success:
            return _reached(system, small, value, options)
    return small


def _reached(system: System, last: ExtendedMode, value: float, options: dict) -> ExtendedMode:
    """Return the mode at an amplitude reached from another one in as few steps as Newton needs, or the one that failed.

    Steps are in the logarithm of the amplitude, predicted along the line through the last two modes.
    """
    step = math.log(value / last.amplitude)
    least, growth = abs(step) * 0.5**HALVINGS, 2.0
    before: ExtendedMode | None = None
    while True:
        way = math.log(value / last.amplitude)
        aim = value if abs(step) >= abs(way) * (1.0 - 1e-9) else last.amplitude * math.exp(step)
        new = extended_mode(system, aim, guess=_predicted(before, last, aim), **options)
        if not new.success and before is not None:
            new = extended_mode(system, aim, guess=last, **options)
        if new.success and aim == value:
            return new
        if new.success:
            before, last, step = last, new, growth * step
        elif abs(step) <= least:
            return new
        else:
            step, growth = 0.5 * math.copysign(min(abs(step), abs(way)), step), 1.0


def _predicted(before: ExtendedMode | None, last: ExtendedMode, aim: float) -> ExtendedMode:
    """Return what the line through two modes, in the logarithm of the amplitude, makes of the mode at ``aim``."""
    if before is None:
        return last
    share = math.log(aim / last.amplitude) / math.log(last.amplitude / before.amplitude)
    shape = last.state / last.amplitude
    state = aim * (shape + share * (shape - before.state / before.amplitude))
    omega, xi = (getattr(last, name) + share * (getattr(last, name) - getattr(before, name)) for name in ("omega", "xi"))
    return last if not omega > 0.0 else replace(last, amplitude=aim, state=state, omega=omega, xi=xi)
