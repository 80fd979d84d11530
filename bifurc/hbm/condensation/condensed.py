"""A balance condensed to the coordinates that contacts and laws touch: its size no longer depends on the degrees of freedom.

    Z_k q_k = e_k + R^T f_k(R q)   ->   p_k - B Z_k^-1 e_k - H_k S^T f_k(S p) = 0,   H_k = B Z_k^-1 B^T,   R = S B

for every harmonic k, with the independent rows B among the touched ones R and p = B q; afterwards q_k = Z_k^-1 (e_k + R^T f_k).
The forces are those of an ordinary `Balance` on p without a linear part; `receptance` gives the rest.  Newton's steps are those
of the whole balance, seen in p.  An evaluation costs O((2 K m)^2) for m rows and K harmonics, and at a new frequency O(K n m^2).
"""
import functools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import qr

from ..balance import Balance
from ..layout import Layout
from ..parts import Numbers, Parts, length, views
from ..status import ContactStatus
from .receptance import Changed, LinearPart, Receptance, packed, phasors

DEPENDENT = 1e-12  # relative size below which a row is a combination of others


class Point(NamedTuple):
    """Numbers at which a condensed balance is asked, and their derivatives by a parameter."""

    T: Numbers  # of the system; its core is not looked at unless it moved
    dT: Numbers
    flat: np.ndarray  # of contacts and laws, as `Condensed.forces` takes them
    dflat: np.ndarray
    moved: bool  # whether the core is another than that of the balance
    linear: Receptance


class Condensed:
    """Equations of a balance in the packed coefficients ``u`` of the touched coordinates p = B q alone.

    Parameters
    ----------
    balance : Balance
        Of n degrees of freedom; events exact or sampled, as it says.  Its numbers must not be changed afterwards.
    drives : bool
        With further unknowns: where the load acts, for every harmonic of it, the motion of the coordinate e_k^T q (over
        |e_k|_1), cosine and sine.  Resonances of modes in which no touched coordinate moves are seen there, and so by the steps
        of a branch.
    sweep : bool
        Whether many frequencies will be asked, see `LinearPart`.
    like : Condensed, optional
        Whose eigenvectors are shared if the core is the same.
    changed : Changed, optional
        How the core will change, see `LinearPart`.

    Attributes
    ----------
    layout : Layout
        Of the touched coordinates: the same harmonics, m = len(rows).
    size : int
        Number of unknowns: layout.size, and those of the drives.
    rows : ndarray (m, n)
        B.
    forces : Balance
        Of the touched coordinates, without a linear part: its residual is minus the forces along B.
    load : float
        Factor of the load, dimensionless.

    Raises
    ------
    ValueError
        Where nothing is touched (the motion is `Balance.linear_response`), and for set-valued elements
        (`setvalued_condensed`).

    Examples
    --------
    >>> from bifurc import System
    >>> from bifurc.elements import HarmonicForce, Jenkins
    >>> from bifurc.solve.newton import newton
    >>> system = System(np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]], [HarmonicForce(1.0), Jenkins(1.0, 0.1, dof=1)],
    ...                 omega=0.8)
    >>> balance = Balance(system, Layout((0, 1, 2, 3), 2))
    >>> condensed = Condensed(balance)
    >>> condensed.size, balance.size
    (7, 14)
    >>> found = newton(condensed.residual, condensed.jacobian, condensed.linear_response())
    >>> bool(np.abs(balance.residual(condensed.expand(found.x))).max() < 1e-12)
    True
    """

    linear: LinearPart

    def __init__(self, balance: Balance, drives: bool = False, sweep: bool = False, like: "Condensed | None" = None,
                 changed: Changed | None = None):
        parts = balance.parts
        if parts.held:
            raise ValueError(f"Condensed: {parts.held[0].name} is set-valued; use hbm.setvalued_condensed")
        if not parts.shape.R.any():
            raise ValueError(f"Condensed: no contact and no law feels the motion of {balance.system!r}; it is "
                             "Balance.linear_response()")
        self.balance, self.whole, self.load = balance, balance.layout, 1.0
        self.rows, combined = _independent(parts.shape.R)
        self.layout = Layout(self.whole.harmonics, len(self.rows), self.whole.periods)
        self.forces = Balance(balance.system, self.layout, balance.samples, balance.law_samples,
                              _without_core(parts, self.layout, combined))
        outputs, self._drives = self.rows, np.zeros((0, 2), np.int64)
        if drives:
            outputs, self._drives = _driven(phasors(self.whole, parts.numbers.E), self.rows, self.whole.harmonics)
        self.size = self.layout.size + 2 * len(self._drives)
        shared = None if like is None else like.linear
        self.linear = LinearPart(parts.numbers, self.whole, self.rows, outputs, sweep, shared, changed)
        places = _moved(np.arange(1.0, len(parts.flat) + 1.0), parts, self.forces.parts).astype(np.int64)
        self._own, self._come = np.flatnonzero(places), places[places > 0] - 1

    @functools.cached_property
    def here(self) -> Point:
        """The numbers of the balance itself; nothing changes."""
        return self.point(self.balance.parts.flat, np.zeros_like(self.balance.parts.flat), False)

    def point(self, flat, dflat, moved: bool | None = None, named: tuple[Numbers, Numbers] | None = None) -> Point:
        """Return the point for numbers of the system (see `hbm.parts`) and their derivatives by a parameter.

        ``moved``: whether mass, damping or stiffness differ from those of the balance or change; default: found out.
        ``named``: both by name, if that was done before.
        """
        T, dT = named or (views(flat, self.balance.parts.shape), views(dflat, self.balance.parts.shape))
        if moved is None:
            moved = not self.linear.same_core(T) or bool(dT.M.any() or dT.C.any() or dT.K.any())
        small, slope = np.zeros_like(self.forces.parts.flat), np.zeros_like(self.forces.parts.flat)
        small[self._own], slope[self._own] = flat[self._come], dflat[self._come]
        return Point(T, dT, small, slope, moved, self.linear.receptance(T, dT, moved))

    # equations

    def linearised(self, x, point: Point | None = None, slopes: bool = True,
                   listed=None) -> tuple[ContactStatus, np.ndarray, np.ndarray]:
        """Return status, residual (size,), in the units of x, and derivatives (size, size + 1), the last column by the parameter.

        Where the contacts cannot be followed, or a harmonic has no solution (see `Receptance`), the arrays are NaN.

        Parameters
        ----------
        x : ndarray (size,)
            Packed coefficients of the touched coordinates, then those of the drives.
        point : Point, optional
            Default: the balance's own numbers.
        slopes : bool
            False: derivatives are zero.
        listed : int ndarray (contacts,), optional
            See `Balance.linearised`.
        """
        point = self.here if point is None else point
        found, size, own, m = point.linear, self.size, self.layout.size, self.layout.n
        u = np.ascontiguousarray(x[:own], float)
        status, f, wide = self.forces.linearised(u, point.flat, point.dflat, slopes, listed)
        if status is not ContactStatus.FOLLOWED or not found.regular:
            return status, np.full(size, np.nan), np.full((size, size + 1), np.nan)
        shape = (self.layout.slots, m)
        force, shifted = phasors(self.layout, f.reshape(shape)), found.shift.any()
        if shifted:
            force = force - found.shift[:, None] * phasors(self.layout, u.reshape(shape))
        response = self.load * found.free - (found.H @ force[:, :, None])[:, :, 0]
        out = np.zeros((size, size + 1))
        residual = x - self._collected(response)
        if slopes:
            change = phasors(self.layout, wide.reshape(*shape, own + 1))
            if shifted:
                change = change - found.shift[:, None, None] * phasors(self.layout, np.eye(own, own + 1).reshape(*shape, own + 1))
            change = found.H @ change
            change[:, :, -1] += (found.dH @ force[:, :, None])[:, :, 0] - self.load * found.dfree
            collected = self._collected(change)
            out[:, :own], out[:, -1] = collected[:, :-1], collected[:, -1]
            out[np.arange(size), np.arange(size)] += 1.0
        return status, residual, out

    def _collected(self, response) -> np.ndarray:
        """Return what the unknowns (size, ...) should be, of responses (K, o, ...)."""
        out = packed(self.layout, response[:, :self.layout.n])
        out = out.reshape(self.layout.size, *response.shape[2:])
        if not len(self._drives):
            return out
        own = response[self._drives[:, 0], self._drives[:, 1]]
        return np.concatenate([out, np.stack([own.real, -own.imag], axis=1).reshape(2 * len(own), *response.shape[2:])])

    def residual(self, x, point: Point | None = None, listed=None) -> np.ndarray:
        """Return the residual (size,), in the units of x; NaN where `linearised` says why."""
        return self.linearised(x, point, False, listed)[1]

    def jacobian(self, x, point: Point | None = None) -> np.ndarray:
        """Return the derivative of the residual (size, size), dimensionless; the load does not enter."""
        return self.linearised(x, point)[2][:, :-1]

    def linear_response(self) -> np.ndarray:
        """Return the unknowns (size,) without contacts and laws (with the spring that holds a free body, see `Receptance`)."""
        return self._collected(self.load * self.here.linear.free)

    # the whole motion

    def restricted(self, x) -> np.ndarray:
        """Return the unknowns (size,) of packed coefficients of all coordinates (whole.size,)."""
        q = phasors(self.whole, self.whole.matrix(np.asarray(x, float)))
        return self._collected(q @ self.linear.outputs.T)

    def expand(self, x, point: Point | None = None) -> np.ndarray:
        """Return the packed coefficients of all coordinates (whole.size,) for the unknowns; NaN where contacts fail."""
        point = self.here if point is None else point
        u = np.ascontiguousarray(x[:self.layout.size], float)
        status, f, _ = self.forces.linearised(u, point.flat, point.dflat, False)
        if status is not ContactStatus.FOLLOWED or not point.linear.regular:
            return np.full(self.whole.size, np.nan)
        return packed(self.whole, self._motion(u, f, point)).ravel()

    def _motion(self, u, f, point: Point) -> np.ndarray:
        """Return the phasors (K, n) of all coordinates for those touched and minus the forces along B."""
        shape, shift = (self.layout.slots, self.layout.n), point.linear.shift
        force = phasors(self.layout, f.reshape(shape)) - shift[:, None] * phasors(self.layout, u.reshape(shape))
        load = self.load * phasors(self.whole, point.T.E) - force @ self.rows
        return self.linear.motion(point.T, load, shift, point.moved)

    def gradient(self, g, x, point: Point) -> np.ndarray:
        """Return the derivatives (size + 1,) by unknowns and parameter of g . `expand`, for packed weights ``g`` (whole.size,)."""
        own, shape = self.layout.size, (self.layout.slots, self.layout.n)
        u = np.ascontiguousarray(x[:own], float)
        _, f, wide = self.forces.linearised(u, point.flat, point.dflat)
        wide = phasors(self.layout, wide.reshape(*shape, own + 1))
        q = self._motion(u, f, point)
        shift = point.linear.shift
        if shift.any():
            wide = wide - shift[:, None, None] * phasors(self.layout, np.eye(own, own + 1).reshape(*shape, own + 1))
        weights = self.linear.motion(point.T, phasors(self.whole, self.whole.matrix(g)).conj(), shift, point.moved, True)
        out = np.zeros(self.size + 1)
        change = -np.einsum("km,kmj->j", weights @ self.rows.T, wide).real
        out[:own], out[-1] = change[:-1], change[-1]
        turn = self.load * phasors(self.whole, point.dT.E) - self.linear.derived(point.T, point.dT, q, point.moved)
        out[-1] += float((weights * turn).real.sum())
        return out

    # what an orbit asks

    def reaction(self, x) -> np.ndarray:
        """Return the forces (slots, n) of contacts and laws along a packed motion of all coordinates; NaN where they fail."""
        u = self.restricted(x)[:self.layout.size]
        status, f, _ = self.forces.linearised(u, slopes=False)
        if status is not ContactStatus.FOLLOWED:
            return np.full((self.layout.slots, self.whole.n), np.nan)
        return -f.reshape(self.layout.slots, self.layout.n) @ self.rows

    def relative_residual(self, x) -> float:
        """Return the largest residual of the whole balance at ``x`` (whole.size,) over the largest force; inf: contacts fail."""
        T = self.here.T
        q = phasors(self.whole, self.whole.matrix(np.asarray(x, float)))
        u = self.restricted(x)[:self.layout.size]
        status, f, wide = self.forces.linearised(u)
        if status is not ContactStatus.FOLLOWED:
            return np.inf
        load, force = self.load * phasors(self.whole, T.E), phasors(self.layout, f.reshape(self.layout.slots, -1)) @ self.rows
        worst, size = 0.0, max(float(np.abs(load).max(initial=0.0)), 1e-300)
        for i, Z in enumerate(self.linear.stiffnesses(T, False)):
            r = Z @ q[i] - load[i] + force[i]
            worst = max(worst, float(np.abs(r.real).max()), float(np.abs(r.imag).max()))
            size = max(size, float((np.abs(Z) @ np.abs(q[i])).max()))
        contact = (np.abs(wide[:, :-1]) @ np.abs(u)).reshape(self.layout.slots, -1) @ np.abs(self.rows)
        return worst / max(size, float(contact.max()))

    def stepped(self, x, coupled: bool = True) -> np.ndarray:
        """Return the motion (whole.size,) after one Newton step of the whole balance from ``x``; NaN where there is none.

        ``coupled``: False for contacts and laws that go on with their forces at ``x``.
        """
        u = self.restricted(x)
        status, f, wide = self.forces.linearised(u[:self.layout.size])
        if status is not ContactStatus.FOLLOWED:
            return np.full(self.whole.size, np.nan)
        f, wide, new = f.copy(), wide[:, :-1].copy(), u
        if coupled:
            _, residual, slopes = self.linearised(u)
            try:
                new = u - np.linalg.solve(slopes[:, :-1], residual)
            except np.linalg.LinAlgError:
                return np.full(self.whole.size, np.nan)
            f = f + wide @ (new - u)[:self.layout.size]
        return packed(self.whole, self._motion(new[:self.layout.size], f, self.here)).ravel()

    def __repr__(self):
        return (f"Condensed({self.whole.n} degrees of freedom to {len(self.rows)}, {self.size} unknowns, "
                f"receptance {self.linear.way})")


def _independent(R) -> tuple[np.ndarray, np.ndarray]:
    """Return independent rows B (m, n) among R (nr, n), and S (nr, m) with R = S B."""
    size = np.linalg.norm(R, axis=1)
    size[size == 0.0] = 1.0  # of elements that are driven, whatever the system does
    _, triangle, order = qr((R / size[:, None]).T, mode="economic", pivoting=True)
    rank = int((np.abs(np.diag(triangle)) > DEPENDENT).sum())
    if rank == len(R):
        return R.copy(), np.eye(len(R))
    kept = np.sort(order[:rank])
    B = R[kept]
    S = np.linalg.lstsq(B.T, R.T, rcond=None)[0].T
    S[np.abs(S) < DEPENDENT] = 0.0
    S[kept] = np.eye(rank)
    return np.ascontiguousarray(B), np.ascontiguousarray(S)


def _driven(load, rows, harmonics) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows with those of the loads (K, n) that they do not span, and (harmonic, row) of each load (drives, 2)."""
    outputs, drives = [*rows], []
    for i, (k, e) in enumerate(zip(harmonics, load, strict=True)):
        if k == 0 or not e.any():
            continue
        e = e * (np.abs(e).max() / e[np.argmax(np.abs(e))]) / np.abs(e).sum()  # real if all of it has one phase
        rest = e - rows.T @ np.linalg.lstsq(rows.T, e, rcond=None)[0]
        if np.abs(rest).max() <= 1e-9 * np.abs(e).max():
            continue
        same = [j for j in range(len(rows), len(outputs)) if np.abs(outputs[j] - e).max() <= 1e-12 * np.abs(e).max()]
        if not same:
            outputs.append(e)
        drives.append((i, same[0] if same else len(outputs) - 1))
    out = np.array(outputs)
    return (out.real.copy() if not np.iscomplexobj(out) or not out.imag.any() else out), np.array(drives, np.int64).reshape(-1, 2)


def _without_core(parts: Parts, layout: Layout, S) -> Parts:
    """Return the contacts and laws of a system on other coordinates (rows R -> S), without mass, damping, stiffness and load."""
    dims = parts.shape.dims.copy()
    dims[0] = layout.n
    shape = parts.shape._replace(dims=dims, R=np.ascontiguousarray(S, float))
    own = replace(parts, layout=layout, shape=shape, flat=np.zeros(length(shape)), sampled={})
    own.flat[:] = _moved(parts.flat, parts, own)
    return own


def _moved(flat, parts: Parts, own: Parts) -> np.ndarray:
    """Return the numbers of contacts and laws, out of those of the whole system, as the smaller one holds them."""
    out = np.zeros(length(own.shape))
    mine, theirs = views(out, own.shape), views(flat, parts.shape)
    for name, to, come in zip(mine._fields, mine, theirs, strict=True):
        if name not in ("M", "C", "K", "E"):
            to[:] = come
    return out
