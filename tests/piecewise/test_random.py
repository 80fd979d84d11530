"""Random systems of first order beside an independent integrator: DOP853 from event to event, slides by Filippov's field."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf

STOP, CLOSE = 8.0, 1e-7


def drawn(seed):
    """Return a system and its numbers: a relay, dry friction under a load that varies, a kink, or hysteresis; driven or not."""
    rng = np.random.default_rng([seed, 45])
    n = int(rng.integers(1, 5))
    A = rng.normal(size=(n, n)) - (0.6 + rng.random()) * np.eye(n)
    b, load, h = 0.6 * rng.normal(size=n), rng.normal(size=n) * (rng.random() < 0.7), rng.normal(size=n)
    offset, omega = 0.4 * rng.normal(), float(rng.uniform(0.5, 3.0))
    kind = rng.choice(["relay", "friction", "kink", "hysteresis"])
    jump = rng.normal(size=n) * (2.0 if kind == "relay" else 0.0)
    kink = rng.normal(size=n) * (kind == "kink")
    if kind == "hysteresis":
        jump = -h * rng.uniform(0.5, 2.0)
    above = A + np.outer(kink, h), b + kink * offset + jump
    if kind == "friction":
        way = 2.0 * rng.normal(size=n)
        above = A + np.outer(way, rng.normal(size=n)), b + way * rng.normal()
    band = (-0.3, 0.2) if kind == "hysteresis" else None
    cos = {1: load} if load.any() else None
    fields = {"-": bf.AffineField(A, b, cos=cos), "+": bf.AffineField(*above, cos=cos)}
    system = bf.PiecewiseSystem([f"x{i}" for i in range(n)], fields,
                                [bf.Switch(bf.AffineSurface(h, offset), hysteresis=band)], omega=omega if cos else None)
    return system, (A, b), above, load, omega, h, offset, band, rng.normal(size=n)


def followed(below, above, load, omega, h, offset, band, x):
    """Return the state at `STOP` and how often it switches, or None where the motion escapes or grazes."""
    low, high = band or (0.0, 0.0)

    def field(side):
        (A, b), (C, d) = below, above

        def one(t, y):
            return A @ y + b + load * np.cos(omega * t)

        def two(t, y):
            return C @ y + d + load * np.cos(omega * t)

        def slide(t, y):
            l1, l2 = h @ one(t, y), h @ two(t, y)
            return (l1 * two(t, y) - l2 * one(t, y)) / (l1 - l2)
        return {"-": one, "+": two, "0": slide}[side]

    def ends(side):
        if side == "0":
            def first(t, y):
                return h @ field("-")(t, y)

            def second(t, y):
                return -(h @ field("+")(t, y))
            return [first, second]
        return [lambda t, y: h @ y + offset - high] if side == "-" else [lambda t, y: -(h @ y + offset) + low]

    t, count, value = 0.0, 0, h @ x + offset
    side = "-" if value < high else "+"
    while t < STOP:
        events = ends(side)
        for event in events:
            event.terminal, event.direction = True, -1 if side == "0" else 1
        # the event just taken is left behind by a short step without events
        skip = min(1e-7, STOP - t)
        begun = solve_ivp(field(side), (t, t + skip), x, rtol=1e-12, atol=1e-14, method="DOP853")
        done = solve_ivp(field(side), (t + skip, STOP), begun.y[:, -1], rtol=1e-12, atol=1e-14, method="DOP853", max_step=0.01,
                         events=events) if t + skip < STOP else begun
        t, x = done.t[-1], done.y[:, -1]
        if done.status != 1:
            break
        count += 1
        if band:
            side = "+" if side == "-" else "-"
            continue
        l1, l2 = h @ field("-")(t, x), h @ field("+")(t, x)
        if side == "0":
            side = "-" if len(done.t_events[0]) else "+"
        elif l1 > 0.0 > l2:
            side = "0"
        elif min(l1, l2) > 0.0 or max(l1, l2) < 0.0:
            side = "+" if l1 > 0.0 else "-"
        else:
            return None
        if min(abs(l1), abs(l2)) < 1e-5 and side != "0" and min(abs(l1), abs(l2)) > 1e-9:
            return None
    return x, count


def compared(seed):
    """Return what is wrong with a random system, or an empty string."""
    system, below, above, load, omega, h, offset, band, x = drawn(seed)
    found = followed(below, above, load, omega, h, offset, band, x)
    if found is None:
        return "open"
    motion = bf.simulate(system, x, duration=STOP)
    size = max(np.abs(motion.y).max(), 1.0)
    if not motion.success:
        return f"{motion.status}: {motion.message}"
    if np.abs(motion.final - found[0]).max() > CLOSE * size:
        return f"{motion.final} for {found[0]}, {len(motion.events)} events for {found[1]}"
    return ""


@pytest.mark.parametrize("seed", range(12))
def test_motions_agree(seed):
    assert compared(seed) in ("", "open")


@pytest.mark.slow
def test_two_hundred_motions_agree():
    verdicts = [compared(seed) for seed in range(100, 300)]
    assert [(100 + k, why) for k, why in enumerate(verdicts) if why not in ("", "open")] == []
    assert verdicts.count("open") < 20
