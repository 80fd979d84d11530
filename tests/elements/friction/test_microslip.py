"""Sets of sliders: order of slip, virgin curve, parallel equivalent, bad input."""
import numpy as np
import pytest

from bifurc.elements import Driven, Iwan, Jenkins, MicroSlip, RigidStop
from tests.reference import microslip as reference


def random_chain(rng, n, closed):
    return MicroSlip(float(rng.uniform(0.5, 5.0)), float(rng.uniform(0.5, 5.0)), tuple(rng.uniform(0.2, 2.0, n)), closed)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("n", [1, 2, 3, 8])
def test_virgin_curve_is_that_of_an_implicit_solve(rng, n, closed):
    bar = random_chain(rng, n, closed)
    drive = np.linspace(0.0, 1.2 * bar.thresholds[-1], 200)  # loading is path independent: steps of any size are exact
    force, sliders = reference.chain(drive, np.tile(bar.limits, (200, 1)), bar.spring, bar.contact, closed)
    assert np.allclose(bar.virgin_force(drive), force, rtol=0.0, atol=1e-12 * force.max())
    moved = [(np.abs(sliders[:, i]) > 1e-12 * drive[-1]).argmax() for i in range(n)]
    assert [group[0] for group in bar.order] == list(np.argsort(moved, kind="stable")) or len(set(moved)) < n
    assert bar.virgin_force(drive[-1]) == pytest.approx(sum(bar.limits), rel=1e-13)


@pytest.mark.parametrize("closed", [False, True])
def test_a_chain_equals_its_parallel_set(rng, closed):
    bar = random_chain(rng, 9, closed)
    flat = bar.iwan()
    assert min(flat.stiffnesses) > 0.0
    assert flat.thresholds == pytest.approx(bar.thresholds, rel=1e-12)
    drive = np.linspace(0.0, 1.1 * bar.thresholds[-1], 50)
    assert np.allclose(flat.virgin_force(drive), bar.virgin_force(drive), rtol=0.0, atol=1e-12 * sum(bar.limits))


@pytest.mark.parametrize("spring", [1e6, 1e8, 1e10])
@pytest.mark.parametrize("n", [15, 60])
@pytest.mark.parametrize("closed", [False, True])
def test_a_stiff_chain_is_one_block(rng, n, closed, spring):
    """Contacts side by side: the sum of their stiffnesses, less a part contact n^2 / spring, and of their limits; stiff springs
    leave much rounding when all slip, and no force."""
    bar = MicroSlip(spring, 1.0, tuple(rng.uniform(0.5, 1.0, n) / n), closed)
    flat = bar.iwan()
    assert sum(flat.stiffnesses) == pytest.approx(n, rel=n * n / spring + 1e-6)
    assert sum(flat.limits) == pytest.approx(sum(bar.limits), rel=n * n / spring + 1e-6)
    assert flat.virgin_force(1.0) == pytest.approx(sum(bar.limits), rel=n * n / spring + 1e-6)


def test_symmetric_contacts_slip_together():
    ring = MicroSlip(3.0, 1.0, (0.5,) * 7, closed=True)
    assert ring.order == ((0,), (1, 6), (2, 5), (3, 4))
    assert len(MicroSlip(3.0, 1.0, (0.5,) * 8, closed=True).order) == 5
    assert Iwan((1.0, 2.0, 4.0), (1.0, 2.0, 2.0)).order == ((2,), (0, 1))


def test_the_virgin_curve_converges_to_the_bar():
    """First order in the block length: the drive sits half a block behind the end."""
    span, drive = 3.0, np.array([0.5, 1.5, 3.0, 5.0, 6.0])
    errors = []
    for n in (20, 40, 80, 160):
        contact = 1.0 / n  # elastic limit of displacement 1, friction force 1
        bar = MicroSlip(contact * (n / span) ** 2, contact, (1.0 / n,) * n)
        errors.append(np.abs(bar.virgin_force(drive) - reference.bar_force(drive, span)).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.allclose(orders, 1.0, atol=0.1)
    assert errors[-1] < 5e-3


def test_contacts_without_a_limit_are_absent():
    assert Iwan((1.0, 2.0), (0.0, 1.0)).virgin_force([0.25, 1.0]) == pytest.approx([0.5, 1.0])
    nothing = MicroSlip(1.0, 1.0, (0.0, 0.0))
    assert nothing.order == () and nothing.virgin_force(1.0) == 0.0
    assert nothing.start == ("stick",)
    one_sided = MicroSlip(1.0, 1.0, (0.0, 1.0))  # spring and contact in series
    assert one_sided.virgin_force(0.5) == pytest.approx(0.25)


@pytest.mark.parametrize("make, words", [
    (lambda: Iwan((), ()), r"limits = \(\) is not allowed; it must be a list of finite numbers, at least one"),
    (lambda: MicroSlip(1.0, 1.0, ()), r"limits = \(\) is not allowed"),
    (lambda: Iwan((1.0, 0.0), (1.0, 1.0)), r"stiffnesses\[1\] = 0.0 is not allowed; it must be a finite number above 0"),
    (lambda: Iwan((1.0,), (1.0, 1.0)), "1 stiffnesses and 2 limits"),
    (lambda: Iwan((1.0,), (-1.0,)), r"limits\[0\] = -1.0 is not allowed; it must be a finite number, at least 0"),
    (lambda: MicroSlip(0.0, 1.0, (1.0,)), "spring = 0.0 is not allowed"),
    (lambda: MicroSlip(1.0, -1.0, (1.0,)), "contact = -1.0 is not allowed"),
    (lambda: MicroSlip(1.0, 1.0, 3.0), "limits = 3.0 is not allowed"),
    (lambda: Driven(1.0), "element = 1.0 is not allowed"),
    (lambda: Driven(RigidStop()).mode("free", None), "stops or holds its coordinate, which is prescribed"),
])
def test_bad_input_is_named(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_parameters_of_a_driven_element_reach_it():
    driven = Driven(Jenkins(2.0, 0.5), 0.3)
    assert driven.with_parameters(limit=0.7, amplitude=0.1).parameters == {
        "amplitude": 0.1, "phase": 0.0, "stiffness": 2.0, "limit": 0.7}
    assert driven.label == "jenkins"
