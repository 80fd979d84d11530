"""A mass point in a rigid ring, event by event: free in the plane, sliding or rolling on the wall by its angle (Zhang 2008, 4.3).

Nothing of the package is used: DOP853 with events, the impact law written out, and complete chattering followed impact by impact
down to the speed `STILL`.  Friction of what is left of it is that of a plastic impact and of sliding from there on, to first order.
"""
import numpy as np
from scipy.integrate import solve_ivp

STILL = 1e-5  # speed of an impact that the mass does not rebound from where it is pressed against the wall
TOUCH = 1e-11
MOST = 400  # impacts
INWARD = 1e-15  # of the radius: where a flight begins, so that it does not end there


def motion(start, duration, *, damping=0.1, stiffness=1.0, load=0.0, nu=1.0, restitution=0.5, friction=0.1, surface_speed=0.0,
           radius=1.0, centre=(0.0, 0.0), on_wall=False):
    """Return the state (4,) after ``duration`` from ``start`` = (x, y, x', y'), the mode at the end, and the number of impacts."""
    centre, t, impacts = np.array(centre), 0.0, 0
    accuracy = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14, "max_step": 0.05}  # no double zero of an event is in a step

    def force(t, p, v):
        return load * np.array([np.cos(nu * t), np.sin(nu * t)]) - damping * v - stiffness * p

    def frame(p):
        n = (p - centre) / np.hypot(*(p - centre))
        return n, np.array([-n[1], n[0]])

    def along(t, angle, rate):  # tangential force, load of the wall
        n, s = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        f = force(t, centre + radius * n, radius * rate * s)
        return f @ s, f @ n + radius * rate**2

    def resting(t, angle, rate):
        """Mode of a point that touches the wall without radial speed."""
        pull, press = along(t, angle, rate)
        if press <= 0.0:
            return "free", 0.0
        slip = radius * rate + surface_speed
        if abs(slip) <= TOUCH * max(1.0, abs(surface_speed)):
            return ("roll", 0.0) if abs(pull) <= friction * press else ("slide", float(np.sign(pull)))
        return "slide", float(np.sign(slip))

    p, v = np.array(start[:2], float), np.array(start[2:], float)
    mode, way, angle, rate = "free", 0.0, 0.0, 0.0
    if on_wall:
        n, s = frame(p)
        angle, rate = float(np.arctan2(n[1], n[0])), float(v @ s) / radius
        mode, way = resting(t, angle, rate)
    while t < duration:
        if impacts > MOST:
            raise RuntimeError("too many impacts to compare with")
        if mode == "free":
            def gap(t, y):
                return np.hypot(*(y[:2] - centre)) - radius
            gap.terminal, gap.direction = True, 1.0
            y = np.concatenate([p, v])
            found = solve_ivp(lambda t, y: np.concatenate([y[2:], force(t, y[:2], y[2:])]), (t, duration), y, events=gap,
                              **accuracy)
            t, (p, v) = found.t[-1], (found.y[:2, -1], found.y[2:, -1])
            if found.status != 1:
                continue
            n, s = frame(p)
            u, w = float(v @ n), float(v @ s)
            impacts += 1
            slip = w + surface_speed
            last = u < STILL and restitution < 1.0 and along(t, float(np.arctan2(n[1], n[0])), w / radius)[1] > 0.0
            back = 0.0 if last else restitution
            stop = min(friction * (1.0 + back) * u, abs(slip))
            u, w = -back * u, w - np.sign(slip) * stop
            if abs(slip) == stop:
                w = -surface_speed
            angle, rate, p = float(np.arctan2(n[1], n[0])), w / radius, centre + radius * n
            v = u * n + w * s
            if u == 0.0:
                mode, way = resting(t, angle, rate)
            p = p - INWARD * radius * n
        else:
            def leaves(t, y):
                return along(t, *y)[1]

            def sticks(t, y, way=way):
                return way * (radius * y[1] + surface_speed)

            def slips(t, y):
                pull, press = along(t, *y)
                return friction * press - abs(pull)
            for event in (leaves, sticks, slips):
                event.terminal, event.direction = True, -1.0
            rolls = mode == "roll"

            def field(t, y, way=way, rolls=rolls):
                pull, press = along(t, *y)
                return [y[1], 0.0 if rolls else (pull - way * friction * press) / radius]
            watched = (leaves, slips) if rolls else (leaves, sticks)
            found = solve_ivp(field, (t, duration), (angle, rate), events=watched, **accuracy)
            t, (angle, rate) = found.t[-1], found.y[:, -1]
            n, s = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
            p, v = centre + radius * n, radius * rate * s
            if found.status != 1:
                continue
            if len(found.t_events[0]):
                mode, p = "free", p - INWARD * radius * n
            elif rolls:
                mode, way = "slide", float(np.sign(along(t, angle, rate)[0]))
            else:
                rate = -surface_speed / radius
                mode, way = resting(t, angle, rate)
    return np.concatenate([p, v]), mode if mode != "slide" else f"slip{'+' if way > 0.0 else '-'}", impacts
