"""What a first command calls, called once each: `warm` runs `motions` in a process of its own, beside the others."""
import numpy as np

from .compose.scene import scene_of
from .continuation.shooting.problem import orbit_problem
from .ensemble.integrator import Integrator, Targets
from .flow.simulate import simulate
from .orbits.shooting.signature import Signature
from .orbits.solving import solve
from .systems import impact_oscillator


def scenes() -> None:
    """Compile what makes tables of a system: both halves need it."""
    scene_of(impact_oscillator(omega=1.4))


def motions() -> None:
    """Compile what simulations and basin maps of one degree of freedom call."""
    system = impact_oscillator(omega=1.4)
    simulate(system, (0.0, 2.0), periods=3).sections  # noqa: B018 (the property compiles)
    none = np.empty(0, np.int64)
    targets = Targets(np.ones(2), np.zeros((1, 2)), np.zeros(1), np.zeros(1, np.int64), 1.0, none.astype(np.uint64), none)
    integrator = Integrator(scene_of(system), 100)
    integrator.label(np.zeros((2, 2)), targets, 2)
    starts = np.stack(np.meshgrid(np.linspace(-3.0, 1.0, 12), np.linspace(-4.0, 4.0, 12)), axis=-1).reshape(-1, 2)
    integrator.propagate(starts, 4)  # so many that the batch step defers some


def orbits() -> None:
    """Compile the corrector of event sequences and the measures of orbits."""
    nodes = np.array([[0, 0, 0, 1, 0]])
    start = np.array([0.1298, 1.0, 2.9594])  # one impact a period at omega 1.5, amplitude .9
    system = impact_oscillator(omega=1.5, amplitude=0.9)
    orbit = solve(system, Signature(nodes, np.zeros(1), 1.0), start, np.array([1.0, 1.5]), {})
    problem = orbit_problem(orbit, "omega", (1.4, 1.6))
    problem.correct(problem.x0, problem.null_tangent(problem.x0))
    orbit.maximum(), orbit.multipliers, orbit.state, orbit.events
