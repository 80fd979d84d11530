"""Time stepping after Moreau (1988) and Jean (1999): what follows an event, without events; first order in the step.

Momentum is balanced over a step, with the impulses of rigid stops and dry friction as unknowns that obey Newton's restitution and
Coulomb's law at its end; Gauss-Seidel finds them. Places are taken at the middle. Elastic stops, sliders and cubic springs are
forces there; a slider follows where its spring would carry more than the limit.

Where a mass that rests on a stop is pushed into it by the impact of another, all impulses act at once here.
"""
import numpy as np
from numba import njit

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, ElasticStop, HarmonicForce, Iwan, Jenkins, RigidStator, RigidStop

ROUNDING = 1e-12  # speeds that are zero
SWEEPS, CONVERGED = 200, 1e-15  # of Gauss-Seidel


def numbers_of(system):
    """Return arrays of numbers and rows of loads, springs, elastic stops, sliders, rigid stops, frictions; None for others."""
    n = len(system.mass)
    kinds, rows = ([[] for _ in range(6)] for _ in range(2))
    for element in system.elements:
        wall = (element.gap, element.side, element.amplitude, element.harmonic, element.phase) if hasattr(element, "gap") else ()
        load = ((element.load_amplitude or 0.0, element.load_harmonic, element.load_phase)
                if isinstance(element, Coulomb | Jenkins) else ())
        match element:
            case HarmonicForce():
                kind, own = 0, [(element.amplitude, element.harmonic, element.phase)]
            case ConstantForce():
                kind, own = 0, [(element.force, 0.0, 0.0)]
            case CubicSpring():
                kind, own = 1, [(element.beta,)]
            case ElasticStop(release="penetration"):
                kind, own = 2, [(*wall, element.stiffness, element.damping)]
            case Jenkins():
                kind, own = 3, [(*load, element.stiffness, element.limit)]
            case Iwan():
                kind, own = 3, [(0.0, 1.0, 0.0, k, limit) for k, limit in zip(element.stiffnesses, element.limits, strict=True)]
            case RigidStop():
                kind, own = 4, [(*wall, element.restitution)]
            case Coulomb(friction_negative=None):
                kind, own = 5, [(*load, element.friction, element.static_ratio, element.belt_speed)]
            case _:
                return None
        kinds[kind] += own
        rows[kind] += [np.eye(n)[element.dof] if element.row is None else element.row] * len(own)
    widths = (3, 1, 7, 5, 6, 6)
    return tuple((np.array(own, float).reshape(-1, many), np.array(on, float).reshape(-1, n))
                 for own, on, many in zip(kinds, rows, widths, strict=True))


def stepped(system, y, periods, steps):
    """Return the state after so many periods of so many steps, from ``y`` (ns,) at t = 0: places, speeds, places of sliders."""
    n, omega = len(system.mass), float(system.parameter("omega"))
    q, v, w = (np.array(part, float) for part in (y[:n], y[n:2 * n], y[2 * n:]))
    matrices = tuple(np.array(X, float) for X in (system.mass, system.damping, system.stiffness))
    _run(matrices, omega, numbers_of(system), q, v, w, 2.0 * np.pi / omega / steps, periods * steps)
    return np.concatenate([q, v, w])


@njit(cache=True)
def _run(matrices, omega, numbers, q, v, w, h, count):
    """Take the state over ``count`` steps, in place."""
    M, C, K = matrices
    (loads, on_load), (cubics, on_cubic), (soft, on_soft), (sliders, on_slider), (walls, on_wall), (dry, on_dry) = numbers
    first, many = len(walls), len(walls) + len(dry)
    rows = np.zeros((many, len(q)))
    for i in range(first):
        rows[i] = walls[i, 1] * on_wall[i]
    rows[first:] = on_dry
    mobility = np.linalg.inv(M + 0.5 * h * C + 0.25 * h * h * K)
    delassus = rows @ mobility @ rows.T
    impulse, most, wanted, acts = np.zeros(many), np.zeros(many), np.zeros(many), np.ones(many, np.bool_)
    way, tried = np.sign(on_dry @ v - dry[:, 5]), np.zeros(len(dry), np.bool_)  # 0: it sticks
    for step in range(count):
        t = (step + 0.5) * h
        middle = q + 0.5 * h * v
        force = -C @ v - K @ middle
        for i in range(len(loads)):
            force += loads[i, 0] * np.cos(loads[i, 1] * omega * t + loads[i, 2]) * on_load[i]
        for i in range(len(cubics)):
            force -= cubics[i, 0] * (on_cubic[i] @ middle) ** 3 * on_cubic[i]
        for i in range(len(soft)):
            gap, side, amplitude, harmonic, phase, stiffness, damping = soft[i]
            turn = harmonic * omega * t + phase
            depth = side * (on_soft[i] @ middle - amplitude * np.cos(turn)) - gap
            if depth > 0.0:
                rate = side * (on_soft[i] @ v + amplitude * harmonic * omega * np.sin(turn))
                force -= side * (stiffness * depth + damping * rate) * on_soft[i]
        for i in range(len(sliders)):
            amplitude, harmonic, phase, stiffness, limit = sliders[i]
            limit *= max(0.0, 1.0 + amplitude * np.cos(harmonic * omega * t + phase))
            u = on_slider[i] @ middle
            carried = min(max(stiffness * (u - w[i]), -limit), limit)
            w[i] = u - carried / stiffness
            force -= carried * on_slider[i]
        free = v + h * (mobility @ force)
        for i in range(first):
            gap, side, amplitude, harmonic, phase, restitution = walls[i]
            turn = harmonic * omega * t + phase
            acts[i] = rows[i] @ middle - side * amplitude * np.cos(turn) >= gap
            speed = -side * amplitude * harmonic * omega * np.sin(turn)
            wanted[i] = rows[i] @ free - speed + restitution * (rows[i] @ v - speed)
        for i in range(len(dry)):
            wanted[first + i], tried[i] = on_dry[i] @ free - dry[i, 5], False
        for i in range(many):
            impulse[i] = impulse[i] if acts[i] else 0.0
        for _ in range(2 * len(dry) + 1):  # static friction above kinetic: who sticks is tried
            for i in range(len(dry)):
                amplitude, harmonic, phase, friction, static, _belt = dry[i]
                load = max(0.0, 1.0 + amplitude * np.cos(harmonic * omega * t + phase))
                most[first + i] = h * friction * load * (static if way[i] == 0.0 else 1.0)
            _impulses(delassus, wanted, acts, first, most, impulse)
            settled = True
            for i in range(len(dry)):
                slip = wanted[first + i] + delassus[first + i] @ impulse
                slip = 0.0 if abs(slip) < ROUNDING else slip
                changed = (slip != 0.0) if way[i] == 0.0 else (slip * way[i] < 0.0)
                if changed:
                    settled = settled and (dry[i, 4] == 1.0 or (way[i] != 0.0 and tried[i]))
                    way[i] = 0.0 if way[i] != 0.0 and not tried[i] else np.sign(slip)
                    tried[i] = True
                elif slip == 0.0:
                    way[i] = 0.0
            if settled:
                break
        v[:] = free + mobility @ (rows.T @ impulse)
        q[:] = middle + 0.5 * h * v


@njit(cache=True)
def _impulses(delassus, wanted, acts, first, most, impulse):
    """Find the impulses with which stops, the first, only push back, and frictions stay below ``most``, from those given."""
    for _ in range(SWEEPS):
        largest = 0.0
        for i in range(len(impulse)):
            if acts[i]:
                new = impulse[i] - (wanted[i] + delassus[i] @ impulse) / delassus[i, i]
                new = min(0.0, new) if i < first else min(max(new, -most[i]), most[i])
                largest = max(largest, abs(new - impulse[i]))
                impulse[i] = new
        if largest < CONVERGED:
            return


def rubbed(system, stator, y, periods, steps):
    """Return the state of a point of mass 1 in a plane, in a stator without spin of its frame: its other elements are loads."""
    omega = float(system.parameter("omega"))
    loads, on_load = numbers_of(bf.System(system.mass, system.damping, system.stiffness, [
        element for element in system.elements if element is not stator], omega=omega))[0]
    rigid = isinstance(stator, RigidStator)
    wall = (stator.radius, stator.friction, stator.surface_speed, stator.restitution if rigid else 0.0,
            0.0 if rigid else stator.stiffness, 0.0 if rigid else stator.damping)
    q, v = np.array(y[:2], float), np.array(y[2:4], float)
    _rub(np.array(system.damping, float), np.array(system.stiffness, float), omega, loads, on_load, rigid, wall, q, v,
         2.0 * np.pi / omega / steps, periods * steps)
    return np.concatenate([q, v])


@njit(cache=True)
def _rub(C, K, omega, loads, on_load, rigid, wall, q, v, h, count):
    """Take the point over ``count`` steps, in place: a radial impulse, and friction that is its share at most and stops at most."""
    radius, friction, surface, restitution, stiffness, damping = wall
    mobility = np.linalg.inv(np.eye(2) + 0.5 * h * C + 0.25 * h * h * K)
    for step in range(count):
        middle = q + 0.5 * h * v
        force = -C @ v - K @ middle
        for i in range(len(loads)):
            force += loads[i, 0] * np.cos(loads[i, 1] * omega * (step + 0.5) * h + loads[i, 2]) * on_load[i]
        new, away = v + h * (mobility @ force), np.sqrt(middle @ middle)
        if away >= radius:
            out = middle / away
            along = np.array([-out[1], out[0]])
            stiff, turned, loose = out @ mobility @ out, along @ mobility @ out, along @ mobility @ along
            push = 0.0 if rigid else -h * max(0.0, stiffness * (away - radius) + damping * (out @ v))
            rub = 0.0
            for _ in range(SWEEPS):
                before = push + rub
                if rigid:
                    push = min(0.0, -(out @ new + restitution * (out @ v) + turned * rub) / stiff)
                rub = min(max(-(along @ new + surface + turned * push) / loose, friction * push), -friction * push)
                if abs(push + rub - before) < CONVERGED:
                    break
            new = new + mobility @ (push * out + rub * along)
        v[:] = new
        q[:] = middle + 0.5 * h * v
