"""Reductions of beams of 20 to 1000 elements, in metres and kilograms and in millimetres and tonnes, against closed forms."""
from fractions import Fraction

import numpy as np
import pytest
from scipy.linalg import eigh

import bifurc as bf
from bifurc.structure.checks import checked
from bifurc.structure.reduction import METHODS, reduce
from bifurc.structure.statics import Held, product
from tests.reference.beam import beam, wave_numbers

COUNTS = (20, 50, 100, 200, pytest.param(450, marks=pytest.mark.slow), pytest.param(1000, marks=pytest.mark.slow))
#        length, E, density, width and height: a steel beam in m, kg and in mm, t
UNITS = {"m": (1.3, 2.1e11, 7.8e3, 0.05, 0.01), "mm": (1.3e3, 2.1e5, 7.8e-9, 50.0, 10.0)}
MODES = 8
RIGID = {"clamped": 0, "pinned": 0, "free": 2}


def steel(count, ends, unit):
    """Return M, K, names, kept coordinates, length, bending stiffness and mass a length."""
    length, modulus, density, width, height = UNITS[unit]
    bending, inertia = modulus * width * height**3 / 12.0, density * width * height
    M, K, names = beam(count, ends, length, bending, inertia)
    kept = {"clamped": [("tip", "uy")], "pinned": [(count // 2, "uy")], "free": [(0, "uy"), ("tip", "uy")]}[ends]
    return M, K, names, [names.index(name) for name in kept], length, bending, inertia


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("ends", RIGID)
@pytest.mark.parametrize("count", COUNTS)
def test_beams_by_their_closed_forms(count, ends, unit):
    M, K, _, kept, length, bending, inertia = steel(count, ends, unit)
    rigid = RIGID[ends]
    waves = wave_numbers(ends, 4)
    exact = (waves / length)**2 * np.sqrt(bending / inertia)
    finite = 1.0 + (waves / count)**4 / 1440.0  # of these elements, from above
    rounding = 3e-16 * count**2.5  # of the entries of K, against which a fine beam is soft
    for method in METHODS:
        mass, stiffness, found = reduce(M, K, tuple(kept), MODES, method)
        assert np.count_nonzero(found.full_frequencies == 0.0) == np.count_nonzero(found.frequencies == 0.0) == rigid
        assert found.full_frequencies[rigid:rigid + 4] == pytest.approx(exact * finite, rel=rounding + 0.06 * (finite[-1] - 1.0))
        if method != "craig-bampton":
            assert found.errors[:MODES].max() < 1e-10
        else:
            assert 1e-9 < found.errors[rigid] < 1e-4  # real, and of the modes, not of rounding: the same for all meshes
        b = len(kept)
        if rigid:
            assert found.static_error < 1e-10 or method == "craig-bampton" and found.static_error == pytest.approx(1.5e-5, rel=0.05)
        else:
            flexible = {"clamped": 3.0, "pinned": 48.0}[ends]
            assert np.linalg.inv(stiffness)[:b, :b] == pytest.approx(length**3 / (flexible * bending), rel=max(rounding, 1e-9))
            assert found.static_error < 1e-9
    assert checked(M, None, K).rigid_body_modes == rigid


@pytest.mark.parametrize("count, unit", [(20, "mm"), (60, "m")])
@pytest.mark.parametrize("kept", [("tip.uy",), ("tip.uy", "tip.rz", "5.uy")])
def test_static_condensation_in_exact_arithmetic(count, unit, kept):
    """The stiffness of the kept coordinates by Gauss's elimination of the others in fractions."""
    M, K, names, *_ = steel(count, "clamped", unit)
    system = bf.System.from_matrices(M, None, K, dofs=names)
    at = [system.dof(name) for name in kept]
    rows = [{j: Fraction(K[i, j]) for j in np.flatnonzero(K[i])} for i in range(len(K))]
    for i in sorted(set(range(len(K))) - set(at)):
        for j in [j for j in rows[i] if j != i]:
            factor = rows[j].pop(i) / rows[i][i]
            for k, value in rows[i].items():
                if k != i:
                    rows[j][k] = rows[j].get(k, Fraction(0)) - factor * value
    exact = np.array([[float(rows[i].get(j, 0)) for j in at] for i in at])
    held = reduce(M, K, tuple(at), 3, "craig-bampton")
    size = np.sqrt(np.diag(exact))
    assert np.abs((held[1][:len(at), :len(at)] - exact) / np.outer(size, size)).max() < 1e-14
    for method in METHODS:
        _, stiffness, found = reduce(M, K, tuple(at), 3, method)
        flexibility = np.linalg.inv(exact)
        own = np.linalg.inv(stiffness)[:len(at), :len(at)]
        size = np.sqrt(np.diag(flexibility))
        assert np.abs((own - flexibility) / np.outer(size, size)).max() < 2e-9 and found.static_error < 2e-9


@pytest.mark.parametrize("method", METHODS)
def test_a_cantilever_of_100_elements_is_held(method):
    M, K, names = beam(100)
    small = bf.System.from_matrices(M, 1e-4 * K, K, dofs=names).reduced(keep=[("tip", "uy")], modes=6, method=method)
    assert small.dofs[0] == ("mode.1" if method == "massless" else "tip.uy")
    squares, modes = eigh(small.stiffness, small.mass)
    ratios = np.diag(modes.T @ small.damping @ modes) / (2.0 * np.sqrt(squares))
    assert ratios == pytest.approx(0.5e-4 * np.sqrt(squares), rel=1e-9)  # C = beta K damps every mode by beta omega / 2


def test_a_free_beam_stays_free_when_it_is_reduced_again():
    M, K, names = beam(200, "free")
    once = bf.System.from_matrices(M, None, K, dofs=names).reduced(["0.uy", "0.rz", "tip.uy", "tip.rz"], 8, "craig-bampton")
    twice = once.reduced(["0.uy", "tip.uy"], 6).reduction
    exact = wave_numbers("free", 4)**2
    assert np.array_equal(twice.frequencies[:2], [0.0, 0.0])
    assert twice.frequencies[2:5] == pytest.approx(exact[:3], rel=1e-3) and twice.static_error < 1e-9


def test_kept_coordinates_are_named_in_every_way():
    M, K, names = beam(20)
    system = bf.System.from_matrices(M, None, K, dofs=names, elements=[bf.elements.RigidStop(1.0, dof=("tip", "uy"))])
    ways = ["tip.uy", 38, np.int64(38), [("tip", "uy")], ["tip.uy"], (("tip", "uy"),), [["tip", "uy"]], [38]]
    made = [system.reduced(keep=way, modes=3) for way in ways]
    assert all(small == made[0] for small in made) and made[0].dofs[0] == "tip.uy" and made[0].elements[0].dof == 0
    assert system.dof(("tip", "uy")) == 38 and system.elements[0].dof == 38
    other = bf.System.from_matrices(M, None, K, dofs=names).reduced(keep=[(3, "uy"), "tip.uy"], modes=2)
    assert other.dofs[:2] == ("3.uy", "tip.uy")
    for wrong in (1.5, None, True, ("tip", "ux"), [3.0]):
        with pytest.raises(ValueError, match="reduced: "):
            system.reduced(keep=[wrong] if not isinstance(wrong, list) else wrong, modes=2)


@pytest.mark.parametrize("length", [1e-3, 1.0, 1e3])
def test_masses_of_fine_meshes_are_positive_in_all_units(length):
    """Turning inertias are m h^2 / 105: at a thousandth of a millimetre far below the others, and masses all the same."""
    M, K, _ = beam(20, length=length * 1e-3)
    assert bf.System(M, np.zeros_like(M), K).n == 40
    M[-1] = M[:, -1] = 0.0
    with pytest.raises(ValueError, match="positive definite"):
        bf.System(M, np.zeros_like(M), K)


def test_products_that_cancel_keep_their_digits():
    rng = np.random.default_rng(3)
    A = rng.standard_normal((30, 40)) * 10.0**rng.integers(-3, 4, (30, 1))
    X = rng.standard_normal((40, 3))
    A[:, -1] = 0.0
    X[-1] = 1.0
    A[:, -1] = -(A @ X)[:, 0]
    exact = [[sum(Fraction(a) * Fraction(x) for a, x in zip(row, column, strict=True)) for column in X.T] for row in A]
    found = product(A, X)
    assert np.abs(found - np.array(exact, float)).max() <= 1e-22 * np.abs(A).max()
    assert product(np.zeros((0, 3)), np.ones((3, 2))).shape == (0, 2)


@pytest.mark.parametrize("unit", [2.0**-40, 1.0, 2.0**40])
def test_what_is_held_and_what_is_free_of_a_plane_frame(unit):
    """A triangle of bars in its plane has three rigid motions; with one corner held one, with two none."""
    corners = np.array([[0.0, 0.0], [3.0, 0.2], [1.0, 2.0]])
    K = np.zeros((6, 6))
    for a, b, bar in ((0, 1, 1.0), (1, 2, 1e3), (0, 2, 1e-4)):
        along = corners[b] - corners[a]
        row = np.zeros(6)
        row[2 * a:2 * a + 2], row[2 * b:2 * b + 2] = -along, along
        K += unit * bar * np.outer(row, row) / (along @ along)
    for kept, free in (((), 3), ((0, 1), 1), ((0, 1, 2, 3), 0)):
        held = Held(K, kept)
        assert held.null.shape == (6, free) and held.negative is None
        assert np.abs(K @ held.null).max(initial=0.0) < 1e-15 * K.max() * np.abs(held.null).max(initial=1.0)
    loads = np.zeros((6, 1))
    loads[4:, 0] = 0.3, -2.0
    moved = Held(K, (0, 1, 2, 3)).solve(loads)
    assert moved[4:, 0] == pytest.approx(np.linalg.solve(K[4:, 4:], loads[4:, 0]), rel=1e-9) and not moved[:4].any()
