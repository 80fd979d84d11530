"""Pieces of harmonic balance against sums and integrals written out: laws, measures, errors, series, friction, propagators."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import bifurc as bf
from bifurc.elements import Coulomb, CubicSpring, Force, HarmonicForce, Jenkins, RigidStop
from bifurc.elements.local import affine, cos, sin
from bifurc.hbm import errors
from bifurc.hbm.balance import Balance
from bifurc.hbm.contacts import common
from bifurc.hbm.errors import SAFETY, longer, truncation
from bifurc.hbm.floquet import monodromy
from bifurc.hbm.floquet.stability import StabilityStatus, monodromy_of, multipliers_of, ordered
from bifurc.hbm.laws import Sampled, compiled, law_forces
from bifurc.hbm.layout import Layout, listed
from bifurc.hbm.measures import measure_gradient, summit
from bifurc.hbm.parts import split
from bifurc.hbm.setvalued import solution, system_contacts
from bifurc.hbm.setvalued.condensed import condensed
from bifurc.hbm.setvalued.douglas_rachford import split as splitting
from bifurc.hbm.setvalued.equations import Balance as SetValued
from bifurc.hbm.setvalued.equations import Contact, Linear, SetValuedStatus
from bifurc.hbm.setvalued.full_stick import at_rest
from bifurc.hbm.setvalued.li2019 import FirstJacobian
from bifurc.hbm.setvalued.li2019 import Sampled as Published
from bifurc.hbm.setvalued.sign_pattern import Pattern, _product, added, differentiated, evaluate, grid_size, on_grid
from bifurc.hbm.setvalued.system_contacts import _energy, _mean_square, _phasors, _square, contacts_of, rest_of
from bifurc.hbm.status import BalanceStatus, ContactStatus
from bifurc.hbm.tables import Series, numbers_at
from tests.reference.written_elements import Shaken

# measures


@pytest.mark.parametrize("layout", [Layout((0, 1, 2, 5), 3), Layout((0, 1, 2, 3, 4), 2, periods=2), Layout((1, 3), 1)])
def test_gradients_of_measures_are_those_of_the_measures(layout, rng):
    theta = np.linspace(0.0, 2.0 * np.pi, 4001)[:-1]

    def value(name, x):
        kind, dof = name.split("_")
        a, u = layout.matrix(x)[:, int(dof)], layout.values(x, theta)[:, int(dof)]
        if kind == "rms":
            return np.sqrt(np.mean(u * u))
        if kind == "h1":
            return abs(layout.phasor(x, layout.periods, int(dof)))
        peak = summit(layout, a if kind == "max" else -a)
        assert abs(layout.values(x, [peak])[0, int(dof)] - (u.max() if kind == "max" else u.min())) < 1e-4
        return layout.values(x, [peak])[0, int(dof)]

    x = rng.standard_normal(layout.size)
    for kind in ("h1", "rms", "max", "min"):
        name = f"{kind}_{layout.n - 1}"
        h = 1e-5
        slope = [(value(name, x + h * e) - value(name, x - h * e)) / (2.0 * h) for e in np.eye(layout.size)]
        np.testing.assert_allclose(measure_gradient(layout, name, x), slope, atol=1e-7)
    for none in ("max_9", "rms", "rms_x", "mean_0", f"rms_{layout.n}"):
        assert measure_gradient(layout, none, x) is None
    for kind in ("h1", "rms"):
        assert not measure_gradient(layout, f"{kind}_0", np.zeros(layout.size)).any()
    assert not measure_gradient(Layout((0, 2), 1), "h1_0", np.ones(3)).any()


def test_the_summit_is_the_highest_of_several(rng):
    layout = Layout(tuple(range(8)), 1)
    theta = np.linspace(0.0, 2.0 * np.pi, 8001)
    for _ in range(10):
        a = rng.standard_normal(layout.slots)
        u = layout.basis(theta) @ a
        assert layout.basis([summit(layout, a)])[0] @ a == pytest.approx(u.max(), abs=1e-5)
    assert layout.basis([summit(layout, np.eye(layout.slots)[0])])[0, 0] == 1.0  # a constant


# errors


@pytest.mark.parametrize(
    ("kept", "more"),
    [
        ((0, 1, 2, 3), (4, 5, 6)),
        ((1, 3, 5), (7, 9)),
        ((0, 1), (2, 3)),
        ((1,), (3,)),
        ((0, 2, 4), (5, 6, 7, 8)),
        ((0, 1, 5), (6, 7, 8, 9, 10)),
    ],
)
def test_the_doubled_set_of_harmonics(kept, more):
    found = longer(Layout(kept, 3, 2))
    assert found.harmonics == (*kept, *more) and (found.n, found.periods) == (3, 2)


@pytest.mark.parametrize("samples", [0, 16, 64])  # too few for the larger set, and enough
@pytest.mark.parametrize("large, factor, rough", [(False, 2, False), (True, 2, False), (False, 4, False), (False, 4, True)])
def test_the_stated_error_is_steps_in_more_harmonics_and_their_tail(large, factor, rough, samples, monkeypatch):
    """Of a cubic spring: the residual of the larger set by quadrature, one solve or two, sizes of phasors, a geometric tail."""
    if large:
        monkeypatch.setattr(errors, "LARGE", 0)
    if factor == 2:
        monkeypatch.setattr(errors, "FEW", 0)
    if not rough:
        monkeypatch.setattr(errors, "ROUGH", 1e9)
    omega, c = 0.55, 0.9
    system = bf.System(2.0, 0.3, 1.5, [HarmonicForce(1.2), CubicSpring(c)], omega=omega)
    balance = Balance(system, Layout((0, 1, 2, 3), 1), samples)
    x = np.array([0.01, 0.6, 0.3, 0.02, -0.03, 0.05, 0.01])
    top = 3 * factor
    more, n = Layout(tuple(range(top + 1)), 1), 2 * top + 1
    theta = 2.0 * np.pi * np.arange(256) / 256
    Z = np.zeros((n, n))
    for i in range(n):
        e = np.eye(n)[i]
        w = more.waves * omega
        Z[:, i] = (1.5 - 2.0 * w * w) * e + 0.3 * omega * more.derivative(e)

    def step_from(at):
        u = more.values(at, theta)[:, 0]
        f = Z @ at + more.analysis((c * u**3)[:, None]) - 1.2 * np.eye(n)[1]
        J = Z + np.array([more.analysis((3.0 * c * u * u * more.basis(theta)[:, i])[:, None]) for i in range(n)]).T
        if large:
            return np.concatenate([np.zeros(7), np.linalg.solve(Z[7:, 7:], f[7:])])
        return np.linalg.solve(J, f)

    moved = np.concatenate([x, np.zeros(n - 7)])
    steps = [step_from(moved)]
    if rough:
        steps.append(step_from(moved - steps[0]))
    size = sum(np.array([abs(more.phasor(step, k)) for k in range(top + 1)]) for step in steps)
    upper = size[4:]
    half = len(upper) // 2
    first, last = upper[:half].sum(), upper[half:].sum()
    ratio = min(max(last / first, 0.0), 0.9)
    want = SAFETY * (size.sum() + last * ratio / (1.0 - ratio))
    np.testing.assert_allclose(truncation(balance, x), [want], rtol=1e-9)


def test_an_error_that_cannot_be_made_is_none():
    system = bf.System(1.0, 0.0, 1.0, [HarmonicForce(1.0), Jenkins(1.0, 0.5)], omega=0.5)
    assert truncation(Balance(system, Layout((1,), 1)), np.array([np.nan, 0.0])) is None


# laws


def nonlinear(u0, u1, s0, s1, a, b):
    return -a * u0 * u1 - b * s0, -a * u1 * u1 * u1 + b * s0 * s1


def slopes_of(u0, u1, s0, s1, a, b):
    return (-a * u1, -a * u0, -b, 0.0 * b, 0.0 * a, -3.0 * a * u1 * u1, b * s1, b * s0)


@pytest.mark.parametrize("jacobian", [None, slopes_of])
def test_forces_and_slopes_of_a_law_at_samples(jacobian, rng):
    options = {} if jacobian is None else {"jacobian": jacobian}
    system = bf.System(
        np.eye(2), np.eye(2), np.eye(2), [HarmonicForce(1.0), Force(nonlinear, site=np.eye(2), a=0.7, b=-0.4, **options)], omega=1.0
    )
    (law,) = split(system, Layout((0, 1), 2)).laws
    U, V = 3.0 * rng.standard_normal((2, 9)), 0.05 * rng.standard_normal((2, 9))
    f, g, own = np.empty((2, 9)), np.empty((2, 4, 9)), np.array([0.7, -0.4])
    compiled(law).forces(own, U, V, f)
    compiled(law).slopes(own, U, V, g)
    np.testing.assert_allclose(f, nonlinear(*U, *V, 0.7, -0.4), rtol=1e-14)
    want = np.array([np.broadcast_to(v, 9) for v in slopes_of(*U, *V, 0.7, -0.4)]).reshape(2, 4, 9)
    np.testing.assert_allclose(g, want, rtol=1e-8, atol=1e-8)
    assert compiled(law) is compiled(law)


@pytest.mark.parametrize("samples", [21, 32])
def test_tables_of_samples(samples, rng):
    waves = np.array([0, 1, 1, 2, 2, 5, 5])
    place = np.array([0, 1, 2, 5, 6])
    tables = Sampled(waves, place, samples)
    theta = 2.0 * np.pi * np.arange(samples) / samples
    basis = np.array([np.ones(samples), *(f(k * theta) for k in (1, 2, 5) for f in (np.cos, np.sin))])
    np.testing.assert_allclose(tables.basis, basis, atol=1e-14)
    signal = rng.standard_normal((3, samples))
    weight = np.array([1.0, 2.0, 2.0, 2.0, 2.0]) / samples
    np.testing.assert_allclose(signal @ tables.project, signal @ (basis[place].T * weight), atol=1e-14)
    found = tables.spectrum(signal)
    assert found.shape == (3, 11, 2)
    for l in range(11):  # also beyond half of the samples
        np.testing.assert_allclose(found[:, l, 0], (signal * np.cos(l * theta)).mean(axis=1), atol=1e-14)
        np.testing.assert_allclose(found[:, l, 1], (signal * np.sin(l * theta)).mean(axis=1), atol=1e-14)


def test_derivatives_of_laws_by_their_values(rng):
    system = bf.System(
        np.eye(2), np.eye(2), np.eye(2), [HarmonicForce(1.0), Force(nonlinear, site=np.eye(2), a=0.7, b=-0.4)], omega=1.0
    )
    parts = split(system, Layout((0, 1, 2), 2))
    waves, place = parts.shape.waves, parts.shape.place
    tables = Sampled(waves, place, 64)
    c, v = rng.standard_normal((2, 2, waves.size))
    values, turn = np.array([0.7, -0.4]), np.array([1.0, -2.0])

    def summed(values, dvalues):
        SU, SS, F, J = (
            np.zeros((2, 2, 5, 2)),
            np.zeros((2, 2, 5, 2)),
            np.zeros((2, place.size)),
            np.zeros((2, place.size, 2, waves.size + 1)),
        )
        law_forces(parts.laws, tables, values, dvalues, c, v, SU, SS, F, J)
        return F, J, SU, SS

    f = np.array(nonlinear(*(c @ tables.basis), *(v @ tables.basis), 0.7, -0.4))
    F, J, SU, SS = summed(values, 0.0 * turn)
    g = np.array([np.broadcast_to(s, 64) for s in slopes_of(*(c @ tables.basis), *(v @ tables.basis), 0.7, -0.4)]).reshape(2, 4, 64)
    rest = f - np.einsum("abn,bn->an", g, np.concatenate([c @ tables.basis, v @ tables.basis]))
    np.testing.assert_allclose(F, rest @ tables.project, atol=1e-8)
    np.testing.assert_allclose(SU, tables.spectrum(g[:, :2]), atol=1e-8)
    np.testing.assert_allclose(SS, tables.spectrum(g[:, 2:]), atol=1e-8)
    assert not J.any()
    J = summed(values, turn)[1]
    by = np.array(nonlinear(*(c @ tables.basis), *(v @ tables.basis), *(values + 1e-3 * turn))) - np.array(
        nonlinear(*(c @ tables.basis), *(v @ tables.basis), *(values - 1e-3 * turn))
    )
    np.testing.assert_allclose(J[:, :, 0, -1], by @ tables.project / 2e-3, atol=1e-7)
    assert not J[:, :, 1].any() and not J[:, :, 0, :-1].any()


# parts


def test_codes_of_kernels_are_those_of_the_statuses():
    assert tuple(ContactStatus) == tuple(
        ContactStatus(name) for name in ("followed", "inconsistent", "too_many", "not_settled", "not_finite")
    )
    assert (common.FOLLOWED, common.INCONSISTENT, common.TOO_MANY, common.NOT_SETTLED, common.NOT_FINITE) == (0, 1, 2, 3, 4)
    with pytest.warns(DeprecationWarning):
        assert BalanceStatus("march_failed") is BalanceStatus.CONTACTS_FAILED
    with pytest.raises(ValueError):
        BalanceStatus("nothing")


def test_numbers_along_a_parameter_are_chebyshev_series(rng):
    series = Series(np.array([5.0, 6.0, 7.0, 8.0]), np.array([2, 0]), rng.standard_normal((2, 5)), 1.0, 4.0)
    flat, dflat = np.empty(4), np.empty(4)
    for p in (1.0, 1.7, 4.0, 4.3):
        numbers_at(series, p, flat, dflat)
        z = (2.0 * p - 5.0) / 3.0
        for row, place in enumerate((2, 0)):
            c = np.polynomial.Chebyshev(series.series[row])
            assert flat[place] == pytest.approx(c(z), rel=1e-12) and dflat[place] == pytest.approx(
                c.deriv()(z) * 2.0 / 3.0, rel=1e-11
            )
        assert flat[1] == 6.0 and flat[3] == 8.0 and dflat[1] == dflat[3] == 0.0


def test_rows_are_shared_and_elements_are_put_where_they_belong():
    elements = [
        HarmonicForce(1.5, dof=1),
        Jenkins(2.0, 0.5, dof=0),
        Jenkins(3.0, 0.25, dof=0),
        CubicSpring(0.7, dof=1),
        Coulomb(0.4, dof=0),
        bf.elements.LinearSpring(0.25, 0.125, dof=1),
    ]
    system = bf.System(np.diag([1.0, 2.0]), [[0.1, 0.0], [0.0, 0.2]], [[3.0, -1.0], [-1.0, 2.0]], elements, omega=1.6)
    parts = split(system, Layout((0, 1, 2, 4), 2, periods=2))
    np.testing.assert_array_equal(parts.rows, [[1.0, 0.0], [0.0, 1.0]])
    assert (
        [c.element for c in parts.contacts] == [1, 2]
        and [l.element for l in parts.laws] == [3]
        and [h.element for h in parts.held] == [4]
    )
    assert [c.rows for c in parts.contacts] == [(0,), (0,)] and parts.laws[0].rows == (1,)
    T = parts.numbers
    assert T.omega[0] == 0.8
    np.testing.assert_allclose(T.K, [[3.0, -1.0], [-1.0, 2.25]])
    np.testing.assert_allclose(T.C, [[0.1, 0.0], [0.0, 0.325]])
    load = np.zeros((7, 2))
    load[3, 1] = 1.5  # cosine of harmonic 2 of the slowest
    np.testing.assert_allclose(T.E, load)
    other = parts.at(
        system.with_omega(3.0)
        if hasattr(system, "with_omega")
        else bf.System(system.mass, system.damping, system.stiffness, elements, omega=3.0)
    )
    assert other.numbers.omega[0] == 1.5 and parts.numbers.omega[0] == 0.8
    with pytest.raises(ValueError, match="another structure"):
        parts.flat_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0)], omega=1.0))


# set-valued friction


def test_spectra_are_values_at_phases(rng):
    for degree in (0, 2, 3, 7):
        c = rng.standard_normal(degree + 1) + 1j * rng.standard_normal(degree + 1)
        c[0] = c[0].real
        theta = 2.0 * np.pi * np.arange(64) / 64
        want = c[0].real + sum((c[k] * np.exp(1j * k * theta)).real for k in range(1, degree + 1))
        np.testing.assert_allclose(evaluate(c, theta), want, atol=1e-12)
        np.testing.assert_allclose(on_grid(c, 64), want, atol=1e-12)
        h = 1e-6
        np.testing.assert_allclose(
            evaluate(differentiated(c), theta), (evaluate(c, theta + h) - evaluate(c, theta - h)) / (2.0 * h), atol=1e-8
        )
    np.testing.assert_allclose(added([1.0, 2j], [3.0], [0.0, 1.0, 5.0]), [4.0, 1.0 + 2j, 5.0])
    assert [grid_size(k) for k in (0, 1, 8, 9, 16, 17)] == [64, 64, 64, 128, 128, 256]


@pytest.mark.parametrize("degree", [0, 3, 140])
def test_products_of_indicators_and_polynomials(degree, rng):
    """Short ones directly, long ones by transforms: both against a sum over samples."""
    top, N = 4, 1024
    c = rng.standard_normal(degree + 1) + 1j * rng.standard_normal(degree + 1)
    c[0] = c[0].real
    theta = 2.0 * np.pi * np.arange(N) / N
    signal = (np.cos(theta) > 0.2).astype(float)
    indicator = np.array([(signal * np.exp(-1j * k * theta)).mean() for k in range(top + degree + 1)])
    found = _product(indicator, c, top)
    values = signal * evaluate(c, theta)
    want = np.array([(2.0 if k else 1.0) * (values * np.exp(-1j * k * theta)).mean() for k in range(top + 1)])
    np.testing.assert_allclose(found, want, atol=1e-10)


def test_the_linear_part_is_that_of_the_balance(rng):
    M, C, K = np.diag([1.0, 2.0]) + 0.1, rng.standard_normal((2, 2)), rng.standard_normal((2, 2))
    system = bf.System(M, C, K, [HarmonicForce(1.3, dof=1), HarmonicForce(0.4, harmonic=2, phase=0.7)], omega=1.7)
    for layout in (Layout((0, 1, 2), 2), Layout((0, 1, 2, 3, 4), 2, 2), Layout((1, 2), 2)):
        balance = Balance(system, layout)
        own = rest_of(balance)
        x = rng.standard_normal(layout.size)
        r, j = own(x)
        np.testing.assert_allclose(r, balance.residual(x), atol=1e-12)
        np.testing.assert_allclose(j, balance.jacobian(x), atol=1e-12)


@pytest.mark.parametrize("layout", [Layout((0, 1, 2, 3), 3), Layout((1, 3, 5), 3), Layout((0, 1, 2, 4), 3, 2)])
@pytest.mark.parametrize("width", [0.0, 0.3])
def test_forces_of_contacts_along_rows_and_their_derivative(layout, width, rng):
    """Speeds of rows that mix coordinates, with a belt; averages of the law over a fine grid, and differences."""
    omega = 1.9
    contacts = [
        Contact(np.array([1.0, -2.0, 0.0]), np.array([1.0 + 0j]), np.array([-0.5 + 0j]), np.array([0.2 + 0j, 0.1j])),
        Contact(np.array([0.0, 0.5, 1.5]), np.array([0.8, 0.3 * np.exp(1j)]), np.array([-0.8, -0.3 * np.exp(1j)])),
    ]
    balance = SetValued(layout, omega, None, contacts)
    x = rng.standard_normal(layout.size)
    f, df = balance.force(x, [width, width])
    N = 8192
    theta = 2.0 * np.pi * (np.arange(N) + 0.5) / N
    q = layout.values(layout.derivative(x), theta) * omega / layout.periods
    total = np.zeros((layout.slots, 3))
    for contact, speed in zip(contacts, balance.patterns, strict=True):
        s = q @ contact.row + evaluate(contact.speed, theta)
        up, low = evaluate(contact.upper, theta), evaluate(contact.lower, theta)
        r = np.where(s > 0.0, up, low) if width == 0.0 else np.clip(s / width, low, up)
        weight = np.where(layout.waves == 0, 1.0, 2.0) / N
        total += np.outer((layout.basis(theta).T @ r) * weight, contact.row)
        assert isinstance(speed, Pattern)
    np.testing.assert_allclose(f, total.ravel(), atol=3e-3)
    h = 1e-6
    slopes = np.array(
        [
            (balance.force(x + h * e, [width] * 2, False)[0] - balance.force(x - h * e, [width] * 2, False)[0]) / (2.0 * h)
            for e in np.eye(layout.size)
        ]
    ).T
    np.testing.assert_allclose(df, slopes, atol=1e-5 * np.abs(slopes).max())
    assert balance.force(x, [width] * 2, False)[1] is None
    assert contacts[0].limit == 0.75 and contacts[1].limit == pytest.approx(1.1)


def test_a_condensed_balance_is_the_whole_one_without_what_friction_does_not_touch(rng):
    K = np.array([[3.0, -1.0, 0.2], [-1.2, 2.5, -0.4], [0.1, -0.7, 2.0]])
    system = bf.System(
        np.diag([1.0, 1.5, 0.7]),
        0.1 * K,
        K,
        [HarmonicForce(1.0, dof=0), HarmonicForce(0.5, harmonic=2, dof=2, phase=0.4), Coulomb(0.2, dof=1)],
        omega=0.9,
    )
    layout = Layout((0, 1, 2), 3)
    core = Balance(system, layout)
    (contact,) = contacts_of(core)
    small = condensed(core, [contact])
    assert small.layout == Layout((0, 1, 2), 1) and small.touched.tolist() == [False, True, False]
    x = rng.standard_normal(small.layout.size)
    whole = small.expanded(x)
    np.testing.assert_allclose(small.restricted(whole), x)
    r, j = rest_of(core)(whole)
    own, slope = small.rest(x)
    left = layout.matrix(r)
    np.testing.assert_allclose(left[:, [0, 2]], 0.0, atol=1e-12)  # the others are in balance
    np.testing.assert_allclose(own, left[:, 1], atol=1e-12)
    h = 1e-6
    for e in np.eye(small.layout.size):
        np.testing.assert_allclose(slope @ e, (small.rest(x + h * e)[0] - small.rest(x - h * e)[0]) / (2.0 * h), atol=1e-8)
        np.testing.assert_allclose(small.expanded(e, load=False), small.expanded(x + e) - small.expanded(x), atol=1e-12)
    np.testing.assert_array_equal(small.contacts[0].row, [1.0])
    everywhere = [Contact(np.eye(3)[i], np.ones(1), -np.ones(1)) for i in range(3)]
    assert condensed(core, everywhere) is None and condensed(core, []) is None
    singular = bf.System(
        np.eye(2), np.zeros((2, 2)), np.diag([0.81, 2.0]), [HarmonicForce(1.0, dof=0), Coulomb(0.2, dof=1)], omega=0.9
    )
    assert (
        condensed(Balance(singular, Layout((0, 1), 2)), [Contact(np.eye(2)[1], np.ones(1), -np.ones(1))]) is None
    )  # its resonance


class OnShakenFloor(Coulomb):
    """Friction on a floor that moves by -3 cos 2 omega t."""

    def site(self, n):
        return dataclasses.replace(super().site(n), base=(3.0 * cos(2),))


def test_contacts_of_a_system_carry_belts_moving_floors_and_loads():
    omega = 1.4
    belt = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Coulomb(0.5, belt_speed=0.3)], omega=omega)
    (contact,) = contacts_of(Balance(belt, Layout((0, 1), 1)))
    np.testing.assert_allclose(contact.speed, [-0.3])
    np.testing.assert_allclose(contact.upper, [0.5])
    np.testing.assert_allclose(contact.lower, [-0.5])
    for periods in (1, 2):
        shaken = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), OnShakenFloor(0.5)], omega=omega)
        (contact,) = contacts_of(Balance(shaken, Layout((0, 1, 2, 4), 1, periods)))
        want = np.zeros(1 + 2 * periods, complex)  # of d/dt (3 cos 2 omega t) = -6 omega sin 2 omega t
        want[2 * periods] = 6.0j * omega
        np.testing.assert_allclose(contact.speed, want)
    expression = affine(2.0) + 3.0 * cos(1) - 4.0 * sin(2)
    np.testing.assert_allclose(_phasors(expression, 1), [2.0, 3.0, 4.0j])
    np.testing.assert_allclose(_phasors(expression, 2), [2.0, 0.0, 3.0, 0.0, 4.0j])
    static = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Coulomb(0.5, static_ratio=1.5)], omega=omega)
    with pytest.raises(ValueError, match="larger at rest than in motion"):
        contacts_of(Balance(static, Layout((0, 1), 1)))


def test_squares_and_energies(rng):
    c = np.array([0.5, 1.0 - 2.0j, 0.3j])
    theta = 2.0 * np.pi * np.arange(512) / 512
    assert _square(c, (0, 1, 2)) == pytest.approx((evaluate(c, theta) ** 2).mean())
    contact = Contact(np.ones(1), np.array([1.0, 0.5]), np.array([-0.5, 0.0]))
    s = np.array([0.2, 1.0, 0.5j])
    v, up, low = evaluate(s, theta), evaluate(contact.upper, theta), evaluate(contact.lower, theta)
    assert _mean_square(contact, s, 0.0) == pytest.approx((np.where(v > 0, up, low) ** 2).mean(), rel=2e-2)
    assert _mean_square(contact, s, 0.7) == pytest.approx((np.clip(v / 0.7, low, up) ** 2).mean(), rel=1e-3)
    C = np.array([[0.4, 0.1], [0.3, 0.5]])
    core = Balance(bf.System(np.eye(2), C, np.eye(2), [HarmonicForce(1.0)], omega=1.6), Layout((0, 1, 2), 2, 2))
    far, first = _energy(core, 0.3, 0.8)
    root = np.sqrt(np.diag(np.linalg.inv(0.5 * (C + C.T))))
    np.testing.assert_allclose(far, 0.3 * root * np.pi / (np.sqrt(3.0) * 0.8))
    np.testing.assert_allclose(first, 0.3 * root * np.sqrt(2.0) / 1.6)
    still = Balance(bf.System(np.eye(2), np.zeros((2, 2)), np.eye(2), [HarmonicForce(1.0)], omega=1.6), Layout((0, 1), 2))
    assert np.isinf(_energy(still, 0.3, 0.8)).all()


def test_a_short_slip_of_a_held_contact_is_its_impulse():
    """A force of 1.2 cos against the limit 1 in few harmonics: twice the excess over the mass, in half as long again."""
    core = Balance(bf.System(2.0, 0.1, 1.0, [HarmonicForce(1.0)], omega=0.8), Layout((0, 1), 1))
    contact = Contact(np.ones(1), np.ones(1, complex), -np.ones(1, complex))
    found = system_contacts._unresolved(core, contact, np.array([0.0, 1.2 + 0j]))
    count = 64 * grid_size(1)
    t, step = 2.0 * np.pi * np.arange(count) / count, 2.0 * np.pi / (0.8 * count)
    excess = np.maximum(1.2 * np.abs(np.cos(t)) - 1.0, 0.0)
    half = excess[(t > 0.5 * np.pi) & (t < 1.5 * np.pi)]  # one of the two parts that are alike
    moved = 2.0 * 1.5 * (half > 0.0).sum() * step * half.sum() * step
    np.testing.assert_allclose(found, 2.0 * moved / 2.0, rtol=1e-9)
    assert not system_contacts._unresolved(core, contact, np.array([0.0, 0.9 + 0j])).any()


@pytest.mark.parametrize("shift", [0.0, 0.2, 0.4, 1.0, 2.0, 2.9, 3.1, 4.5, 6.1])
def test_short_slips_are_counted_one_by_one_wherever_the_period_begins(shift):
    """A force of .5 + cos 2 t - .4 cos t against 1 exceeds it twice, differently long: impulse times duration of each, added."""
    core = Balance(bf.System(2.0, 0.1, 1.0, [HarmonicForce(1.0)], omega=0.8), Layout((0, 1, 2), 1))
    contact = Contact(np.ones(1), np.ones(1, complex), -np.ones(1, complex))
    found = system_contacts._unresolved(core, contact, np.array([0.5, -0.4 * np.exp(-1j * shift), np.exp(-2j * shift)]))
    count = 64 * grid_size(2)
    t, step = 2.0 * np.pi * np.arange(count) / count - shift, 2.0 * np.pi / (0.8 * count)
    excess = np.maximum(np.abs(0.5 + np.cos(2.0 * t) - 0.4 * np.cos(t)) - 1.0, 0.0)
    parts = [excess[np.cos(t) > 0.0], excess[np.cos(t) <= 0.0]]  # about t = 0 and about t = pi
    assert 0 < (parts[0] > 0.0).sum() < 0.8 * (parts[1] > 0.0).sum()
    moved = sum(1.5 * (part > 0.0).sum() * step * part.sum() * step for part in parts)
    np.testing.assert_allclose(found, 2.0 * moved / 2.0, rtol=1e-9)


def stand(kinds, instants):
    return Pattern(np.zeros(1), np.zeros(1), np.array(instants, float), np.array(kinds))


def test_the_last_iteration_is_tried_where_every_contact_reverses():
    ends = solution._reversing
    assert ends([stand([1, 0, -1, 0], [0, 1, 2, 3])]) and not ends([stand([1, 0, 1, 0], [0, 1, 2, 3])])
    assert not ends([stand([0], [])])  # nothing slips
    assert ends([stand([0], []), stand([1, 0, -1, 0], [0, 1, 2, 3])])
    assert ends([stand([1], []), stand([0], [])])  # one that slips all the time
    assert not ends([stand([1, 0, -1, 0], [0, 1, 2, 3]), stand([-1, 0, -1, 0], [0, 1, 2, 3])])


def test_widths_and_predictions():
    layout, omega = Layout((0, 1, 2), 2), 1.5
    M, C, K = np.diag([1.0, 2.0]), np.array([[0.3, 0.1], [0.0, 0.2]]), np.array([[2.0, -0.5], [-0.5, 3.0]])
    linear = Linear.of(layout, omega, M, C, K, np.zeros(layout.size))
    contact = Contact(np.array([1.0, -2.0]), np.array([0.4]), np.array([-0.4]))
    balance = SetValued(layout, omega, linear, [contact])
    row = contact.row
    size = [abs(row @ (K - (k * omega) ** 2 * M + 1j * k * omega * C) @ row) / (k * omega * (row @ row) ** 2) for k in (1, 2)]
    assert solution._natural_width(balance, linear.blocks, contact, 0.1) == pytest.approx(1.0 / max(size))
    assert solution._natural_width(balance, linear.blocks, contact, 2.0) == pytest.approx(5.0 / max(size))
    x = np.zeros(layout.size)
    assert solution._slow(balance, x, contact, 1e-3)
    x[layout.place(1, 0)[0]] = 0.3 / omega
    assert solution._slow(balance, x, contact, 0.301e-3 / 0.4) and not solution._slow(balance, x, contact, 0.299e-3 / 0.4)
    one, two = np.array([4.0]), np.array([2.0])
    for target, want in ((1.0, 1.0), (2.1, 2.0)):  # the line through (4, 4) and (2, 2), or the last
        fake = SimpleNamespace(residual=lambda at, widths, target=target: at - target)
        assert solution._predicted(fake, [(4.0, one), (2.0, two)], 1.0, two, None)[0] == want
    assert solution._predicted(fake, [(4.0, one)], 1.0, two, None) is two


def test_the_published_residual_takes_signs_at_samples(rng):
    layout, omega, H = Layout((0, 1, 2, 3), 2), 1.3, 40
    load = rng.standard_normal(layout.size)
    linear = Linear.of(layout, omega, np.eye(2), 0.2 * np.eye(2), np.diag([1.0, 2.0]), load)
    contact = Contact(np.array([1.0, -0.5]), np.array([0.7, 0.2j]), np.array([-0.3, 0.1]), np.array([0.1 + 0j]))
    balance = SetValued(layout, omega, linear, [contact])
    x = rng.standard_normal(layout.size)
    theta = 2.0 * np.pi * np.arange(1, H + 1) / H
    s = layout.values(layout.derivative(x), theta) @ contact.row * omega + 0.1
    r = np.where(s > 0.0, evaluate(contact.upper, theta), evaluate(contact.lower, theta))
    want = linear(x)[0] + np.outer(layout.basis(theta).T @ r * np.where(layout.waves == 0, 1.0, 2.0) / H, contact.row).ravel()
    np.testing.assert_allclose(Published(balance, H)(x), want, atol=1e-12)
    still = Contact(np.array([1.0, 0.0]), np.array([0.7 + 0j]), np.array([-0.3 + 0j]))
    np.testing.assert_allclose(Published(balance, H).force(np.zeros(layout.size), still), 0.2)  # at rest the middle
    apart = Contact(np.array([1.0, 0.0]), np.array([-0.1 + 0j]), np.array([0.3 + 0j]))
    np.testing.assert_allclose(Published(balance, H).force(x, apart), 0.0)
    with pytest.raises(ValueError, match="samples = 6 is not enough for harmonic 3; give at least 7"):
        Published(balance, 6)
    assert [item.value for item in FirstJacobian] == ["linear", "differences"]


def test_rest_with_two_contacts_beside_a_law():
    """Newton beside ties: a cubic spring carries a mean load; friction holds what varies, if it can."""
    system = bf.System(
        np.eye(2),
        0.1 * np.eye(2),
        np.diag([1.0, 2.0]),
        [HarmonicForce(0.3, dof=0), bf.elements.ConstantForce(0.8, dof=1), CubicSpring(0.5, dof=1), Coulomb(0.4, dof=0)],
        omega=1.1,
    )
    core = Balance(system, Layout((0, 1, 2), 2))
    balance = SetValued(core.layout, 1.1, rest_of(core), contacts_of(core))
    found = at_rest(balance, 1e-11, 30)
    assert found.status is SetValuedStatus.RESTS and found.success
    q = found.x[1]
    assert 2.0 * q + 0.5 * q**3 == pytest.approx(0.8, abs=1e-9) and np.abs(found.x[2:]).max() < 1e-10
    ((low, high),) = found.room  # the mean reaction may be shifted by what .3 cos leaves of .4
    assert low == pytest.approx(-0.1, abs=1e-9) and high == pytest.approx(0.1, abs=1e-9)
    tight = [Contact(c.row, 0.7 * c.upper, 0.7 * c.lower) for c in balance.contacts]
    assert at_rest(SetValued(core.layout, 1.1, rest_of(core), tight), 1e-11, 30) is None
    moving = [Contact(c.row, c.upper, c.lower, np.array([0.1 + 0j])) for c in balance.contacts]
    assert at_rest(SetValued(core.layout, 1.1, rest_of(core), moving), 1e-11, 30) is None


def test_the_splitting_finds_the_mean_of_an_asymmetric_contact():
    layout, omega = Layout(tuple(range(12)), 1), 0.7
    load = np.zeros(layout.size)
    load[1], load[0] = 1.5, 0.2
    contact = Contact(np.ones(1), np.array([0.6 + 0j]), np.array([-0.3 + 0j]))
    near = splitting(layout, omega, 1.2, 0.3, 1.4, load, [contact], iterations=3000, tolerance=1e-9)
    exact = solution.solve(layout, omega, Linear.of(layout, omega, 1.2, 0.3, 1.4, load), [contact])
    assert exact.success and near.change <= 1e-9 and near.iterations < 3000
    assert near.x[0] == pytest.approx(exact.x[0], abs=1e-8)  # as much slip to either side: the mean of both limits
    np.testing.assert_allclose(near.x, exact.x, atol=2e-2)
    assert near.forces.min() >= -0.3 and near.forces.max() <= 0.6
    assert splitting(layout, omega, 1.2, 0.3, 1.4, load, [contact], iterations=2).iterations == 2


@pytest.mark.parametrize("drift", [5.0, -5.0])
def test_the_splitting_carries_a_mass_along_with_a_fast_belt(drift):
    """It slips one way all the time: a constant force, and the linear response about the place to which it moves the mass."""
    layout, omega = Layout((0, 1, 2), 1), 0.7
    load = layout.pack({0: [0.2 + 0j], 1: [1.5 - 0.5j]})
    belt = Contact(np.ones(1), np.array([0.6 + 0j]), np.array([-0.3 + 0j]), np.array([drift + 0j]))
    found = splitting(layout, omega, 1.2, 0.3, 1.4, load, [belt], iterations=3000, tolerance=1e-12)
    force = 0.6 if drift > 0.0 else -0.3
    np.testing.assert_allclose(found.forces, force, rtol=0, atol=1e-9)
    wanted = layout.pack({0: [(0.2 - force) / 1.4 + 0j], 1: [(1.5 - 0.5j) / (1.4 - 1.2 * omega**2 + 0.3j * omega)]})
    np.testing.assert_allclose(found.x, wanted, rtol=0, atol=1e-9)


def test_the_splitting_on_a_base_that_shakes_is_that_beside_it():
    """q = z + b(t): friction against the base is friction at rest in z, and the base takes part in the load."""
    layout, omega, base = Layout((0, 1, 3), 1), 0.7, 0.4 - 0.3j
    load, limits = np.array([1.5 - 0.5j]), (np.array([0.3 + 0j]), np.array([-0.3 + 0j]))
    options = {"iterations": 4000, "tolerance": 1e-10}
    moved = splitting(layout, omega, 1.2, 0.3, 1.4, layout.pack({1: load}), [
        Contact(np.ones(1), *limits, np.array([0.0, -1j * omega * base]))], **options)
    still = splitting(layout, omega, 1.2, 0.3, 1.4, layout.pack({1: load - (1.4 - 1.2 * omega**2 + 0.3j * omega) * base}), [
        Contact(np.ones(1), *limits)], **options)
    np.testing.assert_allclose(moved.x, still.x + layout.pack({1: [base]}), rtol=0, atol=1e-8)


@pytest.mark.parametrize("harmonics, periods", [(tuple(range(8)), 1), ((1, 3, 5, 7), 1), ((0, 1, 2, 4), 2)])
def test_the_splitting_balances_every_harmonic_that_is_listed(harmonics, periods):
    """Of two masses: K q - w^2 M q + i w C q = load - forces, with the forces that are within the bounds."""
    layout, omega = Layout(harmonics, 2, periods), 0.9
    M, C, K = np.array([[1.0, 0.2], [0.2, 2.0]]), np.array([[0.4, -0.1], [0.0, 0.3]]), np.array([[3.0, -1.0], [-1.0, 2.0]])
    load = layout.pack({periods: [1.2 - 0.4j, 0.3j]} | ({0: [0.1, -0.2]} if layout.mean else {}))
    contacts = [Contact(np.array(row), np.array([up + 0j]), np.array([low + 0j]))
                for row, up, low in (([1.0, -1.0], 0.4, -0.4), ([0.0, 1.0], 0.2, -0.2))]
    near = splitting(layout, omega, M, C, K, load, contacts, iterations=5000, tolerance=1e-8)
    assert near.change <= 1e-8
    spectrum = np.fft.rfft(near.forces, axis=1) / near.forces.shape[1]
    for k in harmonics:
        w = k * omega / periods
        q, F = (np.array([layout.phasor(x, k, dof) for dof in range(2)]) for x in (near.x, load))
        force = (spectrum[:, k] * (2.0 if k else 1.0)) @ [contact.row for contact in contacts]
        np.testing.assert_allclose((K - w * w * M + 1j * w * C) @ q, F - force, rtol=0, atol=1e-7)
    assert np.abs(near.forces[0]).max() <= 0.4 and np.abs(near.forces[1]).max() <= 0.2


@pytest.mark.parametrize("harmonics", [(0, 1, 2, 3), (1, 3)])
def test_what_lost_speeds_change_in_the_force_of_friction_is_taken_from_the_equations(harmonics, rng):
    """A force of speed over width within its bounds, with and without the speeds beyond the harmonics, by its values over a period:
    the Newton step times the Jacobian is its change on the row of the contact."""
    count, width, row = 2**15, 0.3, np.array([1.0, -0.5])
    system = bf.System(np.eye(2), 0.1 * np.eye(2), np.array([[2.0, -0.4], [-0.4, 1.0]]), [HarmonicForce(1.0)], omega=0.9)
    layout = Layout(harmonics, 2)
    core = Balance(system, layout)
    balance = SetValued(layout, 0.9, rest_of(core), [Contact(row, np.array([0.6 + 0j]), np.array([-0.3 + 0j]))])
    speed, tail = rng.standard_normal((2, 7)) + 1j * rng.standard_normal((2, 7))
    speed, tail = speed * [0, 1, 0, 1, 0, 0, 0], 0.3 * tail * [0, 1, 1, 1, 1, 1, 1]
    theta = 2.0 * np.pi * np.arange(count) / count
    here, both = (sum((a[k] * np.exp(1j * k * theta)).real for k in range(7)) for a in (speed, speed + tail))
    change = np.fft.rfft(np.clip(both / width, -0.3, 0.6) - np.clip(here / width, -0.3, 0.6)) / count
    wanted = layout.pack({k: (2.0 if k else 1.0) * change[k] * row for k in harmonics})
    result = SimpleNamespace(x=rng.standard_normal(layout.size), widths=[width])
    step = system_contacts._step(core, balance, result, [speed], [tail])
    jacobian = balance.both(result.x, result.widths)[1]
    assert np.abs(wanted).max() > 1e-2
    np.testing.assert_allclose(jacobian @ step, wanted, rtol=0, atol=1e-6)


@pytest.mark.parametrize("samples", [0, 8, 64])
@pytest.mark.parametrize("harmonics", [(0, 1, 2, 3), (1, 3)])
def test_what_a_cubic_spring_excites_beyond_the_harmonics_comes_back_to_them(harmonics, samples, rng):
    """The lost harmonics of its force move the mass, and change the force; by sums over 512 samples."""
    M, C, K, cubic, omega = 1.3, 0.2, 1.1, 0.7, 0.9
    layout = Layout(harmonics, 1)
    x = 0.5 * rng.standard_normal(layout.size)
    theta = 2.0 * np.pi * np.arange(512) / 512
    u = layout.values(x, theta)[:, 0]
    further = u.copy()
    force = np.fft.rfft(cubic * u**3) / 256
    for k in system_contacts.longer(layout).harmonics:
        if k not in harmonics and k > 0:
            w = omega * k
            further -= (force[k] / (K - w * w * M + 1j * w * C) * np.exp(1j * k * theta)).real
    change = layout.analysis(cubic * (further**3 - u**3))
    core = Balance(bf.System(M, C, K, [HarmonicForce(0.8), CubicSpring(cubic)], omega=omega), layout, samples)
    assert np.abs(change).max() > 1e-4
    np.testing.assert_allclose(system_contacts._law_change(core, x), change, rtol=0, atol=1e-13)


def test_springs_on_a_base_that_moves_about_a_place_on_a_belt(rng):
    """Folded into stiffness, damping and load: the forces at any state are those of u = R q + b, s = R q' + b' + drift."""
    omega, element = 1.3, Shaken()
    M, C, K = np.diag([1.0, 2.0]), np.array([[0.3, 0.1], [0.0, 0.2]]), np.array([[2.0, -0.4], [-0.4, 1.0]])
    layout = Layout((0, 1, 2), 2)
    T = split(bf.System(M, C, K, [element], omega=omega), layout).numbers
    R, drift, theta = np.array([[1.0, -0.5], [0.0, 2.0]]), np.array([0.6, -0.9]), np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
    b = np.array([0.4 + 0.5 * np.cos(theta + 0.3), -0.1 + 0.2 * np.cos(2.0 * theta - 0.8)])
    rate = omega * np.array([-0.5 * np.sin(theta + 0.3), -0.4 * np.sin(2.0 * theta - 0.8)])
    q, v = rng.standard_normal((2, 2, 8))
    u, s = R @ q + b, R @ v + rate + drift[:, None]
    f = np.array([-0.7 * u[0] - 0.3 * s[0] - 0.1 * u[1] + 0.05 * s[1], -1.4 * u[1] - 0.15 * s[1] + 0.3 * np.cos(theta + 1.1) + 0.2])
    load = layout.values(T.E.ravel(), theta).T
    np.testing.assert_allclose(load - (T.K - K) @ q - (T.C - C) @ v, R.T @ f, atol=1e-13)
    assert np.array_equal(T.M, M) and T.omega[0] == omega


# propagators


def test_exponentials_and_steps_of_order_six(rng):
    out = np.empty((4, 4))
    for scale in (0.0, 0.01, 0.4, 3.0, 60.0):
        a = scale * rng.standard_normal((4, 4)) / 4.0
        monodromy.exponential(a.copy(), out, np.empty((4, 4, 4)))
        np.testing.assert_allclose(out, expm(a), rtol=1e-10, atol=1e-12 * np.abs(expm(a)).max())
    A0, A1, A2 = rng.standard_normal((3, 3, 3))
    size = []
    for h in (0.4, 0.2):
        A = np.array([A0 + t * h * A1 + (t * h) ** 2 * A2 for t in monodromy.NODES])
        exact = (
            solve_ivp(
                lambda t, y: ((A0 + t * A1 + t * t * A2) @ y.reshape(3, 3)).ravel(),
                (0.0, h),
                np.eye(3).ravel(),
                rtol=1e-12,
                atol=1e-13,
            )
            .y[:, -1]
            .reshape(3, 3)
        )
        found = np.empty((3, 3))
        monodromy.magnus(A, h, found)
        size.append(np.abs(found - exact).max())
    assert size[0] < 1e-4 and size[0] / size[1] > 50.0  # 2^7 a step


def test_cuts_of_a_period():
    ends = np.array([[[1.0, 0.0], [4.0, 0.0], [2.0 * np.pi, 0.0]], [[np.pi, 0.0], [2.0 * np.pi, 0.0], [9.0, 9.0]]])
    counts = np.array([[3, 1], [2, 1]])
    np.testing.assert_allclose(monodromy.cuts_of(ends, counts, 1), [0.0, 1.0, np.pi, 4.0, 2.0 * np.pi])
    np.testing.assert_allclose(monodromy.cuts_of(ends, counts, 4), [0.0, 1.0, 0.5 * np.pi, np.pi, 4.0, 1.5 * np.pi, 2.0 * np.pi])


def test_multipliers_are_in_order_and_statuses_say_why_there_are_none():
    mu = ordered([0.3, -0.9, 0.5 + 0.5j, 0.5 - 0.5j, 0.9])
    np.testing.assert_allclose(mu, [0.9, -0.9, 0.5 + 0.5j, 0.5 - 0.5j, 0.3])
    both = ordered([[0.1, 2.0], [-3.0, 1.0]])
    np.testing.assert_allclose(both, [[2.0, 0.1], [-3.0, 1.0]])
    held = Balance(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Coulomb(0.5)], omega=1.0), Layout((0, 1), 1))
    assert multipliers_of(held, np.zeros(3))[0] is StabilityStatus.SET_VALUED
    slider = Balance(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Jenkins(1.0, 0.5)], omega=1.0), Layout((0, 1), 1))
    assert multipliers_of(slider, np.full(3, np.nan))[0] is StabilityStatus.NOT_FOLLOWED
    status, P = monodromy_of(slider, np.array([0.0, 0.2, 0.1]))
    assert status is StabilityStatus.KNOWN and P.shape == (2, 2)  # memory that is not written is no state
    np.testing.assert_allclose(P, expm(np.array([[0.0, 1.0], [-2.0, -0.1]]) * 2.0 * np.pi), atol=1e-11)


@pytest.mark.parametrize(
    ("element", "said"),
    [
        (RigidStop(1.0, 0.5), "gives an impulse"),
    ],
)
def test_what_has_no_fourier_series_is_refused(element, said):
    with pytest.raises(ValueError, match=said):
        split(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), element], omega=1.0), Layout((0, 1), 1))
    assert listed([0, 1, 3]) == (0, 1, 3)
