"""All equilibria of a system of first order without excitation: of regions, virtual ones included, and of slides."""
import importlib

from ..checks import SYSTEM, checked
from ..elements.automaton import Automaton
from ..system import System


@checked(system=SYSTEM)
def equilibria(system: System) -> tuple:
    """Return the equilibria of the modes of a system of first order without excitation, one a mode at most.

    Parameters
    ----------
    system : System
        A `PiecewiseSystem` or `HybridSystem` with omega = None.

    Returns
    -------
    tuple of Equilibrium
        Virtual ones too; `Equilibrium.kind`, `virtual` and `contacts` say which is which. A mode whose equilibria fill a
        continuum, or that has none, gives none.

    Raises
    ------
    ValueError
        For another system, or one with excitation.

    Examples
    --------
    >>> import bifurc as bf
    >>> from bifurc.piecewise import equilibria
    >>> A = [[-1.0, 1.0], [-1.0, -0.5]]
    >>> system = bf.PiecewiseSystem("x y", {"-": bf.AffineField(A, lambda mu: [0, mu]),
    ...                                     "+": bf.AffineField(A, lambda mu: [0.5, mu - 1])},
    ...                             [bf.Switch(bf.AffineSurface([0, 1.0]))], mu=0.3)
    >>> [(found.kind, found.virtual) for found in equilibria(system)]
    [('regular', True), ('regular', True), ('pseudo', False)]
    """
    automaton = next((element for element in system.elements if isinstance(element, Automaton)), None)
    if automaton is None or system.omega is not None:
        raise ValueError(f"equilibria: system = {system!r} is not allowed; it must be a PiecewiseSystem or HybridSystem without "
                         "excitation")
    ends = dict(automaton.final)
    ways = importlib.import_module("..orbits.equilibria.equilibrium", __package__)  # stands on this package
    return ways.equilibria_of(system, [(key,) for key, _ in automaton.rates if key not in ends])
