"""Control of chaos by small changes of a parameter, once a period: Ott, Grebogi, Yorke (1990), with pole placement.

On the section at a fixed phase the motion is a map z -> P(z, p).  Near the orbit z*, with M = dP/dz and g = dP/dp,

    z' - z* = M (z - z*) + g dp,      dp = -gain . (z - z*)  while |dp| stays within a limit, 0 otherwise.

For one unstable multiplier lambda_u with left eigenvector f_u the gain lambda_u f_u / (f_u . g) puts it to 0 and leaves the
others; several unstable ones are placed at 0 together within their own left subspace (Ackermann 1972).
"""
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import schur

from .. import checks
from ..checks import PLACE, POSITIVE, RATIO, checked, choice, number, of
from ..compose.scene import scene_of
from ..content import Content
from ..continuation.shooting.problem import OrbitProblem, orbit_problem
from ..enumerations import DescribedEnum
from ..orbits.orbit import PeriodicOrbit
from ..orbits.shooting.path import slope
from ..orbits.shooting.sequence import AFTER, BEFORE, ENDING, GUARD
from ..orbits.shooting.signature import Signature, divided
from .linearization import forced
from .ogy_motion import simulated

BESIDE = (0.1, 1e-3)  # of the parameter: range over which its effect on the numbers of the system is known
SINGULAR = 1e12  # condition number of the equations of an orbit, scaled
UNSTABLE = 1.0 + 1e-8  # modulus
DEAD = 1e-8  # modulus: what a period takes to the root of rounding, as sticking does, needs no control and allows none
WEAK = 1e-10  # part of its size along the unstable direction below which a parameter controls nothing
ON_EVENT = 1e-9  # periods


class ControlStatus(DescribedEnum):
    """What a controller can do."""

    READY = "ready", "The closed loop is stable near the orbit; simulate(...) shows it."
    STABLE_ALREADY = "stable_already", "The orbit is stable without control: the gain is zero."


@dataclass(frozen=True, eq=False)
class OGYController(Content):
    """Feedback of the state on a section to a parameter.

    Attributes
    ----------
    orbit : PeriodicOrbit
    parameter : str
    section : float
        Phase of the section, forcing periods from 0.
    state : ndarray (ns,)
        The orbit on the section.
    monodromy : ndarray (ns, ns)
        M, derivative of the map from section to section.
    sensitivity : ndarray (ns,)
        g, derivative of the map in the parameter.
    gain : ndarray (ns,)
        dp = -gain . (z - state), per unit of the states.
    closed_loop : ndarray (ns,)
        Multipliers under control, complex, largest modulus first.
    method : str
        "ogy" or "deadbeat".
    """

    orbit: PeriodicOrbit = field(repr=False)
    parameter: str
    section: float
    state: np.ndarray
    monodromy: np.ndarray = field(repr=False)
    sensitivity: np.ndarray = field(repr=False)
    gain: np.ndarray
    closed_loop: np.ndarray
    method: str

    @property
    def status(self) -> ControlStatus:
        """Whether there is anything to control."""
        return ControlStatus.READY if self.gain.any() else ControlStatus.STABLE_ALREADY

    @property
    def message(self) -> str:
        """The status as a sentence."""
        return self.status.sentence

    @checked(limit=of(number, above=0.0, finite=False))
    def correction(self, state, limit: float = np.inf) -> float:
        """Return the change of the parameter for a state (ns,) on the section; 0 where it would exceed the limit."""
        change = -float(self.gain @ (checks.state("state", state, (self.state.size,)) - self.state))
        return change if abs(change) <= limit else 0.0

    @checked(limit=POSITIVE)
    def window(self, limit: float) -> float:
        """Return half the width of the strip around the orbit, along the gain, in which the correction stays within a limit.

        In units of the state; chaos enters it sooner or later, the wider the sooner.
        """
        size = float(np.linalg.norm(self.gain))
        return np.inf if size == 0.0 else limit / size

    @checked(y0=None, limit=of(number, above=0.0, finite=False), noise=RATIO, start=PLACE)
    def simulate(self, y0, periods: int, limit: float, noise: float = 0.0, seed: int = 0, start: int = 0):
        """Return the motion under control; see `bifurc.control.ogy_motion.simulated`."""
        return simulated(self, y0, periods, limit, noise, seed, start)


@checked(section=number, method=of(choice, allowed=("ogy", "deadbeat")))
def ogy(orbit: PeriodicOrbit, parameter: str, *, section: float = 0.0, method: str = "ogy") -> OGYController:
    """Return the controller that holds an unstable orbit by small changes of a parameter at each passage of a section.

    Parameters
    ----------
    orbit : PeriodicOrbit
    parameter : str
        What is changed; the forcing frequency too: the window between sections is then a period of the changed forcing.
    section : float
        Phase at which the state is read and the parameter set, in forcing periods, 0 <= section < periods of the orbit.
        The gain belongs to its section.
    method : {"ogy", "deadbeat"}
        "ogy": unstable multipliers go to 0, stable ones stay.  "deadbeat": all go to 0, in as many periods as there are
        states; badly conditioned where g is nearly an eigenvector.

    Returns
    -------
    OGYController

    Raises
    ------
    ValueError
        A section outside the orbit's period or on an event, a parameter that does not act on the unstable directions, a
        failed orbit.
    NotSupported
        Orbits without a clock, multipliers that are not unique.

    References
    ----------
    E. Ott, C. Grebogi, J. A. Yorke, Phys. Rev. Lett. 64 (1990) 1196; F. J. Romeiras, C. Grebogi, E. Ott, W. P. Dayawansa,
    Physica D 58 (1992) 165.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator(omega=2.5, amplitude=12.0)
    >>> orbit = bf.find_orbit(system, guess=(-6.3, 0.7))
    >>> controller = bf.control.ogy(orbit, "amplitude", section=0.0)
    >>> bool(abs(controller.closed_loop[0]) < 1)
    True
    """
    choice("ogy", "method", method, ("ogy", "deadbeat"))
    forced(orbit)
    parameter = orbit.system.parameter_name(parameter)
    orbit.system.parameter(parameter)
    section = _section(orbit, section)
    M = section_monodromy(orbit, section)
    g = (np.eye(len(M)) - M) @ orbit_derivative(orbit, parameter, section)
    state = orbit._states(np.array([section]))[0]
    V = _above(M, DEAD if method == "deadbeat" else UNSTABLE)
    gain = np.zeros(len(M)) if V.shape[1] == 0 else placed(M, g, V, parameter)
    M, g = _shown(orbit, parameter, section, M, g)
    closed = np.linalg.eigvals(M - np.outer(g, gain)).astype(complex)
    return OGYController(orbit, parameter, section, state, M, g, gain, closed[np.argsort(-np.abs(closed), kind="stable")], method)


def section_monodromy(orbit: PeriodicOrbit, section: float) -> np.ndarray:
    """Return the derivative (ns, ns) of the map from a phase (forcing periods) to itself one period of the orbit later."""
    whole, U = orbit._whole
    ns = orbit.scene.ns
    rows = U.reshape(len(whole.nodes), -1)
    first = rows[0, 0]
    at = first + (section - first) % whole.span
    k = int(np.searchsorted(rows[:, 0], at, side="right"))
    later = rows[:k].copy()
    later[:, 0] += whole.span
    here = whole.nodes[k - 1].copy()
    here[BEFORE], here[GUARD] = here[AFTER], -1
    nodes = np.vstack([here, whole.nodes[k:], whole.nodes[:k]])
    start = np.concatenate(([at], orbit._states(np.array([section]))[0]))
    M = np.empty((ns, ns))
    orbit.equations.motion.monodromy(orbit.equations.path.tables, np.ascontiguousarray(nodes), whole.span,
                                     np.vstack([start, rows[k:], later]).ravel(), M)
    return M


def orbit_derivative(orbit: PeriodicOrbit, parameter: str, section: float) -> np.ndarray:
    """Return the derivative (ns,) of the orbit's state at a phase in a parameter, along its branch.

    From the linearised equations of its events, with a section at that phase among them; the derivative of the map in the parameter
    is (I - M) times it.

    Raises
    ------
    ValueError
        When these equations are singular: the orbit lies on a special point.
    """
    value, (whole, U) = orbit.system.parameter(parameter), orbit._whole
    rows = U.reshape(len(whole.nodes), -1)
    at = rows[0, 0] + (section - rows[0, 0]) % whole.span
    k = int(np.searchsorted(rows[:, 0], at, side="right"))
    here = [whole.nodes[k - 1, AFTER], -1, whole.nodes[k - 1, AFTER], 0, 0]
    nodes = divided(orbit.scene, np.insert(whole.nodes[:, :ENDING], k, here, axis=0))
    rows = np.insert(rows, k, np.append(at, orbit._states(np.array([section]))[0]), axis=0)
    signature = Signature(nodes, np.insert(whole.fixed, k, at), whole.span)
    problem = _near(orbit, parameter, value).with_sequence(signature, np.append(rows.ravel(), value))
    at = np.append(rows.ravel(), value)
    by_unknowns, by_parameter = problem.equations.jacobian(at), problem.equations.by_parameter(at)
    scale = problem.scale[:-1]
    if not np.linalg.cond(by_unknowns * scale) < SINGULAR:
        raise ValueError(f"the orbit has no smooth branch in {parameter!r} at {value:g}: it lies on a special point")
    change = -scale * np.linalg.solve(by_unknowns * scale, by_parameter)
    return change.reshape(len(nodes), -1)[k, 1:]


def _shown(orbit: PeriodicOrbit, parameter: str, section: float, M: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives of the map with the rows of memory that follows local values on the section: a slider that slips.

    The equations write such memory when its mode is left; states show what it follows.  Nothing later depends on it: the columns,
    the multipliers and the gain are the same.
    """
    whole, U = orbit._whole
    rows = U.reshape(len(whole.nodes), -1)
    at = rows[0, 0] + (section - rows[0, 0]) % whole.span
    mode = int(whole.nodes[int(np.searchsorted(rows[:, 0], at, side="right")) - 1, AFTER])
    following = orbit.scene.algebraic(mode)
    if not following:
        return M, g
    R, ns = np.eye(len(M)), len(M)
    for place, row in following:
        R[place] = row[:ns]
    value, key, state = orbit.system.parameter(parameter), orbit.scene.keys[mode], orbit._states(np.array([section]))

    def shown(there):
        scene = scene_of(orbit.system.with_parameters(**{parameter: float(there)}))
        assert scene.period is not None  # the orbit is forced
        return scene.shown(np.array([scene.keys.index(key)]), state, np.array([section * scene.period]))[0]
    path = _near(orbit, parameter, value).path
    return R @ M, R @ g + slope(shown, path.low, path.high, value)[0]


def _near(orbit: PeriodicOrbit, parameter: str, value: float) -> OrbitProblem:
    """Return the equations of an orbit along a parameter next to its value, on one side where the other is not allowed."""
    for step in np.multiply(BESIDE, abs(value) or 1.0):
        for bounds in ((value - step, value + step), (value - step, value), (value, value + step)):
            try:
                return orbit_problem(orbit, parameter, bounds)
            except ValueError as error:  # the builder's own bound
                refused = error
    raise refused


def placed(M: np.ndarray, g: np.ndarray, V: np.ndarray, parameter: str) -> np.ndarray:
    """Return the gain (ns,) that puts the multipliers of the left subspace ``V`` (ns, k), M^T V = V S, to 0."""
    J, b = np.linalg.lstsq(V, M.T @ V, rcond=None)[0].T, V.T @ g
    k = V.shape[1]
    reach = np.column_stack([np.linalg.matrix_power(J, i) @ b for i in range(k)])
    sizes = np.linalg.norm(reach, axis=0)
    if not sizes.all() or np.linalg.norm(b) <= WEAK * np.linalg.norm(g) or np.linalg.svd(reach / sizes)[1][-1] < WEAK:
        values = np.linalg.eigvals(J)
        stays: complex = min(values, key=lambda value: np.linalg.svd(np.column_stack((J - value * np.eye(k), b)))[1][-1])  # Hautus
        raise ValueError(f"parameter {parameter!r} does not act on all directions that are to be controlled: to rounding, the "
                         f"multiplier {np.real_if_close(stays):.6g} stays whatever the gain, or is a double one; choose another "
                         "parameter or section")
    last = np.linalg.solve(reach.T, np.eye(k)[-1])
    return (last @ np.linalg.matrix_power(J, k)) @ V.T


def _above(M: np.ndarray, least: float) -> np.ndarray:
    """Return an orthonormal basis (ns, k) of the left subspace of the multipliers whose modulus is above ``least``."""
    _, Z, k = schur(M.T, output="real", sort=lambda real, imag=0.0: np.hypot(real, imag) > least)
    return Z[:, :k]


def _section(orbit: PeriodicOrbit, section) -> float:
    """Return a section that is no event of the orbit."""
    section = number("ogy", "section", section, least=0.0)
    if not section < orbit.periods:
        raise ValueError(f"ogy: section = {section!r} is not allowed; it must be below the {orbit.periods} forcing "
                         "periods of the orbit")
    for event in orbit.events:
        apart = (event.time / orbit.forcing_period - section) % orbit.periods
        if min(apart, orbit.periods - apart) < ON_EVENT:
            raise ValueError(f"ogy: section = {section!r} is not allowed; {event.element!r} has its event there, and a correction "
                             "that is switched on at an event is not smooth")
    return section
