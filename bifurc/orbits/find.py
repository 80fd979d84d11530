"""Find a periodic orbit: simulate for the event signature, solve with it fixed, audit."""

from ..checks import checked
from ..compose.scene import scene_of
from ..flow.initial import start_of
from ..flow.settle import Penetration
from ..system import System, require_system
from .autonomous import autonomous_orbit
from .base import Orbit
from .concentric import concentric
from .forced import centred, finished, from_map, from_orbit, from_state, resting, settled
from .kinds import OrbitStatus
from .orbit import PeriodicOrbit


@checked()
def find_orbit(system: System, guess=None, periods: int | None = None, *, closure: int | None = None,
               transient: int = 800, method=None, period: float | None = None) -> PeriodicOrbit:
    """Return a periodic orbit of a system, forced or autonomous.

    Without excitation the period is part of the solution: the motion is simulated until its events, or the maxima of a
    coordinate, repeat, and the period between two of them is solved for together with the states.  The phase is that of the
    first event, or of a maximum.

    Parameters
    ----------
    system : System
    guess : array (2 n,) or (ns,), PeriodicOrbit, HarmonicOrbit, or None
        State at phase 0 near the orbit (autonomous, without ``period``: or from which a motion leads there); an orbit (of
        other parameters); an orbit of harmonic balance, which is polished: ``how`` reports how far it was off; None: the
        motion from rest is simulated until it settles.
    periods : int, optional
        Forcing periods after which the orbit closes; default 1 for a guessed state, that of a guessed orbit, and whatever
        the motion settles on (up to 16) without a guess.  An orbit that repeats earlier is reduced to its least period,
        and ``how`` says so.  Not for autonomous systems.
    closure : {1, -1}, optional
        -1: y(t + period/2) = -y(t), solved on the half period (symmetric systems); 1: on the full period; default: -1
        where the orbit has this symmetry.
    transient : int
        Most forcing periods to be simulated without a guess (autonomous: periods of the slowest oscillation of a mode).
    method : HarmonicBalance, optional
        Balance harmonics instead of shooting through the events; gives a `HarmonicOrbit`, see `orbits.balance.find.balanced`.
    period : float, optional
        Of an autonomous orbit, about: the time after which the motion from the guess nearly returns.

    Returns
    -------
    PeriodicOrbit or HarmonicOrbit
        Look at ``success``, ``status`` and ``message``: a failure is reported there, not raised.

    Raises
    ------
    ValueError
        A guess of wrong shape or not finite, a start beyond a stop, rigid stops that leave no room at some time, ``periods`` for
        an autonomous system or ``period`` for a forced one.

    Examples
    --------
    >>> import bifurc as bf
    >>> orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=1.5, amplitude=0.9), guess=(1.0, 0.2))
    >>> orbit.success
    True
    """
    require_system(system)
    if method is not None:
        from .balance.find import balanced  # harmonic balance is loaded where it is asked for

        return balanced(system, method, guess, periods)  # type: ignore[return-value]  # a HarmonicOrbit has the same face
    if system.period is not None and period is not None:
        raise ValueError(f"period = {period!r} is not allowed; the excitation of {system!r} gives it, say how many in periods=")
    if system.period is None and periods is not None:
        raise ValueError(f"periods = {periods!r} is not allowed; {system!r} has no excitation, say about how long in period=")
    if closure == -1 and system.symmetry != -1:
        raise ValueError(f"closure = -1 is not allowed; {system!r} is not symmetric under y -> -y")
    try:
        if system.period is None:
            return autonomous_orbit(system, guess, closure, transient, period)
        if isinstance(guess, PeriodicOrbit):
            found = from_orbit(system, guess, periods)
        elif isinstance(guess, Orbit):
            found = from_state(system, guess.state, int(periods or guess.periods))
        elif guess is not None:
            found = from_state(system, start_of(scene_of(system), "guess", guess), int(periods or 1))
        else:
            found = settled(system, periods, transient)
    except Penetration as error:  # of the motion from the guess
        raise Penetration(f"guess: {error}") from None
    if not found.success:
        found = resting(system, found, int(periods or 1)) or found
    if not found.success:
        return PeriodicOrbit(system, found.sequence, found.unknowns, found.weights, found.how,
                             OrbitStatus.CONCENTRIC) if concentric(system) else found
    found = finished(found, closure)
    if guess is None and closure != 1 and found.closure == 1 and found.family and system.symmetry == -1 and found.periods % 2:
        # where sliders came to stand is chance: of the family that they label, the symmetric member is given
        middle = from_map(system, found.state, found.periods, True)
        found = found if middle is None else finished(middle, closure)
    elif guess is None and system.symmetry != -1:
        found = centred(found)
    if isinstance(guess, Orbit) and not isinstance(guess, PeriodicOrbit):
        found.how["polished"] = "the harmonic orbit given as guess"
        found.how["error of its first harmonic"] = max(
            abs(complex(guess.harmonic(1, dof)) - found.harmonic(1, dof)) for dof in range(system.n))
    return found
