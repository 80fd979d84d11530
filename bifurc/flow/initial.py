"""What a motion is started with: its state, its time, its length, checked."""
import numpy as np

from .. import checks


def checked_length(scene, periods, duration, t0, max_events) -> tuple[float, float]:
    """Return start and length (periods or duration, whichever is given) of a motion, or raise ValueError."""
    t0 = _number("t0", t0)
    if (periods is None) == (duration is None):
        raise ValueError("give either periods or duration")
    if periods is not None and scene.period is None:
        raise ValueError(f"{scene.system!r} has no forcing period; give duration instead of periods")
    length = _number("periods", periods) if periods is not None else _number("duration", duration)
    if length < 0.0:
        raise ValueError(f"{'periods' if periods is not None else 'duration'} = {length!r} must not be negative")
    checks.whole("simulate", "max_events", max_events, least=1)
    return t0, length


def checked_state(scene, y0, t0: float) -> np.ndarray:
    """Return a start state (ns,) as given, memory that is left out in its virgin state, or raise ValueError."""
    given = checks.state("y0", y0, (2 * scene.n, scene.ns))
    x = np.concatenate((given, np.zeros(scene.ns - given.size), scene.forcing(np.array([t0]))[0]))
    if given.size < scene.ns:
        scene.relax(x)
    return x[:scene.ns]


def _number(name: str, value) -> float:
    return checks.number("simulate", name, value)
