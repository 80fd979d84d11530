"""Pieces of chatterings and of modal steps, against what they are: differential equations by scipy, products."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bifurc.flow import chatter
from bifurc.flow.modal import steps


def flown(r, first, second, t, eps):
    """Return duration, arriving speed and depth of a flight: accelerations vary with time and both speeds, by eps."""
    a, rate, by_speed, by_slip, loss, loss_rate, loss_by_speed, loss_by_slip, slip = first
    push, rise, by = second

    def rates(tau, z, part):
        y, w, u = z
        if part:
            return w, push + eps * (rise * (t + tau) + by * w), 0.0
        return (w, a + eps * (rate * (t + tau) + by_speed * w + by_slip * u),
                -(loss + eps * (loss_rate * (t + tau) + loss_by_speed * w + loss_by_slip * u)))

    def stops(tau, z, part):
        return z[2]

    def arrives(tau, z, part):
        return z[0]

    def turns(tau, z, part):
        return z[1]
    stops.terminal = arrives.terminal = True
    stops.direction, arrives.direction, turns.direction = -1.0, 1.0, 1.0
    at, z, lowest = 0.0, np.array([0.0, -r, slip]), 0.0
    for part in (0, 1) if slip > 0.0 else (1,):
        events = (stops, arrives)[part], turns
        run = solve_ivp(rates, (at, 50.0), z, "DOP853", args=(part,), rtol=1e-12, atol=1e-14, events=events)
        at, z = run.t[-1], run.y[:, -1]
        lowest = min([lowest, *(y[0] for y in run.y_events[1])])
    return np.array([at, z[1], -lowest])


@pytest.mark.parametrize("slides", [True, False])
def test_a_flight_to_second_order_is_the_equation_of_motion(slides, rng):
    """Duration and speed without, and by differences with, what changes the accelerations along a flight; and how far it goes."""
    for _ in range(6):
        r, t = rng.uniform(0.3, 0.9), rng.uniform(-1.0, 2.0)
        first, second = rng.uniform(-1.0, 1.0, 9), rng.uniform(-1.0, 1.0, 3)
        first[0], first[4], first[8] = rng.uniform(0.5, 1.5), rng.uniform(1.0, 2.0), rng.uniform(0.05, 0.2) * slides
        second[0] = rng.uniform(0.5, 1.5)
        found = np.zeros(2)
        plain = chatter.flight(r, first, second, t, found)
        exact = flown(r, first, second, t, 0.0)
        assert plain == pytest.approx(exact[:2], abs=1e-9)
        assert chatter.height(r, first, second[0]) == pytest.approx(exact[2], abs=1e-9)
        e = 1e-4
        change = (flown(r, first, second, t, e) - flown(r, first, second, t, -e))[:2] / (2.0 * e)
        assert found[[chatter.LATER, chatter.FASTER]] == pytest.approx(change, abs=2e-6)


@pytest.mark.parametrize("n", range(1, 10))
def test_products_of_any_size(n, rng):
    """Rows are summed four at a time, and one by one what is left."""
    matrices, x = rng.normal(size=(2, n, n)), rng.normal(size=n)
    out = np.full(n, np.nan)
    steps.product(matrices, 1, x, out)
    assert out == pytest.approx(matrices[1] @ x, abs=1e-13)
