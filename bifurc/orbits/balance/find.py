"""Harmonic balance: from a system, options and a guess to the orbit."""
import numpy as np
from scipy.linalg import qr

from ...checks import floats, refused
from ...compose.scene import refuse_delay
from ...flow.simulate import simulate
from ...hbm.balance import Balance
from ...hbm.condensation.condensed import Condensed
from ...hbm.layout import Layout
from ...hbm.status import BalanceStatus
from ...solve.broyden import broyden
from ...solve.newton import NewtonStatus, newton
from ...system import System
from ..base import Orbit
from ..standing import resting_start
from .harmonic_orbit import TOLERANCE, HarmonicOrbit, relative_residual
from .method import AUTO_FIRST, AUTO_MOST, HarmonicBalance
from .setvalued import set_valued

ALIASING = 1e-12  # relative change of the residual at twice the samples that is none
EPS = float(np.finfo(float).eps)
LOOSE = 1e-10  # of the largest entry of the Jacobian: forces of a mean displacement that are none
SETTLING = 64  # periods of a motion from rest, behind which it is looked at: it need not have settled, but to touch what carries it
SCALED = (0.7, 0.5, 0.3, 1.5, 2.0, 0.1, 0.05)  # of the linear response: starts where its own, rest and raised loads lead nowhere


def balanced(system: System, method: HarmonicBalance, guess=None, periods: int | None = None) -> HarmonicOrbit:
    """Return a harmonic orbit of a forced system; the part of `find_orbit` for ``method=HarmonicBalance(...)``.

    Parameters
    ----------
    system : System
    method : HarmonicBalance
    guess : HarmonicOrbit, PeriodicOrbit, array, or None
        An orbit, of other parameters, harmonics or method; a state (2 n,) or (ns,) from which the motion is simulated and
        analysed; packed coefficients (layout.size,); None: the linear response, then the motion at rest, then loads raised
        step by step, then the motion from rest.
    periods : int, optional
        Forcing periods of the motion; default that of a guessed orbit, or 1.

    Raises
    ------
    ValueError
        Autonomous system, elements that harmonic balance cannot treat, an excitation on a harmonic that is not listed.
    """
    if not isinstance(method, HarmonicBalance):
        raise ValueError(f"method = {method!r} is not allowed; it must be a HarmonicBalance, or None for event-exact shooting")
    if system.period is None:
        raise ValueError(f"{system!r} is autonomous; harmonic balance needs an excitation frequency omega")
    if system.n == 0:
        raise ValueError(f"{system!r} is of first order, which harmonic balance does not take; method = None gives its orbit")
    refuse_delay(system)
    count = int(periods or (guess.periods if isinstance(guess, Orbit) else 1))
    if method.harmonics == "auto":
        return _grown(system, method, guess, count)
    return _with_error(_solved(system, method, guess, method.layout(system.n, count)))


def _with_error(orbit: HarmonicOrbit) -> HarmonicOrbit:
    """Add the estimated error to an orbit that converged."""
    if orbit.success and "error" not in orbit.how and not orbit.balance.parts.held:
        error = orbit.error()
        orbit.how["error"] = None if error is None else [float(value) for value in error]
    return orbit


def _grown(system: System, method: HarmonicBalance, guess, periods: int) -> HarmonicOrbit:
    """Return an orbit with harmonics added until its estimated error is below the tolerance."""
    top, tried = AUTO_FIRST, []
    while True:
        orbit = _with_error(_solved(system, method, guess, method.layout(system.n, periods, top)))
        tried.append(top)
        if not orbit.success:
            break
        error, guess = orbit.how["error"], orbit
        amplitude = max(np.abs(orbit.layout.matrix(orbit._x)).max(axis=0).max(), 1e-300)
        if error is None or max(error) <= method.tolerance * amplitude or 2 * top > AUTO_MOST:
            break
        top = 2 * top + 1
    orbit.how["harmonics tried"] = tried
    return orbit


def _solved(system: System, method: HarmonicBalance, guess, layout: Layout) -> HarmonicOrbit:
    """Return the orbit for given harmonics, by the solver of the method."""
    balance = method.balance(system, layout)
    starts = _starts(balance, guess)
    if balance.parts.held or method.solver == "galerkin-broyden":
        return _set_valued(balance, method, starts, guess is not None)
    how = {"method": f"harmonic balance, {method.solver}", "harmonics": [k / layout.periods for k in layout.harmonics],
           "aft": method.aft, "tolerance": TOLERANCE}
    if balance.samples:
        how["samples"] = balance.samples
    condensed = method.condensed(balance)
    x, iterations, status = _iterated(condensed or balance, method, starts, guess is None)
    if status is not None and guess is None and (start := _settling(balance)) is not None:
        found, more, failed = _iterated(condensed or balance, method, [start], False)
        iterations += more
        if failed is None and not _loose(balance, [found]):
            x, status = found, None
    while balance.parts.laws and method.samples is None and status is None:
        finer = Balance(system, layout, balance.samples, 2 * balance.law_samples, balance.parts)
        closer = None if condensed is None else method.condensed(finer, like=condensed)
        change = float(np.abs(_reaction(closer or finer, x) - _reaction(condensed or balance, x)).max())
        if change <= ALIASING * max(float(np.abs(balance.numbers.E).max()), 1e-300) or finer.law_samples > 1 << 14:
            break
        balance, condensed = finer, closer
        x, more, status = _iterated(condensed or balance, method, [x], False)
        iterations += more
    if condensed is not None:
        how["condensed"] = condensing(condensed)
    if balance.parts.laws:
        how["law samples"] = balance.law_samples
        differenced = [law.name for law in balance.parts.laws if law.law.jacobian is None]
        if differenced:
            how["differenced Jacobians"] = differenced
    how["iterations"] = iterations
    if status is not None or _drifts(balance, x):
        loose = _loose(balance, [x] if status is BalanceStatus.SINGULAR else [x, *starts])
        if loose:
            status, how["free"] = BalanceStatus.SINGULAR, loose
    return HarmonicOrbit(system, method, layout, x, how, status, balance, condensed)


def _drifts(balance: Balance, x) -> bool:
    """Whether the mean of a motion is so much larger than its swing that half the digits are lost: what nothing restores is carried
    away by a solver."""
    q = np.abs(balance.layout.matrix(x))
    return bool(balance.layout.mean and q[0].max() * EPS**0.5 > q[1:].max(initial=0.0))


def _loose(balance: Balance, motions) -> str:
    """Return which coordinate or combination has no restoring force about all ``motions``, coefficients (size,); empty if none.

    A mean displacement along it changes no force, so that the balance does not tell where the motion stands.
    """
    n = balance.layout.n
    known = [balance.jacobian(x) for x in motions if balance.layout.mean and np.isfinite(x).all()]
    known = [J[:, :n] / max(float(np.abs(J).max()), 1e-300) for J in known if np.isfinite(J).all()]
    if not known:
        return ""
    _, sizes, rows = np.linalg.svd(np.vstack(known))
    null = rows[int(np.count_nonzero(sizes > LOOSE)):]
    if not len(null):
        return ""
    null = qr(null.T @ null, pivoting=True)[0][:, :len(null)].T  # coordinates that are free alone come alone
    named = []
    for row in null:
        row = row / row[int(np.argmax(np.abs(row) > 0.5 * np.abs(row).max()))]
        parts = [(value, k) for k, value in enumerate(row) if abs(value) > LOOSE * np.abs(row).max()]
        words = [f"{'-' if value < 0.0 else '+'} {'' if abs(abs(value) - 1.0) < LOOSE else f'{abs(value):.4g} '}q{k}"
                 for value, k in parts]
        named.append(" ".join(words).removeprefix("+ "))
    return ", ".join(named)


def condensing(condensed: Condensed) -> str:
    """Return in words what was solved instead of the whole balance."""
    return (f"{condensed.whole.size} unknowns to {condensed.layout.size}, those of the {condensed.layout.n} of {condensed.whole.n} "
            f"coordinates that contacts and laws touch; receptance {condensed.linear.way}")


def _settling(balance: Balance) -> np.ndarray | None:
    """Return the packed motion from rest after some periods, None where there is none: it has found the contacts that carry a mean
    load, which no motion without them shows."""
    layout, period = balance.layout, balance.system.period
    assert period is not None  # `balanced` refuses autonomous systems
    count, whole = max(256, 8 * layout.top), SETTLING * layout.periods
    motion = simulate(balance.system, resting_start(balance.system), periods=whole)
    if not motion.success:
        return None
    t = (whole - layout.periods + np.arange(count) * (layout.periods / count)) * period
    return layout.analysis(motion(t)[:, :layout.n])


def _reaction(equations: Balance | Condensed, x) -> np.ndarray:
    """Return what changes with the samples of laws: the forces (size,), for a whole balance with what does not change."""
    return equations.reaction(x) if isinstance(equations, Condensed) else equations.residual(x)


def _starts(balance: Balance, guess) -> list[np.ndarray]:
    """Return packed guesses, in the order in which they are tried."""
    layout = balance.layout
    if guess is None:
        return [balance.linear_response(), np.zeros(layout.size)]
    if isinstance(guess, HarmonicOrbit):
        return [guess.layout.moved(guess.coefficients, layout)]
    count = max(256, 8 * layout.top)
    if isinstance(guess, Orbit):
        t, y = guess.sample(layout.periods // guess.periods * count + 1 if layout.periods % guess.periods == 0 else count + 1)
        samples = np.tile(y[:-1, :layout.n], (max(layout.periods // guess.periods, 1), 1))
        return [layout.analysis(samples)]
    found = floats(guess)
    if found is None or not np.isfinite(found).all():
        raise refused("find_orbit", "guess", guess, "an orbit, packed coefficients or a state, of finite numbers")
    guess = found
    if guess.shape == (layout.size,):
        return [guess]
    n, memory = layout.n, sum(len(element.memory) for element in balance.system.elements)
    if guess.shape in ((2 * n,), (2 * n + memory,)):
        motion = simulate(balance.system, guess, periods=layout.periods)
        period = balance.system.period
        assert period is not None
        return [layout.analysis(motion(np.arange(count) * (layout.periods * period / count))[:, :n])]
    raise ValueError(f"guess has shape {guess.shape}; it must be an orbit, packed coefficients ({layout.size},), or a state "
                     f"({2 * n + memory},)")


def _iterated(equations: Balance | Condensed, method: HarmonicBalance, starts, anywhere: bool):
    """Return coefficients of all coordinates, iterations and None, or the status of the failure."""
    if isinstance(equations, Condensed):
        starts = [equations.restricted(start) for start in starts]
    total, best = 0, starts[0]
    status: BalanceStatus | None = BalanceStatus.NOT_CONVERGED
    for start in starts:
        best, count, failed = _solve(equations, method, start)
        total += count
        if failed is None:
            status = None
            break
        status = failed
    if anywhere and status is not None:
        x, count, failed = _raised(equations, method)
        total += count
        if failed is None:
            best, status = x, None
        for part in SCALED if status is not None else ():  # from where a load cannot be raised: a fold, a corner that turns back
            x, count, failed = _solve(equations, method, part * equations.linear_response())
            total += count
            if failed is None:
                best, status = x, None
                break
    return equations.expand(best) if isinstance(equations, Condensed) else best, total, status


def _solve(equations: Balance | Condensed, method: HarmonicBalance, start):
    """Return unknowns, iterations, and None or the status of the failure, of one run of the solver."""
    scale = max(float(np.abs(start).max()), float(np.abs(equations.linear_response()).max()), 1e-300)
    if method.solver == "broyden":
        found = broyden(equations.residual, start, jacobian=equations.jacobian, scale=scale)
        return found.x, found.iterations, None if found.success else BalanceStatus.NOT_CONVERGED
    result = newton(equations.residual, equations.jacobian, start, scale)
    if result.success or relative_residual(equations, _whole(equations, result.x)) <= TOLERANCE:
        return result.x, result.iterations, None
    failed = {NewtonStatus.SINGULAR: BalanceStatus.SINGULAR, NewtonStatus.NOT_FINITE: BalanceStatus.CONTACTS_FAILED}
    return result.x, result.iterations, failed.get(result.status, BalanceStatus.NOT_CONVERGED)


def _whole(equations: Balance | Condensed, x) -> np.ndarray:
    """Return the coefficients of all coordinates."""
    return equations.expand(x) if isinstance(equations, Condensed) else x


def _raised(equations: Balance | Condensed, method: HarmonicBalance):
    """Raise the load from a tenth to its value in steps that halve where Newton fails; returns as `_solve`."""
    done, step, total = 0.0, 0.1, 0
    x = np.zeros(equations.size)
    status = BalanceStatus.NOT_CONVERGED
    full = np.zeros(0) if isinstance(equations, Condensed) else equations.numbers.E.copy()

    def load(part: float):
        if isinstance(equations, Condensed):
            equations.load = part
        else:
            equations.numbers.E[:] = part * full

    try:
        while done < 1.0 and step > 1e-3:
            part = min(done + step, 1.0)
            load(part)
            new, count, failed = _solve(equations, method, x if not done else x * part / done)
            total += count
            if failed is None:
                x, done, step = new, part, 1.5 * step
            else:
                step, status = 0.5 * step, failed
    finally:
        load(1.0)
    return x, total, None if done >= 1.0 else status


def _set_valued(balance: Balance, method: HarmonicBalance, starts, guessed: bool) -> HarmonicOrbit:
    """Return the orbit of a system with set-valued friction, or by Li's published method."""
    x, how, status = set_valued(balance, method, starts, guessed)
    return HarmonicOrbit(balance.system, method, balance.layout, x, how, status, balance)
