"""What springs, stops and loads do beyond the contract: arguments refused by name, laws of users, polynomial forces."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from bifurc.elements import stators
from bifurc.elements.friction import dry as friction


@pytest.mark.parametrize("make, words", [
    (lambda: el.HarmonicForce(harmonic=0), "harmonic = 0 is not allowed; it must be a whole number, at least 1"),
    (lambda: el.HarmonicForce(harmonic=1.5), "harmonic = 1.5"),
    (lambda: el.HarmonicForce(dof=-1), "dof = -1"),
    (lambda: el.HarmonicForce(row=()), r"row = \(\) is not allowed"),
    (lambda: el.HarmonicForce(row=(np.nan,)), "row = .*finite"),
    (lambda: el.BaseMotion(damper="sea"), "damper = .sea. is not allowed; it must be one of"),
    (lambda: el.RigidStop(restitution=1.2), "RigidStop: restitution = 1.2 is not allowed; it must be .* from 0 to 1"),
    (lambda: el.RigidStop(side=0), "side = 0 is not allowed; it must be one of 1, -1"),
    (lambda: el.RigidStop(amplitude=1.0), "amplitude = 1.0 is not allowed with harmonic = 0"),
    (lambda: el.RigidStop(phase=1.0), "phase = 1.0 is not allowed with harmonic = 0"),
    (lambda: el.ElasticStop(release="later"), "release = 'later'"),
    (lambda: el.ElasticStop(stiffness=0.0, release="force"), "stiffness = 0.0 .* above 0"),
    (lambda: el.ElasticStop(damping=-0.1), "damping = -0.1 .* at least 0"),
    (lambda: el.Force(3), "law = 3 is not allowed; it must be a function"),
    (lambda: el.Force(abs_law, jacobian=1), "jacobian = 1 is not allowed"),
    (lambda: el.Force(abs_law), r"the law takes the parameters \['k'\], but \[\] were given"),
    (lambda: el.Force(abs_law, k=1.0, c=2.0), r"parameters \['k'\], but \['c', 'k'\]"),
    (lambda: el.Force(abs_law, k=np.nan), "k = nan"),
    (lambda: el.Force(abs_law, k=1.0, site=-1), "site = -1"),
])
def test_bad_arguments_are_named(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def abs_law(u, s, k):
    return -k * abs(u)


def test_a_wall_that_stands_still_has_no_motion_to_vary():
    assert set(el.RigidStop().parameters) == {"gap", "restitution"}
    assert set(el.RigidStop(harmonic=2).parameters) == {"gap", "restitution", "amplitude", "phase"}
    assert set(el.ElasticStop().parameters) == {"gap", "stiffness", "damping"}


def test_floats_may_be_given_as_integers_or_numpy_numbers():
    stop = el.RigidStop(np.float64(2), 1)
    assert type(stop.gap) is float and type(stop.restitution) is float and stop == el.RigidStop(2.0, 1.0)
    assert type(el.RigidStop(side=-1.0).side) is int


def test_polynomial_spring_is_its_polynomial(rng):
    coefficients = dict(c2=0.3, c3=-0.2, c4=0.7, c5=1.1)
    law = el.PolynomialSpring(**coefficients).mode("always", None).law
    for x in rng.normal(size=5):
        assert law.function(x, 0.3, *law.values) == pytest.approx(
            -np.polynomial.polynomial.polyval(x, [0, 0, *coefficients.values()]), rel=1e-14)


def test_a_users_law_keeps_the_order_of_its_arguments():
    def law(u, s, b, a):
        return a - b * u

    force = el.Force(law, a=1.0, b=2.0)
    assert force.mode("always", None).law.values == (2.0, 1.0)
    assert force.with_parameters(a=3.0).parameters == {"b": 2.0, "a": 3.0}
    assert force == el.Force(law, b=2, a=1) and force != force.with_parameters(label="x")
    assert repr(force) == "Force(law, site=0, b=2, a=1)"


@pytest.mark.parametrize("way", ["up", "down"])
@pytest.mark.parametrize("curve", ["exponential", "hyperbolic"])
def test_slopes_of_falling_friction_are_those_of_its_law(curve, way):
    """By the speed, of either direction of slip."""
    law, slope = (getattr(friction, f"{curve}_{way}{end}") for end in ("", "_slope"))
    kinetic, static, scale = 0.4, 1.1, 0.3
    for s in np.array([0.05, 0.4, 2.0]) * (1.0 if way == "up" else -1.0):
        step = 1e-6
        numeric = (law(0.0, s + step, kinetic, static, scale) - law(0.0, s - step, kinetic, static, scale)) / (2.0 * step)
        assert slope(0.0, s, kinetic, static, scale) == pytest.approx((0.0, numeric), rel=1e-8)


@pytest.mark.parametrize("st", [0.05, -0.05, 2.0, -2.0])
def test_slopes_of_an_impact_with_friction_are_those_of_its_impulses(st):
    """Below the cone friction stops the sliding, beyond it the impulse is that of the cone: by depth, and both speeds."""
    numbers = (0.6, 0.2, 1.7)  # restitution, friction, mass
    sn, step = 1.3, 1e-6
    assert (abs(stators.impact(0.0, 0.0, sn, st, *numbers)[1]) < abs(st) * 1.7) is (abs(st) > 1.0)
    found = np.array(stators.impact_slope(0.0, 0.0, sn, st, *numbers)).reshape(2, 4)
    for k, (dn, dt) in enumerate([(step, 0.0), (0.0, step)]):
        above, below = (np.array(stators.impact(0.0, 0.0, sn + way * dn, st + way * dt, *numbers)) for way in (1.0, -1.0))
        np.testing.assert_allclose(found[:, 2 + k], (above - below) / (2.0 * step), rtol=1e-8, atol=1e-9)
    assert not found[:, :2].any()


def test_dampers_to_the_ground_feel_the_absolute_speed():
    """Relative to the frame X the same motion as in absolute coordinates, where the springs are pulled by K X."""
    M, C, K = np.diag([1.0, 2.0]), np.array([[0.5, -0.1], [-0.1, 0.3]]), np.array([[3.0, -1.0], [-1.0, 2.0]])
    X, omega = 0.7, 1.1
    frame = bf.System(M, C, K, [el.BaseMotion(X, damper="ground")], omega=omega)
    pulled = K @ np.ones(2) * X
    ground = bf.System(M, C, K, [el.HarmonicForce(float(force), dof=dof) for dof, force in enumerate(pulled)], omega=omega)
    (t, relative), (_, absolute) = (bf.find_orbit(system).sample(9) for system in (frame, ground))
    np.testing.assert_allclose(relative[:, :2] + X * np.cos(omega * t)[:, None], absolute[:, :2], rtol=0, atol=1e-12)


def test_docstring_examples():
    import doctest

    import bifurc.elements.element
    import bifurc.elements.springs
    import bifurc.system

    for module in (bifurc.elements.element, bifurc.elements.springs, bifurc.system):
        assert doctest.testmod(module).failed == 0


def test_energy_of_a_law_is_its_work_where_speed_does_not_matter():
    assert el.Force(lambda u, s, k: -k * u**3, k=2.0).stored_energy([1.5]) == pytest.approx(2.0 * 1.5**4 / 4.0, rel=1e-13)
    assert el.Force(lambda u, s, k: -k * u**3 * (1.0 + s**2), k=2.0).stored_energy([1.5]) is None
    assert el.Force(lambda u, s, k: -k * s, k=2.0).stored_energy([1.5]) is None
