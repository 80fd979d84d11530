"""States of rest and orbits in Fourier series against linear algebra, the Hopf normal form, sums over samples and exact orbits."""

import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, ElasticStop, Force, HarmonicForce, Jenkins, RigidStop
from bifurc.orbits.balance.find import HarmonicBalance
from bifurc.orbits.balance.harmonic_orbit import HarmonicOrbit, largest
from bifurc.orbits.equilibria import equilibrium, hopf
from bifurc.orbits.equilibria.equilibrium import EquilibriumStatus

M, C, K = np.array([[2.0, 0.3], [0.3, 1.0]]), np.array([[0.2, -0.1], [0.05, 0.3]]), np.array([[3.0, -1.0], [-0.8, 2.0]])


def eigenvalues(stiffness, damping=C, mass=M):
    n = len(mass)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    found = np.linalg.eigvals(A).astype(complex)
    return found[np.lexsort((-found.imag, -found.real.round(13)))]


def test_rest_under_a_load_on_an_elastic_stop():
    """Behind the gap the stop adds its stiffness and dashpot; before it, it is away."""
    stop = ElasticStop(0.1, 5.0, 0.4, dof=1)
    for load, touches in ((0.1, False), (2.0, True)):
        rest = bf.find_equilibrium(bf.System(M, C, K, [ConstantForce(load, dof=1), stop]))
        added = np.diag([0.0, 5.0]) * touches
        q = np.linalg.solve(K + added, [0.0, load + 0.5 * touches])
        assert (
            rest.success and rest.state == pytest.approx([*q, 0.0, 0.0], abs=1e-13) and rest.status is EquilibriumStatus.CONVERGED
        )
        assert rest.eigenvalues == pytest.approx(eigenvalues(K + added, C + np.diag([0.0, 0.4]) * touches), rel=1e-10)
        assert rest.stable is True and rest.contacts == {
            "constant_force": "always",
            "elastic_stop": "contact" if touches else "free",
        }
        assert rest.residual < 1e-14 and rest.sections.shape == (1, 4) and rest.message == rest.status.sentence
        assert rest.autonomous and rest.regime == "at rest" and rest.multipliers is None and not len(rest.continuum)
        assert repr(rest).startswith("Equilibrium(q=[") and repr(rest).endswith("stable, converged)")
        state = rest.state
        state[:] = 9.0
        assert rest.state[0] != 9.0 and rest.parameters == rest.system.parameters
    again = equilibrium.Equilibrium.from_record(*rest.to_record())
    assert np.array_equal(again.state, rest.state) and again.mode == rest.mode
    unstable = bf.find_equilibrium(bf.System(M, -C, K))
    assert unstable.stable is False and bf.find_equilibrium(bf.System(M, 0.0 * C, np.eye(2))).stable is None


def test_rest_on_a_rigid_stop():
    """What the stop holds has no motion: two eigenvalues are left, those of the other mass."""
    rest = bf.find_equilibrium(bf.System(M, C, K, [ConstantForce(3.0, dof=1), RigidStop(0.2, dof=1)]))
    assert rest.contacts["rigid_stop"] == "rest" and rest.state[1] == pytest.approx(0.2, abs=1e-15)
    assert rest.state[0] == pytest.approx(0.2 / 3.0, rel=1e-13)
    assert rest.eigenvalues == pytest.approx(eigenvalues(K[:1, :1], C[:1, :1], M[:1, :1]), rel=1e-10) and rest.stable
    pushed = bf.find_equilibrium(bf.System(1.0, 0.1, 1.0, [RigidStop(-0.3)]))  # preloaded by .3
    assert pushed.state.tolist() == [-0.3, 0.0] and pushed.eigenvalues.size == 0 and pushed.stable
    touching = bf.find_equilibrium(bf.System(1.0, 0.1, 1.0, [RigidStop(0.0)]))
    assert (
        touching.on_boundary == ["rigid_stop"]
        and touching.stable is None
        and "lies on the boundary of two modes of rigid_stop" in (touching.message)
    )


def test_continua_and_their_ends():
    """A mass held by friction .3 on a spring of 2 under a load of 1: it may stand from .35 to .65."""
    system = bf.System(1.0, 0.1, 2.0, [ConstantForce(1.0), Coulomb(0.3)])
    for guess, stands in ((0.4, 0.4), (0.6, 0.6), (5.0, None), (-3.0, None)):
        rest = bf.find_equilibrium(system, [guess])
        assert rest.success
        if stands is not None:
            assert rest.status is EquilibriumStatus.CONTINUUM and rest.state[0] == stands and rest.stable
            assert rest.intervals == {0: (pytest.approx(0.35), pytest.approx(0.65))}
            assert "Coordinate 0 may stand in [0.35, 0.65]." in rest.message and rest.eigenvalues.size == 0
            assert np.abs(rest.continuum) == pytest.approx(np.array([[1.0, 0.0]]))
    slider = bf.find_equilibrium(bf.System(1.0, 0.1, 2.0, [ConstantForce(1.0), Jenkins(3.0, 0.6)]), [0.25])
    assert slider.status is EquilibriumStatus.CONTINUUM and slider.contacts["jenkins"] == "stick"
    q, w = slider.state[0], slider.state[2]
    assert 5.0 * q - 3.0 * w == pytest.approx(1.0, abs=1e-13) and abs(3.0 * (q - w)) <= 0.6
    assert slider.eigenvalues == pytest.approx(eigenvalues(np.array([[5.0]]), np.array([[0.1]]), np.eye(1)))


def test_no_rest():
    dragged = bf.find_equilibrium(bf.System(1.0, 0.0, 0.0, [ConstantForce(1.0)]))
    assert not dragged.success and dragged.status is EquilibriumStatus.NOT_FOUND and dragged.stable is None
    assert dragged.message == EquilibriumStatus.NOT_FOUND.sentence and dragged.intervals == {}
    caught = bf.find_equilibrium(bf.System(1.0, 0.1, -1.0, [ConstantForce(1.0), RigidStop(-5.0), RigidStop(4.0, side=-1)]), [-4.5])
    assert caught.success is (caught.status in ("converged", "continuum"))
    for given, words in (
        (np.zeros(3), "guess has shape .3,.; it must be .2,. positions, or a state .4,."),
        ([np.nan, 0.0], "must be"),
    ):
        with pytest.raises(ValueError, match=words):
            bf.find_equilibrium(bf.System(M, C, K), given)
    with pytest.raises(ValueError, match="has an excitation of frequency 1.5 and no state of rest"):
        bf.find_equilibrium(bf.System(1.0, 0.1, 1.0, [HarmonicForce()], omega=1.5))
    moving = bf.find_equilibrium(bf.System(M, C, K, [ConstantForce(1.0)]), [1.0, 2.0, 5.0, -5.0])
    assert moving.state[:2] == pytest.approx(np.linalg.solve(K, [1.0, 0.0])) and not moving.state[2:].any()


def van_der_pol(u, s, mu, a, b):
    return (mu - a * u * u) * s - b * u * u * u


def test_the_hopf_point_of_van_der_pol():
    """x'' + x = (mu - a x^2) x' - b x^3 has r' = mu r / 2 - a r^3 / 8, whatever b, for the amplitude of x."""
    for a, b in ((1.0, 0.0), (2.5, 0.7), (-0.8, 0.3)):
        system = bf.System(1.0, 0.0, 1.0, [Force(van_der_pol, mu=0.0, a=a, b=b)])
        rest = bf.find_equilibrium(system)
        assert rest.lyapunov_coefficient() == pytest.approx(-a / 8.0, rel=1e-6)
    away = bf.find_equilibrium(system.with_parameters(mu=0.1))
    with pytest.raises(ValueError, match="the pair nearest to the imaginary axis is .*: this is no Hopf point"):
        away.lyapunov_coefficient()
    with pytest.raises(ValueError, match="dof = 1 is not allowed; it must be a whole number, at least 0 and at most 0"):
        rest.lyapunov_coefficient(1)
    with pytest.raises(ValueError, match="no pair of eigenvalues is complex"):
        hopf.critical_pair(np.diag([-1.0, -2.0]))
    A = np.array([[0.0, -2.0, 0.3], [2.0, 0.0, 0.1], [0.0, 0.0, -1.0]])
    omega, q, p = hopf.critical_pair(A)
    assert omega == pytest.approx(2.0) and A @ q == pytest.approx(2j * q) and A.T @ p == pytest.approx(-2j * p)
    assert np.vdot(p, q) == pytest.approx(1.0)



def test_the_hopf_coefficient_in_either_coordinate():
    """The oscillation of the first mass drives the second, whose amplitude is |H| r."""
    law = Force(van_der_pol, mu=0.0, a=1.5, b=0.2)
    rest = bf.find_equilibrium(bf.System(np.eye(2), np.diag([0.0, 0.3]), np.array([[1.0, 0.0], [-2.0, 5.0]]), [law]))
    for dof, part in enumerate((1.0, abs(2.0 / (4.0 + 0.3j)))):
        assert rest.lyapunov_coefficient(dof) == pytest.approx(-1.5 / 8.0 / part**2, rel=1e-6)


@pytest.mark.parametrize(("decay", "accuracy"), [(0.05, 1e-6), (0.2, 1e-9)])
def test_the_hopf_coefficient_of_a_law_that_bends_within_a_small_part_of_the_motion(decay, accuracy):
    """x'' + x = g(x') with cubic term c x'^3 has r' = 3 c r^3 / 8, whatever the quadratic one, which alone gives a centre: where
    friction falls like exp(-v / decay), zeta r^3 / (8 decay^2) at the Hopf point, however far from it the field is sampled."""
    speed = 2.0 * decay
    zeta = math.exp(-speed / decay) / (2.0 * decay)
    rest = bf.find_equilibrium(bf.systems.belt_oscillator(zeta=zeta, belt_speed=speed, static=1.3, kinetic=0.3, law="exponential",
                                                          decay_speed=decay))
    assert rest.lyapunov_coefficient() == pytest.approx(zeta / (8.0 * decay**2), rel=accuracy)


def test_forms_of_second_and_third_derivatives(rng):
    """Of a field with quadratic and cubic terms, at complex directions."""
    T2, T3 = rng.normal(size=(3, 3, 3)), rng.normal(size=(3, 3, 3, 3))

    def field(c):
        return np.einsum("ijk,j,k->i", T2, c, c) + np.einsum("ijkl,j,k,l->i", T3, c, c, c) + c

    B = T2 + T2.transpose(0, 2, 1)
    C3 = sum(T3.transpose(0, *order) for order in ((1, 2, 3), (1, 3, 2), (2, 1, 3), (2, 3, 1), (3, 1, 2), (3, 2, 1)))
    forms = hopf.Forms(field, 3, 0.4)
    u, v = rng.normal(size=(2, 3)) + 1j * rng.normal(size=(2, 3))
    assert forms.B(u, v) == pytest.approx(np.einsum("ijk,j,k->i", B, u, v), rel=1e-9)
    assert forms.C(u) == pytest.approx(np.einsum("ijkl,j,k,l->i", C3, u, u, u.conj()), rel=1e-8)
    assert not forms.along(np.zeros(3)).any()


# ---- orbits in Fourier series --------------------------------------------------------------------------------------------------

PAIR = bf.System(
    M,
    C,
    K,
    [
        HarmonicForce(1.4, phase=0.6),
        HarmonicForce(0.3, 2, -0.4, dof=1),
        ConstantForce(0.2),
        CubicSpring(0.3),
        ElasticStop(0.3, 2.0, dof=1),
        Jenkins(0.6, 0.2),
    ],
    omega=1.1,
)


@pytest.fixture(scope="module")
def series():
    found = bf.find_orbit(PAIR, method=HarmonicBalance(30))
    assert found.success, found.message
    return found


def test_a_linear_series_is_the_response():
    """Two loads, a mean, unsymmetric matrices: every harmonic by its dynamic stiffness."""
    system = bf.System(M, C, K, PAIR.elements[:3], omega=1.1)
    orbit = bf.find_orbit(system, method=HarmonicBalance((0, 1, 2, 5)))
    for h, load in ((1, [1.4 * np.exp(0.6j), 0.0]), (2, [0.0, 0.3 * np.exp(-0.4j)]), (5, [0.0, 0.0])):
        w = 1.1 * h
        known = np.linalg.solve(K - w**2 * M + 1j * w * C, load)
        assert [orbit.harmonic(h, dof) for dof in (0, 1)] == pytest.approx(list(known), abs=1e-13)
    assert [orbit.harmonic(0, dof) for dof in (0, 1)] == pytest.approx(list(np.linalg.solve(K, [0.2, 0.0])), abs=1e-13)
    assert orbit.signature == "no contacts" and orbit.events == () and orbit.stable
    exact = bf.find_orbit(system)
    assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(exact.multipliers), rel=1e-6)
    assert orbit.harmonic(3) == 0.0 and orbit.rate == pytest.approx(1.1) and orbit.period == pytest.approx(system.period)


def test_measures_of_a_series(series):
    t, y = series.sample(4001)
    assert t[-1] == pytest.approx(series.period) and y.shape == (4001, 5) and y[0] == pytest.approx(y[-1], abs=1e-9)
    assert series.state == pytest.approx(y[0], abs=1e-12)
    for dof in (0, 1):
        q = y[:-1, dof]
        assert series.rms(dof) == pytest.approx(np.sqrt(np.mean(q**2)), rel=1e-12)
        assert series.maximum(dof) == pytest.approx(q.max(), abs=1e-6) and series.maximum(dof) >= q.max() - 1e-12
        assert series.minimum(dof) == pytest.approx(q.min(), abs=1e-6) and series.minimum(dof) <= q.min() + 1e-12
        for h in (0, 1, 4):
            known = (1 if h == 0 else 2) * np.mean(q * np.exp(-1j * h * 1.1 * t[:-1]))
            assert series.harmonic(h, dof) == pytest.approx(complex(known), abs=1e-12)
        speed = np.gradient(y[:, dof], t, edge_order=2)
        assert y[:, 2 + dof] == pytest.approx(speed, abs=2e-4)


def test_a_series_is_near_the_exact_orbit(series):
    exact = bf.find_orbit(PAIR, guess=series)
    assert exact.success and exact.how["polished"] == "the harmonic orbit given as guess"
    error = max(abs(series.harmonic(1, dof) - exact.harmonic(1, dof)) for dof in (0, 1))
    assert exact.how["error of its first harmonic"] == pytest.approx(error) and error < 1e-4
    t, y = series.sample(50)
    assert y[:, :2] == pytest.approx(exact.sample(50)[1][:, :2], abs=3e-3)
    assert y[:, 4] == pytest.approx(exact.sample(50)[1][:, 4], abs=2e-2)
    own, other = ([(e.element, str(e.kind)) for e in found.events] for found in (series, exact))
    assert own == other and [e.time for e in series.events] == pytest.approx([e.time for e in exact.events], abs=2e-2)
    assert series.multipliers[:2] == pytest.approx(exact.multipliers[:2], abs=2e-2) and series.stable is exact.stable
    assert max(series.how["error"]) < 0.1 and "elastic_stop: " in series.signature and "jenkins: " in series.signature


def test_series_in_files_and_other_layouts(series, tmp_path):
    series.save(tmp_path / "s.npz")
    again = bf.load(tmp_path / "s.npz")
    assert np.array_equal(again.coefficients, series.coefficients) and again.system == series.system and again.how == series.how
    assert again.method == series.method and again.layout.harmonics == series.layout.harmonics and again.status == series.status
    assert repr(series).startswith("HarmonicOrbit(31 harmonics up to 30, converged, residual ") or "harmonics up to 30" in repr(
        series
    )
    copied = series.coefficients
    copied[:] = 0.0
    assert series.coefficients.any()
    fewer = bf.find_orbit(PAIR, guess=series, method=HarmonicBalance(12))
    assert fewer.success and fewer.harmonic(1) == pytest.approx(series.harmonic(1), abs=5e-3)
    lost = HarmonicOrbit(PAIR, series.method, series.layout, 0.0 * series.coefficients)
    assert not lost.success and lost.stable is None and lost.multipliers is None and lost.residual > 1e-3


def test_the_largest_value_of_a_polynomial(rng):
    layout = HarmonicBalance((0, 1, 2, 5)).layout(1)
    theta = np.linspace(0.0, 2.0 * np.pi, 200001)
    for _ in range(5):
        a = rng.normal(size=len(layout.waves))
        assert largest(layout, a) == pytest.approx((layout.basis(theta) @ a).max(), abs=1e-8)


@pytest.mark.parametrize(
    "given, words",
    [
        ({"aft": "fft"}, "aft = 'fft'"),
        ({"solver": "secant"}, "solver = 'secant'"),
        ({"samples": 2}, "samples = 2"),
        ({"tolerance": 0.0}, "tolerance = 0.0 is not allowed; it must be above 0 and at most 0.1"),
        ({"tolerance": 1.0}, "tolerance = 1.0"),
        ({"tolerance": "x"}, "tolerance = 'x'"),
        ({"condense": 3}, "condense = 3"),
        ({"harmonics": "all"}, "harmonics = 'all'"),
    ],
)
def test_options_that_are_none(given, words):
    with pytest.raises(ValueError, match=words):
        HarmonicBalance(**given)


def test_options_go_through_their_record():
    for method in (HarmonicBalance(), HarmonicBalance((0, 1, 0.5), "sampled", 64, "broyden", 1e-3, True), HarmonicBalance("auto")):
        assert HarmonicBalance.from_record(method.to_record()) == method
    assert HarmonicBalance((1.0, 0.5)).harmonics == (1, 0.5) and HarmonicBalance("auto").layout(2).top == 7
    with pytest.raises(ValueError, match="method = 3 is not allowed; it must be a HarmonicBalance"):
        bf.find_orbit(PAIR, method=3)
    with pytest.raises(ValueError, match="is autonomous; harmonic balance needs an excitation frequency"):
        bf.find_orbit(bf.systems.belt_oscillator(), method=HarmonicBalance())
    with pytest.raises(ValueError, match="guess has shape .3,.; it must be an orbit, packed coefficients"):
        bf.find_orbit(PAIR, np.zeros(3), method=HarmonicBalance(5))
