"""Grazings classified from the touching orbit: impacts in powers of its linear map, side of birth of orbits, verdict.

With E, h, B of the touch (see `touch`), an impact of speed v at the touch changes the guard k periods later by
-(1 + r) v s_k, s_k = h E^k B.  All s_k > 0: the motion leaves the stop alone until it has decayed, and the map of impacts is
that of Nordmark with leading multiplier lambda: period adding for lambda < 1/4, windows between chaos up to 2/3, chaos at once
above.  Any s_k < 0: it is thrown back beyond the stop with a depth of the order of the square root of the parameter, and no
small attractor remains.  The orbit with one impact in n periods is born on the impacting side where
h (I - E^n)^-1 E^n B > 0, otherwise on the other.

References
----------
A. B. Nordmark, J. Sound Vib. 145 (1991) 279; W. Chin, E. Ott, H. E. Nusse, C. Grebogi, Phys. Rev. E 50 (1994) 4427;
M. H. Fredriksson, A. B. Nordmark, Proc. R. Soc. A 453 (1997) 1261.
"""
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...checks import POSITIVE, checked
from ...content import Content
from ..kinds import SpecialPointKind
from .confirm import agrees, confirmed
from .local import local_motion
from .touch import Touch, touches_of
from .verdicts import GrazingVerdict

DECAYED = 1e-8  # norm of E^k, scaled, at which s_k are no longer looked at
MOST = 4000  # powers looked at
ZERO = 1e-9  # s_k, relative to the largest it can be, that counts as zero
NEUTRAL = 1e-7  # distance of a multiplier from the unit circle
FLAT = 1e-7  # apex acceleration relative to the size of its terms
UNSEEN = 1e-10  # part in s_k of a multiplier that the stop does not see
ADDING, CHAOS = 0.25, 2.0 / 3.0  # bounds of the leading multiplier between the classes


@dataclass(frozen=True, eq=False)
class Grazing(Content):
    """What is known of a grazing.

    Attributes
    ----------
    apex : float
        A_g, second derivative of the guard in time at the touch, length per time squared for a stop.
    h, B : ndarray (ns,)
        Gradient of the guard; direction of the kick (rigid) or of the change of a short contact (elastic), see `Touch`.
    E : ndarray (ns, ns)
        Linear map of the orbit from touch to touch: its monodromy, -E(T/2) where a symmetric orbit touches two stops.
    s : ndarray (K,)
        s_k = h E^k B for k = 1 .. K, until E^k has decayed.
    multiplier : complex or float
        Leading multiplier of E among those that the stop excites and sees; real where it is.
    births : ndarray (K',)
        h (I - E^n)^-1 E^n B for n = 1 .. K': above 0 the orbit with one impact in n periods (half periods with a change of
        sign, where ``touch.symmetric``) is born on the impacting side, below 0 on the other. Elastic contacts: only n = 1.
    admissible : ndarray (K',) of bool
        Whether that orbit passes below the stop in the periods between its impacts.
    verdict : GrazingVerdict
    sentence : str
        What the verdict means here.
    touch : Touch or None
    """

    apex: float
    h: np.ndarray = field(repr=False)
    B: np.ndarray = field(repr=False)
    E: np.ndarray = field(repr=False)
    s: np.ndarray = field(repr=False)
    multiplier: complex
    births: np.ndarray = field(repr=False)
    admissible: np.ndarray = field(repr=False)
    verdict: GrazingVerdict
    sentence: str = field(repr=False)
    touch: Touch | None = field(repr=False)
    point: object = field(repr=False, compare=False)

    def __repr__(self) -> str:
        s = ", ".join(f"{value:.4g}" for value in self.s[:4])
        return f"Grazing({self.verdict.value}, A_g = {self.apex:.6g}, multiplier {self.multiplier:.5g}, s = {s}...)"

    @property
    def hysteresis(self) -> bool:
        """Whether the jump is one with hysteresis: the orbit with one impact a period exists on the free side too."""
        return bool(self.verdict is GrazingVerdict.JUMP and self.births.size and self.births[0] < 0.0)

    @checked(eps=POSITIVE)
    def expected(self, eps: float):
        """Return what the discontinuity map of the touch makes of a motion at a distance beyond, a `LocalMotion`.

        Verdicts hold in the limit: impacts of a jump have at least the speed 2 |A_g| (1 + r) |s_k| of the first s_k below zero,
        and where that is small the jump is told from small motions only nearer to the grazing.

        Parameters
        ----------
        eps : float
            Relative to the parameter.

        Returns
        -------
        LocalMotion or None
            None for elastic contacts and where the touch is not known.
        """
        return None if self.touch is None or self.verdict is GrazingVerdict.DEGENERATE else local_motion(self.touch, eps)

    @cached_property
    def confirmation(self):
        """What short simulations see at 1e-6, 1e-5 and 1e-4 (relative) beyond, a tuple of `Seen`; computed when looked up."""
        return confirmed(self)

    @property
    def confirmed(self) -> bool | None:
        """Whether the simulations agree with the verdict; None where it foretells nothing they could contradict."""
        return agrees(self)


def grazing_of(point) -> Grazing | None:
    """Return the classification of a grazing of a branch of periodic orbits.

    None for points of other kinds and for branches that are no event sequences (harmonic balances: polish the orbit with
    `find_orbit` and trace it).

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator(zeta=1.25, omega=2.0, amplitude=5.0)
    >>> branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(5, 6))
    >>> branch.special_points[0].grazing.verdict.value
    'period_adding'
    """
    if point.kind is not SpecialPointKind.GRAZING or point.problem.sequence is None:
        return None
    found = touches_of(point)
    if len(found) != 1:
        why = ("the orbit that touches is not known: several events vanish together" if not found else
               f"it touches {len(found)} times in a period: a double grazing")
        return _degenerate(point, found[0] if found else None, why)
    return classified(found[0], point)


def classified(touch: Touch, point=None) -> Grazing:
    """Return the classification of one touch."""
    labels = touch.problem.sequence.labels(touch.problem.scene)
    E, h, B, scale = labels.reduced(touch.E), labels.seen(touch.h), touch.B[labels.rest], touch.problem.weights[labels.rest]
    E, h, B = E * scale / scale[:, None], h * scale, B / scale  # the same numbers in natural sizes
    rigid = touch.restitution is not None
    if not (np.isfinite(E).all() and np.isfinite(B).all()):
        why = ("the force of the contact does not begin as that of a spring or dashpot" if np.isfinite(E).all() else
               "the orbit touches with another event at the same instant")
        return _degenerate(point, touch, why)
    if not touch.apex < -FLAT * _apex_size(touch):
        return _degenerate(point, touch, f"the apex acceleration A_g = {touch.apex:.3g} is zero: a flat touch (fourth order)")
    mu = np.linalg.eigvals(E)
    top = float(np.abs(mu).max(initial=0.0))
    s, sizes = powers(E, h, B)
    births, admissible = born(E, h, B, s.size if rigid else 1)
    multiplier, leading = leading_multiplier(E, h, B)
    verdict, sentence = _verdict(touch, s, sizes, births, multiplier, leading, top, mu)
    return Grazing(touch.apex, touch.h, touch.B, touch.E, s, multiplier, births, admissible, verdict, sentence, touch, point)


def powers(E, h, B, most=MOST):
    """Return (s_k, |h| |E^k| |B|) for k = 1 .. K, until |E^k| < 1e-8 (1 for the least) or K = ``most``, both (K,)."""
    s, sizes = [], []
    row, power = h.copy(), np.eye(len(h))
    size = float(np.linalg.norm(h) * np.linalg.norm(B))
    for _ in range(most):
        row, power = row @ E, power @ E
        norm = float(np.linalg.norm(power, 2))
        if not norm < 1e8:
            break
        s.append(float(row @ B))
        sizes.append(size * norm)
        if norm < DECAYED:
            break
    return np.array(s), np.array(sizes)


def born(E, h, B, count):
    """Return birth numbers h (I - E^n)^-1 E^n B and admissibility for n = 1 .. count, both (count,); NaN at a multiplier 1."""
    n_max = max(1, min(count, 24))
    eye = np.eye(len(h))
    each, good = np.full(n_max, np.nan), np.zeros(n_max, bool)
    images = [B]
    for _ in range(n_max):
        images.append(E @ images[-1])
    power = eye
    for n in range(1, n_max + 1):
        power = power @ E
        if np.abs(np.linalg.eigvals(power) - 1.0).min() <= NEUTRAL:
            continue
        left = np.linalg.solve((eye - power).T, h)
        passes = np.array([left @ images[k] for k in range(1, n + 1)])
        each[n - 1] = passes[-1]
        good[n - 1] = bool(np.all(passes[:-1] > passes[-1]))
    return each, good


def leading_multiplier(E, h, B):
    """Return (multiplier, part): the largest of E that B excites and h sees, and its part in s_0 = h B relative to their size."""
    mu, right = np.linalg.eig(E)
    order = np.argsort(-np.abs(mu), kind="stable")
    if np.linalg.cond(right) < 1e10:
        parts = (h @ right) * np.linalg.solve(right, B.astype(complex))
        size = np.linalg.norm(h) * np.linalg.norm(B)
        seen = [i for i in order if abs(parts[i]) > UNSEEN * size]
    else:
        parts, seen = np.ones(len(mu)), list(order)
    if not seen:
        return 0.0, 0.0
    i = seen[0]
    value = complex(mu[i])
    real = abs(value.imag) <= 1e-12 * abs(value)
    return (value.real if real else value), float(np.real(parts[i]))


def _verdict(touch, s, sizes, births, multiplier, leading, top, mu):
    V = GrazingVerdict
    if np.abs(mu - 1.0).min(initial=np.inf) <= NEUTRAL:
        return V.DEGENERATE, f"{V.DEGENERATE.sentence} Here a multiplier of the touching orbit is 1: grazing meets a fold."
    if abs(top - 1.0) <= NEUTRAL:
        return V.DEGENERATE, (f"{V.DEGENERATE.sentence} Here a multiplier of the touching orbit lies on the unit circle: grazing "
                              "meets a flip, a torus bifurcation, or a motion without damping.")
    if top > 1.0:
        return V.UNSTABLE, f"{V.UNSTABLE.sentence} Its largest multiplier has the modulus {top:.6g}."
    if touch.restitution is None:
        return V.PERSISTENCE, V.PERSISTENCE.sentence
    floor = ZERO * sizes
    low = np.flatnonzero(s < -floor)
    still = np.flatnonzero(np.abs(s[:max(1, low[0] if low.size else 1)]) <= floor[:max(1, low[0] if low.size else 1)])
    if still.size and s.size and (not low.size or still[0] < low[0]):
        k = int(still[0]) + 1
        return V.DEGENERATE, f"{V.DEGENERATE.sentence} Here s_{k} = 0: a resonant grazing."
    if low.size:
        k = int(low[0]) + 1
        back = (" The orbit with one impact a period exists on the free side too: hysteresis down to its fold."
                if births.size and births[0] < 0.0 else "")
        return V.JUMP, f"{V.JUMP.sentence} Here s_{k} = {s[k - 1]:.4g} is the first below 0.{back}"
    if isinstance(multiplier, complex) or multiplier <= 0.0 or leading <= 0.0:
        return V.JUMP, (f"{V.JUMP.sentence} Here the leading multiplier {multiplier:.4g} is not positive: an s_k beyond those "
                        "computed is below 0, of which only motions very close to the grazing know.")
    verdict = V.PERIOD_ADDING if multiplier < ADDING else V.WINDOWS_AND_CHAOS if multiplier < CHAOS else V.IMMEDIATE_CHAOS
    return verdict, f"{verdict.sentence} Here the leading multiplier is {multiplier:.6g}."


def _apex_size(touch):
    """Size of the terms of the apex acceleration."""
    T = touch.tables
    row = T.GT[touch.mode, touch.guard, :, 2]
    return 2.0 * float(np.abs(row) @ np.abs(touch.joined(touch.state, touch.time)))


def _degenerate(point, touch, why):
    V = GrazingVerdict
    none = np.empty(0)
    square = np.empty((0, 0))
    given = (touch.apex, touch.h, touch.B, touch.E) if touch is not None else (np.nan, none, none, square)
    sentence = f"{V.DEGENERATE.sentence} Here {why}."
    return Grazing(*given, none, np.nan, none, np.empty(0, bool), V.DEGENERATE, sentence, touch, point)
