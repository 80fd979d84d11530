"""Set-valued friction of a system as contacts of a balance, and how far its solution may be from the motion.

Where the balance can be solved in twice the harmonics, that tells the distance (`orbits.balance.setvalued.from_twice`).
Elsewhere two estimates, of which the smaller is stated, and a third that is added where the kept harmonics hide a slip:

* energy.  With e the error of the speeds, P the kept harmonics, r_h the forces of the solution and monotone friction,
  e^T C e <= -<(1 - P) r_h, e> <= |Y| |(1 - P) r_h|^2, Y the mobility of the contacts beyond the kept harmonics; the true
  forces are assumed to have no more outside the kept harmonics than the sign pattern has.  Needs positive damping.
* one step.  Speeds outside the kept harmonics follow from the forces there; what they change at the reversals is the
  residual of a Newton step, taken `SAFETY` times (the true error was 2.8 times the step at most in 120 random cases).
* impulse.  A contact that is held within the kept harmonics although their force exceeds its bounds slips briefly in truth;
  impulse over mass times duration says how far.
"""
from collections.abc import Callable

import numpy as np

from ...elements.local import Affine, affine, rate
from ..balance import Balance as Core
from ..errors import longer
from .equations import Balance, Contact, Linear, SetValuedResult, SetValuedStatus
from .sign_pattern import added, grid_size, on_grid, pattern

SAFETY = 6.0
BEYOND = 8  # harmonics of the forces, over the highest kept one, that the estimates use
LARGEST = 2000  # unknowns up to which laws are balanced in twice the harmonics


def contacts_of(core: Core) -> list[Contact]:
    """Return the set-valued contacts of a balance.

    Raises
    ------
    ValueError
        For an element whose force of slip is not its limit of stick (static friction above kinetic, Stribeck), or whose
        bounds depend on the motion: harmonic balance has no solution theory for them.
    """
    found = []
    system, layout = core.system, core.layout
    omega = float(core.numbers.omega[0]) * layout.periods
    for held in core.parts.held:
        element = system.elements[held.element]
        site = element.site(layout.n)
        modes = {key: element.mode(key, system.core) for key in held.keys}
        key, stick = next((key, mode) for key, mode in modes.items() if mode.hold)
        if len(held.rows) != 1 or len(stick.bounds) != 1 or len(stick.hold) != 1:
            raise ValueError(f"{held.name}: mode {key!r} holds a row without bounds for its force; give Mode.bounds, or use "
                             "find_orbit without method=")
        least, most = (affine(bound) * stick.hold[0].push[0] for bound in stick.bounds[0])
        for other, mode in modes.items():
            if mode.hold:
                continue
            entry = affine(mode.entries[0]) if mode.entries else None
            if mode.law is not None or (entry is not None and entry not in (least, most)):
                raise ValueError(f"{held.name}: the force of mode {other!r} is not the limit of {key!r}; friction that is larger "
                                 "at rest than in motion is not treated by harmonic balance. Use find_orbit without method=")
        for bound in (least, most):
            if bound.names - {"one", "cos", "sin"}:
                raise ValueError(f"{held.name}: the bound {bound!r} depends on the motion; harmonic balance treats bounds that "
                                 "depend on time only. Use find_orbit without method=")
        speed = np.zeros(1, complex)
        if site.drift:
            speed[0] += site.drift[0]
        if site.base:
            speed = added(speed, _phasors(rate(site.base[0], omega), layout.periods))
        found.append(Contact(np.asarray(site.R[0], float), -_phasors(least, layout.periods), -_phasors(most, layout.periods), speed,
                             held.name))
    return found


def _phasors(expression: Affine, periods: int) -> np.ndarray:
    """Return the phasors of a constant and harmonics of the excitation."""
    out = np.zeros(1 + periods * max(expression.harmonics, default=0), complex)
    for (name, k), weight in expression.terms.items():
        out[0 if name == "one" else k * periods] += -1j * weight if name == "sin" else weight
    return out


def rest_of(core: Core):
    """Return everything but the contacts: x -> (residual, Jacobian); NaN where other contacts cannot be followed."""
    def rest(x):
        return core.residual(x), core.jacobian(x)

    if core.parts.contacts or core.parts.laws:
        return rest
    T, layout = core.numbers, core.layout
    return Linear.of(layout, float(T.omega[0]) * layout.periods, T.M, T.C, T.K, T.E.ravel())


def estimated_error(core: Core, contacts, balance: Balance, result: SetValuedResult,
                    spread: Callable | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return estimates (n,) of the largest distance of each coordinate from the motion, and of that of its first harmonic.

    Infinite where neither estimate can be made (no damping, and no Newton step).

    Parameters
    ----------
    core : Balance
        Of the whole system.
    contacts : sequence of Contact
        With rows over all coordinates.
    balance : setvalued_parts.Balance
        The equations solved, condensed or not; its contacts are the same in the same order.
    result : SetValuedResult
        Of these equations.
    spread : callable, optional
        From a change of the condensed coefficients to that of all.
    """
    layout = core.layout
    n = layout.n
    if result.status is SetValuedStatus.RESTS or not len(contacts):
        return np.zeros(n), np.zeros(n)
    top = BEYOND * layout.top
    lost = [k for k in range(top + 1) if k not in layout.harmonics]
    rows = np.array([contact.row for contact in contacts])
    nu = float(core.numbers.omega[0])
    forces = np.zeros((len(rows), top + 1), complex)
    outside = 0.0
    speeds = []
    for i, (contact, width) in enumerate(zip(balance.contacts, result.widths, strict=True)):
        s = balance.speed(result.x, contact)
        speeds.append(s)
        forces[i] = pattern(s, contact.upper, contact.lower, width, top, 0).force
        outside += _mean_square(contact, s, width) - _square(forces[i, list(layout.harmonics)], layout.harmonics)
    outside = max(outside, 0.5 * float((np.abs(forces[:, lost])**2).sum()))
    # speeds outside the kept harmonics, and the largest mobility there
    mobility, tails = 0.0, np.zeros((len(rows), top + 1), complex)
    far = np.zeros(n)
    for k in lost:
        if k == 0:
            continue
        Y = 1j * k * nu * np.linalg.solve(core.stiffness(k), rows.T)
        contact_mobility = rows @ Y
        mobility = max(mobility, float(np.linalg.norm(contact_mobility, 2)))
        tails[:, k] = -contact_mobility @ forces[:, k]
        far += np.abs(Y @ forces[:, k]) / (k * nu)
    energy_far, energy_first = _energy(core, np.sqrt(mobility * outside), nu)
    hidden = sum((_unresolved(core, contact, force) for contact, force, width in
                  zip(contacts, forces, result.widths, strict=True) if width > 0.0), np.zeros(n))
    step = _step(core, balance, result, speeds, tails)
    if step is None:
        return energy_far + hidden, energy_first + hidden
    if spread is not None:
        step = spread(step)
    sizes = np.array([[abs(layout.phasor(step, k, dof)) for dof in range(n)] for k in layout.harmonics])
    first = sizes[layout.harmonics.index(layout.periods)] if layout.periods in layout.harmonics else np.zeros(n)
    hidden = hidden + 1e-14 * np.abs(result.x).max()
    mean = SAFETY * sizes[0] if layout.mean else 0.0
    return (np.minimum(SAFETY * (sizes.sum(axis=0) + far), energy_far + mean) + hidden,
            np.minimum(SAFETY * first, energy_first) + hidden)


def _unresolved(core: Core, contact: Contact, force) -> np.ndarray:
    """Return how far (n,) a contact that is held within the kept harmonics may slip in truth.

    The kept harmonics of its force are what rest asks for.  Where that exceeds a bound the contact slips: the speed is at most
    the impulse of the excess over the mass, and lasts half as long again as the excess (Den Hartog's short slip, alpha -> beta:
    3/2 of it); twice that is stated.
    """
    layout = core.layout
    asked = np.zeros(layout.top + 1, complex)
    asked[list(layout.harmonics)] = force[list(layout.harmonics)]
    count = 64 * grid_size(max(layout.top, len(contact.upper)))
    d, up, low = on_grid(asked, count), on_grid(contact.upper, count), on_grid(contact.lower, count)
    up, low = np.where(up < low, 0.0, up), np.where(up < low, 0.0, low)
    excess = np.maximum(d - up, 0.0) + np.maximum(low - d, 0.0)
    if not excess.any():
        return np.zeros(layout.n)
    step = 2.0 * np.pi / (float(core.numbers.omega[0]) * count)
    over = excess > 0.0
    starts = np.flatnonzero(over & ~np.roll(over, 1))
    if not len(starts):
        starts = np.zeros(1, int)
    moved = 0.0
    for part in np.split(np.roll(excess, -starts[0]), (starts[1:] - starts[0])):
        moved += 1.5 * float((part > 0.0).sum()) * step * float(part.sum()) * step
    return 2.0 * moved * np.abs(np.linalg.solve(core.numbers.M, contact.row))


def _energy(core: Core, product: float, nu: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the energy bounds (n,) on a distance (without that of the means) and on a first harmonic; infinite undamped."""
    n = core.layout.n
    none = np.full(n, np.inf)
    if core.parts.contacts or core.parts.laws:
        return none, none
    T = core.numbers
    damping = 0.5 * (T.C + T.C.T)
    if np.linalg.eigvalsh(damping)[0] <= 0.0:
        return none, none
    rms = product * np.sqrt(np.diag(np.linalg.inv(damping)))  # of each speed: |e_i|^2 <= (C^-1)_ii e^T C e
    period = nu * core.layout.periods
    return rms * np.pi / (np.sqrt(3.0) * nu), rms * np.sqrt(2.0) / period


def _step(core: Core, balance: Balance, result: SetValuedResult, speeds, tails) -> np.ndarray | None:
    """Return the Newton step (size,) that the speeds outside the kept harmonics cause; None where the Jacobian is singular."""
    layout = core.layout
    first, k = int(layout.mean), layout.positive
    packed = np.zeros((layout.slots, balance.layout.n))
    for contact, width, s, tail in zip(balance.contacts, result.widths, speeds, tails, strict=True):
        there = pattern(added(s, tail), contact.upper, contact.lower, width, layout.top, 0).force
        here = pattern(s, contact.upper, contact.lower, width, layout.top, 0).force
        d = there - here
        r = np.zeros(layout.slots)
        if first:
            r[0] = d[0].real
        r[first::2], r[first + 1::2] = d[k].real, -d[k].imag
        packed += np.multiply.outer(r, contact.row)
    change = packed.ravel()
    if (core.parts.contacts or core.parts.laws) and 2 * layout.size <= LARGEST:
        change = change + _law_change(core, result.x)
    _, jacobian = balance.both(result.x, result.widths)
    try:
        step = np.linalg.solve(jacobian, change)
    except np.linalg.LinAlgError:
        return None
    return step if np.isfinite(step).all() else None


def _law_change(core: Core, x) -> np.ndarray:
    """Return how the residual (size,) changes by what other forces excite outside the kept harmonics."""
    layout = core.layout
    more = longer(layout)
    wide = Core(core.system, more, core.samples and max(core.samples, 4 * more.top))
    moved = layout.moved(x, more)
    f = wide.residual(moved)
    if not np.isfinite(f).all():
        return np.zeros(layout.size)
    before = more.moved(f, layout)
    for k in more.harmonics:
        if k not in layout.harmonics and k:
            slot = more.slot(k) * layout.n
            phasor = np.linalg.solve(wide.stiffness(k), f[slot:slot + layout.n] - 1j * f[slot + layout.n:slot + 2 * layout.n])
            moved[slot:slot + layout.n], moved[slot + layout.n:slot + 2 * layout.n] = -phasor.real, phasor.imag
    after = wide.residual(moved)
    return more.moved(after, layout) - before if np.isfinite(after).all() else np.zeros(layout.size)


def _square(c, harmonics) -> float:
    """Return the mean square of a function by its phasors."""
    return float(sum((1.0 if k == 0 else 0.5) * abs(value)**2 for k, value in zip(harmonics, c, strict=True)))


def _mean_square(contact: Contact, s, width: float) -> float:
    """Return the mean square of a contact force, on a fine grid (it has jumps: to a per cent, from above by rounding up)."""
    count = 8 * grid_size(len(s))
    up, low, s = on_grid(contact.upper, count), on_grid(contact.lower, count), on_grid(s, count)
    if width > 0.0:
        r = np.minimum(np.maximum(s / width, low), np.maximum(up, low))
    else:
        r = np.where(s > 0.0, up, low)
    r = np.where(up < low, 0.0, r)
    return float((r * r).mean())
