"""Options of a harmonic balance: harmonics, samples, solver."""
from dataclasses import dataclass

import numpy as np

from ...checks import COUNT, checked, choice, flag, of, whole
from ...hbm.balance import Balance
from ...hbm.condensation.condensed import Condensed
from ...hbm.layout import Layout, listed
from ...system import System

SOLVERS = ("newton", "broyden", "galerkin-broyden")
AUTO_FIRST, AUTO_MOST = 7, 161  # harmonics of "auto": first and most
SAMPLES = 1024  # of contacts by default with aft="sampled"; per highest harmonic at least SAMPLES_A_WAVE
SAMPLES_A_WAVE = 16
CONDENSED = 200  # unknowns of the whole balance from which on those of the touched rows alone take less time (measured)
FEWER = 0.5  # of the unknowns at most, for the same reason


@checked(harmonics=None, aft=of(choice, allowed=("exact", "sampled")), samples=of(whole, least=3, most=10**8),
         solver=of(choice, allowed=SOLVERS), condense=flag)
@dataclass(frozen=True)
class HarmonicBalance:
    """How `find_orbit` balances harmonics.

    Parameters
    ----------
    harmonics : int, sequence, or "auto"
        H: 0 .. H; or the harmonics of the excitation themselves (multiples of 1/periods for an orbit of several forcing
        periods); "auto": added until the estimated error is below `tolerance`.
    aft : {"exact", "sampled"}
        How contacts are taken: their events found and polished and forces integrated in closed form, or at samples.  Force
        laws are always sampled.
    samples : int, optional
        A period.  Default for contacts: 1024, and 16 a shortest wave at least; for laws: 8 a shortest wave and 128 at least,
        which is exact for polynomials up to degree 6, doubled until the residual no longer changes.
    solver : {"newton", "broyden", "galerkin-broyden"}
        Newton with the exact Jacobian; Broyden from it; Li's published method for dry friction (for study).
    tolerance : float
        With "auto": wanted error over the amplitude, dimensionless, at most 0.1.
    condense : bool, optional
        Whether orbits and branches are solved in the coordinates that contacts and laws touch, and the others recovered from
        the linear part: the same solutions, in a time that hardly depends on the degrees of freedom.  Default: where it pays;
        `HarmonicOrbit.how` says whether.  Set-valued friction has its own ways and "galerkin-broyden" is as published; for
        them this has no meaning.

    Examples
    --------
    >>> import bifurc as bf
    >>> from bifurc.orbits.balance.find import HarmonicBalance
    >>> orbit = bf.find_orbit(bf.systems.jenkins_oscillator(), method=HarmonicBalance(7))
    >>> round(abs(orbit.harmonic(1)), 9)
    3.514307059
    """

    harmonics: int | tuple[float, ...] | str = 7
    aft: str = "exact"
    samples: int | None = None
    solver: str = "newton"
    tolerance: float = 1e-4
    condense: bool | None = None

    def __post_init__(self):
        if isinstance(self.harmonics, str):
            choice(type(self).__name__, "harmonics", self.harmonics, ("auto",))
        else:
            listed(self.harmonics, 64)  # for its message; orbits of several periods are asked again with theirs
            if not isinstance(self.harmonics, (int, np.integer)):
                object.__setattr__(self, "harmonics", tuple(float(k) if k % 1 else int(k) for k in self.harmonics))

    @checked(first=COUNT)
    def layout(self, n: int, periods: int = 1, first: int = AUTO_FIRST) -> Layout:
        """Return the layout for ``n`` degrees of freedom; "auto" gives harmonics up to ``first``."""
        return Layout(listed(first if self.harmonics == "auto" else self.harmonics, periods), n, periods)

    def balance(self, system: System, layout: Layout, parts=None) -> Balance:
        """Return the equations.

        Raises
        ------
        ValueError
            See `hbm.parts.split`.
        """
        samples = 0
        if self.aft == "sampled":
            samples = self.samples or max(SAMPLES, SAMPLES_A_WAVE * layout.top)
        return Balance(system, layout, samples, self.samples, parts)

    def condensed(self, balance: Balance, like: Condensed | None = None) -> Condensed | None:
        """Return the equations of the touched coordinates alone, `hbm.condensation`; None: the whole balance is to be solved."""
        rows = balance.parts.shape.R
        if self.condense is False or self.solver == "galerkin-broyden" or balance.parts.held or not rows.any():
            return None
        touched = np.count_nonzero(rows.any(axis=1))
        if self.condense is None and (balance.size < CONDENSED or touched > FEWER * balance.layout.n):
            return None
        made = Condensed(balance, like=like)
        return made if made.here.linear.regular else None

    def to_record(self) -> dict:
        """Return the fields, ready for JSON."""
        harmonics = self.harmonics if isinstance(self.harmonics, (int, str)) else list(self.harmonics)
        return {"harmonics": harmonics, "aft": self.aft, "samples": self.samples, "solver": self.solver,
                "tolerance": self.tolerance, "condense": self.condense}

    @classmethod
    def from_record(cls, record: dict) -> "HarmonicBalance":
        """Make the options that gave ``record``."""
        return cls(**{**record, "harmonics": tuple(record["harmonics"]) if isinstance(record["harmonics"], list)
                      else record["harmonics"]})
