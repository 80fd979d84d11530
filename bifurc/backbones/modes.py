"""Extended periodic motion: a nonlinear mode of a system with friction (Krack 2015).

    M q'' + (C - xi M) q' + K q = forces of the contacts,      q periodic with the frequency omega

The negative damping -xi M puts in what the contacts and C take out, so that a damped mode becomes periodic; the modal
damping ratio is D = xi/(2 omega).  Without losses xi = 0, and the motion is a nonlinear normal mode (Rosenberg 1960).
The amplitude is that of one coordinate at phase 0, a turning point: q_dof(0) = amplitude, q_dof'(0) = 0.
"""
from dataclasses import dataclass, field

import numpy as np

from ..checks import checked, instance, number, whole
from ..compose.scene import scene_of
from ..content import Content
from ..elements import EventKind
from ..enumerations import DescribedEnum
from ..flow.settle import Penetration, start
from ..flow.simulate import simulate
from ..orbits.balance.method import HarmonicBalance
from ..system import System
from .equations import balanced, returning, shot, with_negative_damping

LOSSLESS = 1e-13  # of the frequency: an xi so small is none


class ModeStatus(DescribedEnum):
    """How the search for a mode ended."""

    CONVERGED = "converged", "The motion is periodic under the negative damping."
    NOT_CONVERGED = ("not_converged", "Newton did not converge; come from a smaller amplitude (backbone does), or "
                                      "give a guess.")


@dataclass(frozen=True, eq=False)
class ExtendedMode(Content):
    """A nonlinear mode at one amplitude.

    Attributes
    ----------
    system : System
        Without loads.
    amplitude : float
        Coordinate `dof` at phase 0.
    dof : int
    omega : float
        Frequency, radians per time.
    xi : float
        Negative damping, per time; 0 without losses.
    state : ndarray (ns,)
        At phase 0: coordinates, velocities, internal variables.
    first_harmonic : float
        Amplitude of the first harmonic of `dof`.
    residual : float
        Scaled.
    status : ModeStatus
    method : str
    """

    system: System = field(repr=False)
    amplitude: float
    dof: int
    omega: float
    xi: float
    state: np.ndarray = field(repr=False)
    first_harmonic: float = field(repr=False)
    residual: float = field(repr=False)
    status: ModeStatus
    method: str

    @property
    def damping(self) -> float:
        """Modal damping ratio D = xi/(2 omega), dimensionless."""
        return self.xi / (2.0 * self.omega)

    @property
    def period(self) -> float:
        """Period, time."""
        return 2.0 * np.pi / self.omega

    @property
    def success(self) -> bool:
        """Whether it converged."""
        return self.status is ModeStatus.CONVERGED

    @property
    def message(self) -> str:
        """The status as a sentence."""
        return self.status.sentence

    def motion(self):
        """Return the motion over one period, under the negative damping."""
        return simulate(with_negative_damping(self.system, self.xi), self.state, duration=self.period)


@checked(guess=instance("bifurc.backbones.modes:ExtendedMode", "an ExtendedMode"))
def extended_mode(system: System, amplitude: float, *, dof: int = 0, mode: int = 0, method: HarmonicBalance | None = None,
                  guess: ExtendedMode | None = None) -> ExtendedMode:
    """Return the nonlinear mode of a system at an amplitude: frequency, damping, motion.

    Parameters
    ----------
    system : System
        Its harmonic loads are left out; contacts, springs and constant forces stay.
    amplitude : float
        Of coordinate `dof` at phase 0 (where it turns), length, not 0; negative for the other side of an unsymmetric system.
    dof : int
    mode : int
        Number of the linear mode (contacts as at rest) from which Newton starts, from 0.
    method : HarmonicBalance, optional
        Balance harmonics; None: shooting through the exact events.
    guess : ExtendedMode, optional
        A mode at a near amplitude.

    Returns
    -------
    ExtendedMode
        Look at ``success``.

    Raises
    ------
    ValueError
        Amplitude 0, a coordinate or mode there is not, loads inside contacts, contacts that stick rigidly (no linear mode).

    References
    ----------
    M. Krack, Comput. Struct. 154 (2015) 59; M. Krack, J. Gross, Harmonic Balance for Nonlinear Vibration Problems (2019).

    Examples
    --------
    >>> import bifurc as bf
    >>> found = bf.extended_mode(bf.systems.jenkins_oscillator(), 2.0)
    >>> round(found.omega, 10), round(found.damping, 10)
    (1.2258676902, 0.1139103676)
    """
    free = unloaded(system)
    amplitude = number("extended_mode", "amplitude", amplitude)
    if amplitude == 0.0:
        raise ValueError("extended_mode: amplitude = 0.0 is not allowed; a mode without motion has no frequency of its own")
    dof = whole("extended_mode", "dof", dof, least=0, most=free.n - 1)
    mode = whole("extended_mode", "mode", mode, least=0, most=free.n - 1)
    if guess is None:
        omega, shape = linear_mode(free, mode)
        if abs(shape[dof]) < 1e-9 * np.abs(shape).max():
            raise ValueError(f"extended_mode: dof = {dof} rests in linear mode {mode}; choose another coordinate for the amplitude")
        state, xi = np.concatenate((amplitude * shape / shape[dof], np.zeros(free.n), resting_memory(free))), 0.0
        omega = returning(free, state, dof, omega)
    else:
        state, omega, xi = guess.state * (amplitude / guess.amplitude), guess.omega, guess.xi
    if method is None:
        state, omega, xi, residual, good = shot(free, dof, amplitude, state, omega, xi)
        how = "shooting"
        harmonic = first_harmonic(free, state, omega, xi, dof) if good else np.nan
    else:
        state, omega, xi, residual, good, harmonic = balanced(free, method, dof, amplitude, state, omega, xi)
        how = "harmonic balance"
    xi = float(xi) if abs(xi) > LOSSLESS * omega else 0.0
    status = ModeStatus.CONVERGED if good else ModeStatus.NOT_CONVERGED
    return ExtendedMode(free, amplitude, dof, float(omega), xi, state, float(harmonic), float(residual), status, how)


def unloaded(system: System) -> System:
    """Return the system without its harmonic loads, autonomous.

    Raises
    ------
    ValueError
        For contacts whose own law varies in time.
    """
    kept = []
    for element in system.elements:
        if not ({*element.harmonics, *element.site(system.n).harmonics}):
            kept.append(element)
        elif not element.start == ("always",) or element.memory:
            raise ValueError(f"{element!r} varies in time by itself: the system has no free vibration; leave its load constant")
    return System(system.mass, system.damping, system.stiffness, kept)


def resting_memory(system: System) -> np.ndarray:
    """Return the internal variables at rest: about them a small motion swings, and limits move them along with a large one."""
    scene = scene_of(system)
    x = np.zeros(scene.ns + scene.nw)
    x[scene.ns] = 1.0
    scene.relax(x)
    return x[2 * scene.n:scene.ns]


def linear_mode(system: System, mode: int) -> tuple[float, np.ndarray]:
    """Return frequency and shape (n,) of a linear mode, with contacts as in the first mode that may start at rest."""
    scene = scene_of(system)
    x = np.zeros(scene.ns + scene.nw)
    x[scene.ns] = 1.0
    scene.relax(x)
    try:
        at, _ = start(scene, x)
    except Penetration:  # a stop that presses at rest: the mode is that of free flight
        at = next(scene.start_modes())
    T = scene.tables
    if T.n_holds[at]:
        raise ValueError(f"{system!r} rests with a rigid constraint (dry friction without a spring, or a stop): it has no "
                         "linear mode to start from; give a guess")
    n = scene.n
    values, shapes = np.linalg.eig(-T.A[at, n:2 * n, :n])
    order = np.argsort(values.real)
    value = float(values[order[mode]].real)
    if not value > 0.0:
        raise ValueError(f"linear mode {mode} of {system!r} has no frequency (stiffness {value:.3g}); give another mode or a guess")
    return float(np.sqrt(value)), shapes[:, order[mode]].real


def first_harmonic(system: System, state, omega: float, xi: float, dof: int) -> float:
    """Return the amplitude of the first harmonic of a coordinate over the period."""
    moving = with_negative_damping(system, xi)
    period = 2.0 * np.pi / omega
    motion = simulate(moving, state, duration=period)
    edges = np.unique(np.concatenate(([0.0, period], [e.time for e in motion.events if e.kind is not EventKind.GRAZE])))
    roots, weights = np.polynomial.legendre.leggauss(32)
    total = 0.0 + 0.0j
    for a, b in zip(edges, edges[1:], strict=False):
        t = 0.5 * (a + b) + 0.5 * (b - a) * roots
        total += 0.5 * (b - a) * np.sum(weights * motion(np.clip(t, 0.0, period))[:, dof] * np.exp(-1j * omega * t))
    return float(abs(2.0 * total / period))
