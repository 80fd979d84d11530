"""Elastic rub tends to rigid impacts: how fast the orbit of an offset rotor converges as the stator stiffens.

Of an elastic contact without adhesion the restitution is e = exp(-beta / b atan2(2 beta b, 2 beta^2 - 1)), b = sqrt(1 -
beta^2), with the damping ratio beta of the contact (Zhang 2008, section 5.4).  With that damping the stroboscopic point of
the elastic orbit differs from the rigid one by O(stiffness^(-1/2)), the time spent in contact, and two stiffnesses
extrapolate to the rigid orbit.
"""
import math

import numpy as np
from scipy.optimize import brentq

import bifurc as bf

from .common import Setting, parser, table

PARAMETERS = {"zeta": 0.1, "eccentricity": 0.3, "offset": 0.5, "friction": 0.1, "disk_radius": 2.0}
RESTITUTION = 0.5
ORBITS = {"one impact, nu = 1.7": (1.7, (0.10858670442, -0.36758356342, 0.80829813276, -1.10519325191)),
          "three impacts, nu = 1.1": (1.1, (0.61474849182, -0.78638160780, 0.47912859453, 0.40977955316))}
STIFFNESSES = {Setting.SMALL: (1e4, 1e5, 1e6), Setting.FULL: (1e3, 1e4, 1e5, 1e6, 1e7, 1e8)}


def restitution_of(beta: float) -> float:
    """Return the restitution of an elastic contact that ends where its force vanishes."""
    b = math.sqrt(1.0 - beta**2)
    return math.exp(-beta / b * math.atan2(2.0 * beta * b, 2.0 * beta**2 - 1.0))


def damping_ratio(restitution: float) -> float:
    """Return the damping ratio of the contact that has this restitution."""
    return float(brentq(lambda beta: restitution_of(beta) - restitution, 1e-9, 1.0 - 1e-9, xtol=1e-15))


def deviations(nu: float, guess, stiffnesses) -> tuple[np.ndarray, np.ndarray]:
    """Return for every stiffness (k,) how far the elastic orbit is from the rigid one, and that of extrapolated pairs (k - 1,)."""
    rigid = bf.find_orbit(bf.systems.rigid_stator_rotor(nu=nu, restitution=RESTITUTION, **PARAMETERS), guess=guess)
    beta, states = damping_ratio(RESTITUTION), []
    near = rigid.state
    for stiffness in stiffnesses:
        damping = 2.0 * beta * math.sqrt(stiffness)
        system = bf.systems.jeffcott_rotor(nu=nu, stiffness=stiffness, contact_damping=damping, **PARAMETERS)
        orbit = bf.find_orbit(system, guess=near)
        if not orbit.success:
            raise RuntimeError(f"no orbit at stiffness {stiffness:g}: {orbit.message}")
        states.append(orbit.state)
    found = np.array(states)
    root = np.sqrt(np.array(stiffnesses))[:, None]
    better = (root[1:] * found[1:] - root[:-1] * found[:-1]) / (root[1:] - root[:-1])
    return np.abs(found - rigid.state).max(axis=1), np.abs(better - rigid.state).max(axis=1)


def run(setting: Setting) -> list[list]:
    """Return rows: orbit, stiffness, deviation, deviation times root of stiffness, deviation after extrapolation."""
    rows: list[list] = []
    for name, (nu, guess) in ORBITS.items():
        away, better = deviations(nu, guess, STIFFNESSES[setting])
        for k, stiffness in enumerate(STIFFNESSES[setting]):
            rows.append([name, stiffness, float(away[k]), float(away[k] * math.sqrt(stiffness)),
                         float(better[k - 1]) if k else None])
    return rows


def main() -> None:
    """Print the table."""
    options = parser(__doc__).parse_args()
    print(table("Elastic to rigid: stroboscopic point of the orbit (largest of x, y, x', y')",
                ["orbit", "stiffness", "deviation", "deviation * sqrt(stiffness)", "extrapolated"], run(options.setting)))


if __name__ == "__main__":
    main()
