"""A rotor between four elastic arcs, two of which can be touched at once: orbits against motions of scipy's DOP853."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf
from bifurc.compose.scene import scene_of

DIRECTIONS = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


def between_arcs(y0, duration, *, zeta, nu, eccentricity, stiffness, friction, disk_radius, preload, contact_damping=0.0,
                 gravity=0.0):
    """Return the state (4,) after a time from phase 0, the number of events, and the largest number of arcs touched at once.

    A contact begins at zero depth and ends at zero force; one that is let go within the wall stays away until it is outside.
    """
    centres = -preload * DIRECTIONS
    tight = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 0.05}

    def parts(y, k):
        p = y[:2] - centres[k]
        r = np.hypot(*p)
        n = p / r
        tangent = np.array([-n[1], n[0]])
        return r - 1.0 - preload, n, tangent, n @ y[2:], tangent @ y[2:] + disk_radius * nu

    def load(y, k):
        depth, _, _, speed, _ = parts(y, k)
        return stiffness * depth + contact_damping * speed

    def field(t, y, touching):
        f = eccentricity * nu**2 * np.array([np.cos(nu * t), np.sin(nu * t)]) - 2.0 * zeta * y[2:] - y[:2] - [0.0, gravity]
        for k in np.flatnonzero(touching):
            _, n, tangent, _, sliding = parts(y, k)
            f = f - load(y, k) * (n + friction * np.sign(sliding) * tangent)
        return np.concatenate([y[2:], f])

    t, y = 0.0, np.array(y0, float)
    touching, count, most = np.array([parts(y, k)[0] > 0.0 and load(y, k) > 0.0 for k in range(4)]), 0, 0
    while True:
        events = []
        for k in range(4):
            def event(t, y, on, k=k):
                return load(y, k) if on[k] else parts(y, k)[0]
            event.terminal, event.direction = True, -1 if touching[k] else 1
            events.append(event)
        most = max(most, int(touching.sum()))
        part = solve_ivp(field, (t, duration), y, args=(touching,), events=events, **tight)
        t, y = part.t[-1], part.y[:, -1]
        if part.status == 0:
            return y, count, most
        fired = np.array([len(found) > 0 for found in part.t_events])
        touching, count = touching ^ fired, count + int(fired.sum())


@pytest.mark.parametrize(("changes", "events", "most"), [
    ({"nu": 1.2}, 8, 1), ({"gravity": 0.3}, 6, 2), ({"preload": 0.1, "nu": 1.1}, 8, 2), ({"preload": 0.05}, 8, 2),
    pytest.param({"preload": 0.05, "nu": 1.5}, 8, 3, marks=pytest.mark.slow),
    ({"preload": 0.2, "nu": 1.1, "contact_damping": 0.5}, None, 2)])
def test_orbits_between_four_arcs(changes, events, most):
    system = bf.systems.snubber_rotor(**changes)
    orbit = bf.find_orbit(system)
    end, count, together = between_arcs(orbit.state, orbit.period, **system.parameters)
    assert orbit.success and orbit.stable and orbit.sequence.events == (events or orbit.sequence.events)
    assert np.abs(end - orbit.state).max() < 1e-10 and together == most
    assert changes.get("contact_damping") or count == orbit.sequence.events
    if changes not in ({"gravity": 0.3}, {"preload": 0.05, "nu": 1.5}):
        return
    h, M = 1e-5, np.empty((4, 4))
    for k, e in enumerate(np.eye(4)):
        ends = [between_arcs(orbit.state + sign * h * e, orbit.period, **system.parameters)[0] for sign in (1, -1)]
        M[:, k] = (ends[0] - ends[1]) / (2.0 * h)
    assert np.abs(np.sort_complex(np.linalg.eigvals(M)) - np.sort_complex(orbit.multipliers)).max() < 1e-6


def test_five_turns_between_four_arcs():
    system = bf.systems.snubber_rotor()
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.stable and orbit.periods == 5
    assert np.abs(between_arcs(orbit.state, orbit.period, **system.parameters)[0] - orbit.state).max() < 1e-9


def test_the_laws_of_four_arcs_are_compiled_once():
    # 625 combinations of contacts: those met later are numbers
    scene = scene_of(bf.systems.snubber_rotor())
    laws, mode = scene.laws, next(scene.start_modes())
    for label, key in (("arc_up", "slip+"), ("arc_right", "roll"), ("arc_left", "separating")):
        mode = scene.combine(mode, scene.system.labels.index(label), key)
    assert scene.laws is laws and 1 < len(scene.keys) < 10
