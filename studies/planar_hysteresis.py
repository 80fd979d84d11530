"""Friction contact in a plane, |f| <= limit(t), with prescribed motion: sticking in closed form, sliding as one angle.

While the contact slides its force is limit (cos phi, sin phi), and the slider moves along it,

    phi' = k e_perp . u' / limit,        speed of the slider = e . u' - limit' / k >= 0,

an equation for one angle that is integrated with error control; where a load returns from zero its solution starts along
u' (the only one that is regular there).  Specs: Yang's contact, reading (ii); radial return is first order instead.
"""
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

from bifurc.elements import Jenkins
from bifurc.elements.driven import Driven
from bifurc.elements.local import Frame
from bifurc.flow.periodic import derivative, first_zero, product, product_integral, states
from bifurc.system import System

TURN = 2.0 * np.pi
NEAR = 1e-6  # angle from an instant without load at which sliding begins and ends: the force there is as small
RELATIVE, ABSOLUTE = 1e-12, 1e-13  # tolerances of the integration


@dataclass(frozen=True)
class PlanarLoop:
    """Periodic force of a contact in a plane.

    Attributes
    ----------
    works : tuple of float
        Energy of every period marched, force times length; the last is that of the periodic loop.
    settled : bool
        Whether the last two agree to the tolerance.
    phases : tuple of (float, str)
        Angle omega t and what begins there, in the last period: "stick", "slip", "apart".
    angle, displacement, force : ndarray, shapes (N,), (N, 2), (N, 2)
        Samples of the last period.
    """

    works: tuple[float, ...]
    settled: bool
    phases: tuple[tuple[float, str], ...] = field(repr=False)
    angle: np.ndarray = field(repr=False)
    displacement: np.ndarray = field(repr=False)
    force: np.ndarray = field(repr=False)

    @property
    def work(self) -> float:
        """Energy of the last period."""
        return self.works[-1]


def planar_hysteresis(system: System, x: str = "x", y: str = "y", tolerance: float = 1e-9, max_periods: int = 40,
                      samples: int = 720) -> PlanarLoop:
    """Return the loop of two driven sliders that share one friction circle instead of having a limit each.

    Parameters
    ----------
    system : System
        With two `Driven` `Jenkins` elements of the same contact, such as `bifurc.systems.macro_slip_contact()`.
    x, y : str
        Their labels.
    tolerance : float
        Relative change of the energy a period at which the loop counts as periodic.
    max_periods : int
    samples : int
        Of the loop, a period.

    Raises
    ------
    ValueError
        When the elements are not there, or are not the same contact.

    Examples
    --------
    >>> import bifurc as bf
    >>> from studies.planar_hysteresis import planar_hysteresis
    >>> round(planar_hysteresis(bf.systems.macro_slip_contact(case=1)).work, 4)
    90.1202
    """
    found = {name: item for name, item in zip(system.labels, system.elements, strict=True)
             if isinstance(item, Driven) and isinstance(item.element, Jenkins)}
    for name in (x, y):
        if name not in found:
            raise ValueError(f"planar_hysteresis: there is no driven Jenkins element {name!r}; "
                             f"there are {', '.join(found) or 'none'}")
    if found[x].element != found[y].element:
        raise ValueError(f"planar_hysteresis: {found[x].element!r} and {found[y].element!r} must be the same contact")
    march = _Integration(system, found[x], found[y])
    works: list[float] = []
    settled = False
    while len(works) < max_periods and not settled:
        works.append(march.period(samples))
        settled = len(works) > 1 and abs(works[-1] - works[-2]) <= tolerance * max(abs(works[-1]), march.scale)
    return PlanarLoop(tuple(works), settled, tuple(march.phases), *march.samples())


class _Integration:
    def __init__(self, system, x, y):
        sites = [item.site(system.n) for item in (x, y)]
        contact = x.element
        self.harmonics = tuple(sorted({*contact.harmonics, *sites[0].harmonics, *sites[1].harmonics}))
        self.frame = Frame(system.n, 0, self.harmonics, system.omega)
        ns = self.frame.ns
        self.u = np.array([site.rows(self.frame)[0][0, ns:] for site in sites])
        self.du = np.array([derivative(self.harmonics, c) for c in self.u])
        self.k = contact.stiffness
        self.limit = contact.limit * self.frame.row(contact.load)[ns:]
        self.dlimit = derivative(self.harmonics, self.limit)
        self.scale = np.abs(self.limit).sum() * np.abs(self.u).sum()
        self.phase, self.w = "stick", self.at(self.u, 0.0)
        self.angle, self.fresh = 0.0, False  # of the force while sliding; whether the load has just returned
        if self.at(self.limit, 0.0) <= 0.0:
            self.phase = "apart"
        self.pieces: list = []

    def at(self, c, theta):
        return c @ states(self.harmonics, theta)

    def period(self, samples: int) -> float:
        """March once round; return the energy."""
        theta, work = 0.0, 0.0
        self.phases, self.pieces = [(0.0, self.phase)], []
        self.grid = np.linspace(0.0, TURN, samples + 1)
        while theta < TURN:
            end, energy = getattr(self, "_" + self.phase)(theta)
            work += energy
            theta = end
            if theta < TURN:
                self.phases.append((theta, self.phase))
        return work

    def samples(self):
        angle = np.concatenate([piece[0] for piece in self.pieces])
        force = np.concatenate([piece[1] for piece in self.pieces])
        return angle, states(self.harmonics, angle) @ self.u.T, force

    def _on_grid(self, start, end):
        return np.concatenate(([start], self.grid[(self.grid > start) & (self.grid < end)], [end]))

    def _loss(self, theta):
        """Return the angle at which the load is lost, at most the end of the period."""
        lost = first_zero(self.harmonics, -self.limit, 0.0, theta, TURN)
        return TURN if lost is None else lost

    def _apart(self, theta):
        hit = first_zero(self.harmonics, self.limit, 0.0, theta, TURN)
        end = TURN if hit is None else hit
        self.pieces.append((np.array([theta, end]), np.zeros((2, 2))))
        if hit is not None:
            self.w = self.at(self.u, end)
            speed = self.at(self.du, end)
            self.phase = "stick" if self.k * np.hypot(*speed) <= self.at(self.dlimit, end) else "slip"
            self.angle = np.arctan2(speed[1], speed[0])
            self.fresh = True
        return end, 0.0

    def _stick(self, theta):
        force = self.k * self.u.copy()
        force[:, 0] -= self.k * self.w
        wide, margin = product(self.harmonics, [(force[0], force[0]), (force[1], force[1]), (-self.limit, self.limit)])
        lost = self._loss(theta)
        from_ = theta if margin @ states(wide, theta) < 0.0 else theta + 1e-7  # a slider that has just stopped is on its limit
        hit = first_zero(wide, margin, np.abs(margin[0]), from_, TURN) if from_ < TURN else None
        end = min(lost, TURN if hit is None else hit)
        energy = sum(product_integral(self.harmonics, f, d, theta, end) for f, d in zip(force, self.du, strict=True))
        grid = self._on_grid(theta, end)
        self.pieces.append((grid, states(self.harmonics, grid) @ force.T))
        if end < TURN:
            self.phase = "apart" if end == lost else "slip"
            f = self.at(force, end)
            self.angle, self.fresh = np.arctan2(f[1], f[0]), False
        return end, energy

    def _slip(self, theta):
        start = theta
        if self.fresh:  # from zero load: the regular solution, to first order
            speed, turn = self.at(self.du, theta), self.at(np.array([derivative(self.harmonics, c) for c in self.du]), theta)
            rate = (speed[0] * turn[1] - speed[1] * turn[0]) / (speed @ speed)  # of the direction of u'
            pull = self.k * np.hypot(*speed) / self.at(self.dlimit, theta)
            start = theta + NEAR
            self.angle += pull * rate / (1.0 + pull) * NEAR
            self.fresh = False
        lost = self._loss(start)
        stop = lost - NEAR if lost < TURN else TURN
        limit, dlimit, du, k = self.limit, self.dlimit, self.du, self.k

        def rhs(t, y):
            w = states(self.harmonics, t)
            e, v, most = np.array([np.cos(y[0]), np.sin(y[0])]), du @ w, limit @ w
            return [k * (e[0] * v[1] - e[1] * v[0]) / most, most * (e @ v)]

        def speed_of_slider(t, y):
            w = states(self.harmonics, t)
            return np.cos(y[0]) * (du[0] @ w) + np.sin(y[0]) * (du[1] @ w) - (dlimit @ w) / k
        speed_of_slider.terminal, speed_of_slider.direction = True, -1.0
        found = solve_ivp(rhs, (start, stop), [self.angle, 0.0], "DOP853", events=speed_of_slider, dense_output=True,
                          rtol=RELATIVE, atol=ABSOLUTE)
        end, (self.angle, energy) = found.t[-1], found.y[:, -1]
        grid = self._on_grid(start, end)
        w = states(self.harmonics, grid)
        phi = found.sol(grid)[0]
        self.pieces.append((grid, (w @ limit)[:, None] * np.stack((np.cos(phi), np.sin(phi)), axis=1)))
        if found.status == 1:
            self.phase = "stick"
            f = self.at(limit, end) * np.array([np.cos(self.angle), np.sin(self.angle)])
            self.w = self.at(self.u, end) - f / k
        elif lost < TURN:
            self.phase, end = "apart", lost
        return end, energy
