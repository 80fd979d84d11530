"""Ready systems: the equations of motion that their docstrings state, and what they refuse."""
import inspect

import numpy as np
import pytest

from bifurc import systems
from bifurc.compose import scene_of

# read by another law of the belt, and with a casing: not by the defaults
UNREAD = {"belt_oscillator": ("decay_speed", "falling", "rising"), "rotating_frame_rotor": ("casing_damping", "casing_stiffness")}
ALL = [getattr(systems, name) for name in systems.__all__]


def acceleration(system, q, v, t, start=0):
    """Accelerations in start mode number ``start``, laws included, from the tables."""
    scene = scene_of(system)
    mode = list(scene.start_modes())[start]
    w = [1.0]
    for k in scene.harmonics:
        w += [np.cos(k * scene.omega * t), np.sin(k * scene.omega * t)]
    x = np.array([*np.atleast_1d(q), *np.atleast_1d(v), *w])
    T = scene.tables
    a = T.A[mode, scene.n:2 * scene.n] @ x
    row = 0
    for law in scene.laws:
        rows = slice(row, row + law.rows)
        force = law.law.function(*(T.LU[rows] @ x), *(T.LS[rows] @ x), *law.law.values)
        a = a + T.LP[mode, rows].T @ np.atleast_1d(force)
        row += law.rows
    return a


@pytest.mark.parametrize("build", ALL, ids=systems.__all__)
def test_builders_have_keywords_with_defaults_that_can_vary(build):
    for item in inspect.signature(build).parameters.values():
        assert item.kind is item.KEYWORD_ONLY and item.default is not item.empty
    system = build()
    assert list(system.parameters) == list(inspect.signature(build).parameters)
    assert repr(system).startswith(build.__name__ + "(")
    for name, value in system.parameters.items():
        if type(value) is float and value and name not in UNREAD.get(build.__name__, ()):
            changed = system.with_parameters(**{name: 0.9 * value})
            assert changed.parameters[name] == 0.9 * value
            assert changed.structure == system.structure
            assert changed != system
            same = np.array_equal(scene_of(system).flat_of(changed), scene_of(system).tables.flat)
            assert not same or changed.elements != system.elements  # a stiffness may matter in later modes only
            with pytest.raises(ValueError, match=f"{name} = nan is not allowed"):
                system.with_parameters(**{name: np.nan})
    assert build.__doc__.count("Parameters\n")
    with pytest.raises(ValueError, match="parameter 'colour' is unknown; there are"):
        build(colour=1.0)


@pytest.mark.parametrize("seed", range(5))
def test_equations_of_motion(seed):
    z, w, F, q, v, t, r = np.random.default_rng(seed).uniform(0.1, 2.0, 7)
    load = F * np.cos(w * t)

    def close(value, wanted):
        assert value == pytest.approx(np.atleast_1d(wanted), rel=1e-14, abs=1e-14)

    common = dict(zeta=z, omega=w, amplitude=F)
    close(acceleration(systems.impact_oscillator(**common, gap=3.0), q, v, t), load - 2 * z * v - q)
    close(acceleration(systems.two_sided_impact_oscillator(**common, gap=3.0), q, v, t), load - 2 * z * v - q)
    close(acceleration(systems.duffing_oscillator(**common, alpha=-0.3, beta=0.7), q, v, t),
          load - 2 * z * v + 0.3 * q - 0.7 * q**3)
    bilinear = systems.bilinear_oscillator(**common, gap=0.5, stiffness_ratio=4.0 * r)
    close(acceleration(bilinear, q, v, t, 0), load - 2 * z * v - q)
    close(acceleration(bilinear, q, v, t, 1), load - 2 * z * v - (4.0 * r * q + (1 - 4.0 * r) * 0.5))
    ball = systems.bouncing_ball(omega=w, amplitude=F, gravity=r)
    close(acceleration(ball, q, v, t, 0), -r)
    close(acceleration(ball, q, v, t, 1), -F * w**2 * np.cos(w * t))
    # moving frame: x = z + X, spring on the frame, damper on frame or ground
    X, dX, ddX = F * np.cos(w * t), -F * w * np.sin(w * t), -F * w**2 * np.cos(w * t)
    close(acceleration(systems.moving_frame_impact_oscillator(**common, gap=3.0), q, v, t), -q - 2 * z * v - ddX)
    close(acceleration(systems.moving_frame_impact_oscillator(**common, gap=3.0, damper="ground"), q, v, t),
          -((q + X) - X) - 2 * z * (v + dX) - ddX)


@pytest.mark.parametrize("n, stopped, loaded", [(1, 0, 0), (2, 0, 1), (8, -1, -1), (5, 2, -2)])
def test_chain_equations(n, stopped, loaded, rng):
    m, k, c, w, F = rng.uniform(0.2, 2.0, 5)
    system = systems.impact_chain(n=n, mass=m, stiffness=k, damping=c, omega=w, amplitude=F, gap=0.4,
                                  stopped=stopped, loaded=loaded)
    q, v, t = rng.normal(size=n), rng.normal(size=n), 0.3
    force = np.zeros(n)
    for i in range(n):  # spring i between mass i - 1 (or the wall) and mass i
        stretch = k * (q[i] - (q[i - 1] if i else 0.0)) + c * k * (v[i] - (v[i - 1] if i else 0.0))
        force[i] -= stretch
        if i:
            force[i - 1] += stretch
    force[loaded] += F * np.cos(w * t)
    assert acceleration(system, q, v, t) == pytest.approx(force / m, rel=1e-13, abs=1e-13)
    G = scene_of(system).tables.G[0, 0]
    assert G[stopped % n] == 1.0 and G[2 * n] == -0.4 and np.count_nonzero(G) == 2


def test_a_moving_frame_is_a_load_of_its_amplitude_times_omega_squared():
    """F = X0 omega^2, in the tables to the last bits; grazing of the free response at X0 = gap |D| / omega^2."""
    w, X0 = 1.7, 0.45
    frame = scene_of(systems.moving_frame_impact_oscillator(omega=w, amplitude=X0, zeta=0.07, gap=0.8)).tables
    load = scene_of(systems.impact_oscillator(omega=w, amplitude=X0 * w * w, zeta=0.07, gap=0.8)).tables
    assert frame.flat == pytest.approx(load.flat, rel=4e-16, abs=4e-16)


def test_a_damper_to_the_ground_turns_the_phase_of_the_load():
    z, w, X0 = 0.2, 0.9, 0.6
    A = scene_of(systems.moving_frame_impact_oscillator(zeta=z, omega=w, amplitude=X0, damper="ground")).tables.A[0, 1]
    load = X0 * w * (w + 2j * z)  # complex amplitude of -X'' - 2 zeta X' over e^{i w t}: X0 (w^2 - 2 i zeta w)
    assert A[3] - 1j * A[4] == pytest.approx(load.conjugate(), rel=1e-15)


def test_symmetric_builders():
    assert systems.two_sided_impact_oscillator().symmetry == -1
    assert systems.duffing_oscillator().symmetry == -1
    assert systems.impact_oscillator().symmetry is None
    assert systems.bouncing_ball().symmetry is None


@pytest.mark.parametrize("build, keywords, words", [
    ("impact_oscillator", dict(restitution=1.1), "restitution = 1.1 is not allowed; it must be a number from 0 to 1"),
    ("impact_oscillator", dict(restitution=-0.1), "restitution = -0.1 is not allowed"),
    ("impact_oscillator", dict(omega=0.0), "omega = 0.0 is not allowed"),
    ("impact_oscillator", dict(amplitude=None), "amplitude = None is not allowed"),
    ("two_sided_impact_oscillator", dict(gap=0.0), "gap = 0.0 is not allowed; it must be a finite number above 0"),
    ("bilinear_oscillator", dict(stiffness_ratio=-1.0), "stiffness_ratio = -1.0 is not allowed"),
    ("moving_frame_impact_oscillator", dict(damper="air"), "damper = 'air' is not allowed; it must be one of 'frame'"),
    ("impact_chain", dict(n=0), "n = 0 is not allowed; it must be a whole number, at least 1"),
    ("impact_chain", dict(n=2.5), "n = 2.5 is not allowed"),
    ("impact_chain", dict(n=3, stopped=3), "stopped = 3 is not allowed; it must be .* at least -3 and at most 2"),
    ("impact_chain", dict(mass=-1.0), "mass = .* positive definite"),
])
def test_bad_keywords_are_named(build, keywords, words):
    with pytest.raises(ValueError, match=words):
        getattr(systems, build)(**keywords)
