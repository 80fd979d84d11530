"""Harmonic orbits with set-valued friction: the solvers of `hbm.setvalued` and Li's published method, as `find_orbit` uses them."""
import functools

import numpy as np

from ...hbm.balance import Balance
from ...hbm.layout import Layout
from ...hbm.setvalued.condensed import condensed
from ...hbm.setvalued.douglas_rachford import split
from ...hbm.setvalued.equations import Balance as Friction
from ...hbm.setvalued.equations import Linear, SetValuedResult, SetValuedStatus
from ...hbm.setvalued.li2019 import galerkin
from ...hbm.setvalued.solution import solve
from ...hbm.setvalued.system_contacts import contacts_of, estimated_error, rest_of
from ...hbm.status import BalanceStatus

TIGHTER = 0.05  # first width for a given guess, over the natural one
TWICE, COVER = 2, 5.0  # the harmonics whose balance tells the distance, and how much of what it shows is stated
FLOOR = 1e-14  # of the largest coefficient
LARGEST = 1500  # unknowns of the larger balance
AFTER_SPLITTING = 0.01  # the same after the splitting, which is tried where nothing else converged
_STATUS = {SetValuedStatus.CONVERGED: None, SetValuedStatus.HELD: None, SetValuedStatus.RESTS: BalanceStatus.AT_REST,
           SetValuedStatus.SINGULAR: BalanceStatus.SINGULAR, SetValuedStatus.NOT_FINITE: BalanceStatus.CONTACTS_FAILED,
           SetValuedStatus.STUCK: BalanceStatus.NOT_CONVERGED}


def set_valued(balance: Balance, method, starts, guessed: bool):
    """Return packed coefficients, what `how` says, and None or the status.

    Parameters
    ----------
    balance : Balance
        With held elements among its parts.
    method : HarmonicBalance
    starts : list of ndarray (size,)
        Tried in order.
    guessed : bool
        Whether the user gave the start; then the regularisation begins narrow.
    """
    layout, contacts = balance.layout, contacts_of(balance)
    omega = float(balance.numbers.omega[0]) * layout.periods
    if method.solver == "galerkin-broyden":
        return galerkin(balance, contacts, rest_of(balance), method, starts)
    small = condensed(balance, contacts)
    if small is not None:
        layout, rest, given = small.layout, small.rest, small.contacts
        starts = [small.restricted(start) for start in starts]
    else:
        rest, given = rest_of(balance), contacts
    found = None
    tries = [*((start, TIGHTER if guessed else 1.0) for start in starts), *((start, 1.0) for start in starts[:guessed])]
    for start, first in tries:
        found = solve(layout, omega, rest, given, start, first_width=first, solver=method.solver)
        if found.success:
            break
    assert found is not None
    if not found.success and isinstance(rest, Linear):
        T = balance.numbers
        near = split(balance.layout, omega, T.M, T.C, T.K, T.E.ravel(), contacts).x
        near = near if small is None else small.restricted(near)
        again = solve(layout, omega, rest, given, near, first_width=AFTER_SPLITTING, solver=method.solver)
        found = again if again.success else found
    x = found.x if small is None else small.expanded(found.x)
    acting = [contact for contact in given if contact.limit > 0.0]
    how = reported(balance, contacts, Friction(layout, omega, rest, acting), found, method,
                   None if small is None else small.expanded)
    if small is not None:
        how["condensed to coordinates"] = [int(dof) for dof in np.flatnonzero(small.touched)]
    if found.status is SetValuedStatus.RESTS:
        how["interval"] = interval(balance, [contact for contact in contacts if contact.limit > 0.0], x, found.room)
    return x, how, _STATUS[found.status]


def reported(balance: Balance, contacts, equations: Friction, found: SetValuedResult, method, expanded=None) -> dict:
    """Return what `how` says of a solution: method, residual over the force scale, error estimates, reversals or interval."""
    layout = balance.layout
    force = max([float(np.abs(balance.numbers.E).max()), *(contact.limit for contact in contacts)]) or 1.0
    how: dict = {"method": f"harmonic balance with set-valued friction, {method.solver}", "statement": found.status.sentence,
                 "harmonics": [k / layout.periods for k in layout.harmonics], "iterations": found.iterations,
                 "evaluations": found.evaluations, "residual": found.residual / force}
    acting = [contact for contact in contacts if contact.limit > 0.0]
    spread = None if expanded is None else functools.partial(expanded, load=False)
    largest, first = estimated_error(balance, acting, equations, found, spread)
    if found.status is not SetValuedStatus.RESTS:
        away = from_twice(balance, method, found.x if expanded is None else expanded(found.x))
        if away is not None:  # both balances may hold a contact that slips in truth
            largest = np.maximum(largest, away) if np.any(found.widths > 0.0) else away
    how["error"] = [float(value) for value in largest] if np.isfinite(largest).all() else None
    how["error of the first harmonic"] = [float(value) for value in first] if np.isfinite(first).all() else None
    if found.status is not SetValuedStatus.RESTS:
        rate = float(balance.numbers.omega[0])
        how["reversals"] = {contact.label: [float(theta) / rate for theta in pattern.instants]
                            for contact, pattern in zip(acting, found.patterns, strict=True)}
        slow = [contact.label for contact, width in zip(acting, found.widths, strict=True) if width > 0.0]
        if slow:
            how["held contacts"] = slow
        if found.status is SetValuedStatus.HELD:
            how["held"] = True
    return how


def from_twice(balance: Balance, method, x) -> np.ndarray | None:
    """Return an estimate (n,) of the largest distance of each coordinate from the motion, from the balance in twice the harmonics;
    None where that is too large or has no solution.

    Kinks of the speeds at stick make coefficients fall slowly: the distance falls like 1 / H where contacts stick (within the kept
    harmonics rest is a ripple of turning speeds) and faster where they only reverse.  Of a distance that is halved or better, the
    larger balance shows at least a half; it falls by fits and starts, and in 231 comparisons a fifth was shown at least: `COVER`
    times what is shown is stated.
    """
    layout = balance.layout
    step = 2 if balance.system.symmetry == -1 and all(k % 2 for k in layout.harmonics) and layout.periods == 1 else 1
    more = Layout((*range(step - 1, TWICE * layout.top + 1, step),), layout.n, layout.periods)
    wide = Balance(balance.system, more, balance.samples and max(balance.samples, 8 * more.top))
    contacts = contacts_of(wide)
    small = condensed(wide, contacts)
    if (more if small is None else small.layout).size > LARGEST:
        return None
    start = layout.moved(x, more)
    omega = float(wide.numbers.omega[0]) * more.periods
    if small is None:
        found = solve(more, omega, rest_of(wide), contacts, start, first_width=TIGHTER, solver=method.solver)
        y = found.x
    else:
        found = solve(small.layout, omega, small.rest, small.contacts, small.restricted(start), first_width=TIGHTER,
                      solver=method.solver)
        y = small.expanded(found.x)
    if not found.success:
        return None
    theta = np.arange(8 * more.top) * (2.0 * np.pi / (8 * more.top))
    return COVER * np.abs(more.values(y - start, theta)).max(axis=0) + FLOOR * np.abs(x).max()


def interval(balance: Balance, contacts, x, room) -> list[list[float]]:
    """Return the least and the largest mean of each coordinate at rest, (n, 2): the contact forces stay within the bounds.

    With several contacts each is shifted alone, the others staying as found.
    """
    layout = balance.layout
    mean = layout.matrix(x)[0] if layout.mean else np.zeros(layout.n)
    out = np.stack([mean, mean], axis=1)
    K = balance.numbers.K
    for contact, (low, high) in zip(contacts, room, strict=True):
        try:
            shift = -np.linalg.solve(K, contact.row)
        except np.linalg.LinAlgError:  # a free coordinate rests anywhere
            return [[-np.inf, np.inf]] * layout.n
        ends = mean[:, None] + np.multiply.outer(shift, [low, high])
        out[:, 0], out[:, 1] = np.minimum(out[:, 0], ends.min(axis=1)), np.maximum(out[:, 1], ends.max(axis=1))
    return out.tolist()
