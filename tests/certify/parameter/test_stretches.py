"""What lies between the rows of a branch: proved where it is true, undecided where a special point is not told."""
import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.certify import StretchCertificate, Verdict
from bifurc.certify.arithmetic.balls import flint, middle, working
from bifurc.certify.arithmetic.forms import hull
from bifurc.certify.model import Refused
from bifurc.certify.parameter import family
from bifurc.certify.parameter.sequence import along, pieces_of
from bifurc.certify.parameter.sheet import Sheet
from bifurc.certify.parameter.stretch import NEAR, Mark, Stretches, bisect
from bifurc.certify.parameter.tube import Tube
from tests.reference import one_stop

pytest.importorskip("flint")


@pytest.fixture(scope="module")
def points(branch):
    """Proofs of its special points."""
    return tuple(point.certify() for point in branch.special_points)


def around(branch, point):
    """The first row of the stretch on which a special point lies."""
    s = branch.column("s")
    return int(np.searchsorted(s, point.s, side="right")) - 1


@pytest.mark.slow
def test_every_stretch_of_the_readme_is_proved(branch):
    found = branch.certify()
    assert found.proved, found.message
    assert len(found.stretches) == len(branch) - 1
    near = {place for part in found.stretches for place in part.near}
    assert near == set(range(6))
    assert branch.certificate is found
    assert found.seconds < 60.0


@pytest.mark.parametrize("kind", ["period_doubling", "fold"])
def test_a_special_point_that_is_not_told_is_not_proved_away(branch, points, kind):
    """The proof of a stretch must not succeed when one of its special points is hidden from it; it names the place."""
    for place, point in enumerate(branch.special_points):
        if point.kind != kind:
            continue
        hidden = tuple(dataclasses.replace(p, exists=Verdict.UNDECIDED) if k == place else p for k, p in enumerate(points))
        found = Stretches(branch, hidden).between(around(branch, point))
        assert not found.proved
        low, high = found.undecided.T
        assert np.any((low <= point.parameter + 1e-12) & (point.parameter - 1e-12 <= high)), found.message
        assert kind.replace("_", " ") in found.message


def test_a_graze_that_is_not_told_is_not_proved_away(branch, points):
    place, point = next((k, point) for k, point in enumerate(branch.special_points) if point.kind == "grazing")
    hidden = tuple(dataclasses.replace(p, exists=Verdict.UNDECIDED) if k == place else p for k, p in enumerate(points))
    found = Stretches(branch, hidden)
    row = int(np.flatnonzero(branch.column("s") == point.s)[0])
    assert not found.between(row - 1).proved and not found.between(row).proved and not found.between(row + 1).proved


def test_a_loss_of_symmetry_that_is_not_told_is_not_proved_away():
    """Of orbits solved on their half period: everything is proved but the piece with the branch point, known at 3.39799."""
    branch = bf.trace(bf.find_orbit(bf.systems.two_sided_impact_oscillator(amplitude=3.38)), "amplitude", bounds=(3.36, 3.43))
    assert branch.orbits[0].closure == -1 and [point.kind for point in branch.special_points] == ["branch_point"]
    found, values = Stretches(branch, (SimpleNamespace(proved=False),)), branch.column("amplitude")
    row = next(k for k in range(len(values) - 1) if values[k] < 3.397988672 < values[k + 1])
    for k in (row - 2, row - 1, row, row + 1):
        part = found.between(k)
        assert part.proved is (k != row), part.message
    low, high = found.between(row).undecided.T
    assert np.any((low < 3.397988672) & (3.397988672 < high))


def test_a_stretch_that_passes_through_the_stop_is_not_proved(branch, points):
    """The free motion, offered on where it goes through the stop."""
    problem = branch.problems[0]
    last = int(np.flatnonzero(branch._arrays["part"] == 0)[-1])
    stretches = Stretches(branch, points)
    with working(64):
        sheet, _, node = stretches._ends(last - 1)
        beyond = sheet.path._replace(family=type(sheet.path.family)(problem.system, "omega", 0.68, 0.72, sheet.path.family.places))
        wide = type(sheet)(beyond, 0.69, 0.71)
        row = np.zeros(node.z.size)
        row[-1] = 1.0 / beyond.scale[-1]
        a, b = (wide.node(node.z + (p - node.z[-1]) * np.eye(node.z.size)[-1], row) for p in (0.700, 0.705))
        found = bisect(wide, a, b, [Mark(0, 0.7025, True, NEAR)], (0, 1))
    assert not found.proved and found.pieces == 0
    assert "not admissible" in found.message


def test_closed_forms_lie_in_the_tubes(branch, points, monkeypatch):
    """At random values of the parameter, the orbit of the closed form is in the tube of its piece; its multipliers are off the
    circle by what was proved."""
    tubes = []
    held = Tube.admissible

    def noted(self):
        why = held(self)
        if not why:
            tubes.append(self)
        return why
    monkeypatch.setattr(Tube, "admissible", noted)
    stretches = Stretches(branch, points)
    for i in (8, 15, 28):
        assert stretches.between(i).proved
    rng = np.random.default_rng(3)
    seen = 0
    for tube in tubes:
        p = hull(tube.forms[-1])
        low, high = (middle(p) + sign * 0.9 * float(p.rad()) for sign in (-1, 1))
        for omega in rng.uniform(low, high, 2):
            speeds = [middle(hull(form)) for form in tube.forms]
            references = [o for o in one_stop.orbits(0.05, omega, 0.52, 1.0, 0.7, 1, samples=50) if o.admissible]
            reference = min(references, key=lambda o: abs(float(o.speed) - speeds[2] * 1.0))
            state = [float(reference.time) * omega % (2.0 * np.pi), 1.0, float(reference.speed), omega]
            with working(64):
                arb = flint().arb
                away = [arb(v) - arb(float(z)) for v, z in zip(state, tube.z, strict=True)]
                along = [arb(float(v)) for v in tube.t]
                row = [arb(float(v)) for v in tube.row]
                d = sum((r * v for r, v in zip(row, away, strict=True)), arb(0)) / sum(
                    (r * v for r, v in zip(row, along, strict=True)), arb(0))
                if abs(float(d)) > tube.h:
                    continue
                for v, t, c, y in zip(away, along, tube.c, tube.inside, strict=True):
                    assert (y + arb(0, 1e-12)).contains(v - t * d - arb(float(c)) * d * d)
            seen += 1
    assert seen >= 20


@pytest.mark.parametrize("ends", [(1.0, 2.0), (2.0, 1.0)])
@pytest.mark.parametrize("part", [[0, 0], [0, 1]])
def test_a_stretch_reaches_from_the_smaller_to_the_larger_parameter(ends, part):
    """In whichever direction the branch was traced: what is refused, what is no orbit, what changes between the rows."""
    found = object.__new__(Stretches)
    found.branch, found._part, found.precision = SimpleNamespace(x=lambda k: np.array([9.0, ends[k]])), part, 64
    found._marks = lambda i: [Mark(3, ends[0], True, 1.0)]
    for made in ((None, None, None), (None, None, "node"), Refused("no polynomial")):
        def sides(i, made=made):
            if isinstance(made, Refused):
                raise made
            return made
        found._ends = sides
        certificate = found.between(0)
        assert certificate.rows == (0, 1) and certificate.parameter == (1.0, 2.0)
        assert certificate.proved == (part == [0, 1])
        assert certificate.near == ((3,) if part == [0, 1] else ())


@pytest.mark.parametrize(("row", "width"), [(3, 1e-4), (3, 0.2), (20, 1e-3), (20, 0.3)])
def test_matrices_over_a_range_are_those_at_its_points(branch, row, width):
    """Values and derivatives of the series about the middle, with their remainder, hold what a model of the point itself gives."""
    problem, x = branch.problems[int(branch._arrays["part"][row])], branch.x(row)
    low, high = float(x[-1]) - width, float(x[-1]) + 0.5 * width
    with working(192):
        path = along(problem, x, low, high)
        sheet, checked = Sheet(path, low, high), 0
        for share in (0.0, 0.013, 0.4, 0.77, 1.0):
            p = flint().arb(low) + (flint().arb(high) - flint().arb(low)) * share
            here, point = sheet.pieces(p, True), pieces_of(path, path.family.model(p, 2), lambda found: found)
            for made, exact in ((made, exact) for name in "BRG" for made, exact in zip(getattr(here, name), getattr(point, name),
                                                                                      strict=True)):
                if exact is None:
                    assert made is None
                    continue
                assert all(a.overlaps(b) for a, b in zip(made.value.entries(), exact.parts[0].entries(), strict=True))
                slope = made.parts[1]
                slopes = [flint().arb(0)] * len(exact.parts[1].entries()) if slope is None else slope.entries()
                assert all(a.overlaps(b) for a, b in zip(slopes, exact.parts[1].entries(), strict=True))
                checked += sum(v != 0 for v in exact.parts[1].entries())
    assert checked > 0


def test_stretches_are_stored(branch, points, tmp_path):
    found = Stretches(branch, points).between(20)
    read = StretchCertificate.from_record(*found.to_record())
    assert repr(read) == repr(found) and read.message == found.message and read.parameter == found.parameter


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("bend", [0.0, 1e-12])
def test_numbers_are_polynomials_of_a_parameter_up_to_their_own_rounding(size, bend, monkeypatch):
    """1 + p + p^2 in any unit, with and without a part of 1e-12 that is none; the parameter itself; a constant."""
    system = SimpleNamespace(with_parameters=lambda p: p)
    monkeypatch.setattr(family, "floats_of", lambda p, places: [size * (1.0 + p + p * p + bend * np.sin(40.0 * p)), p, 3.0 * size])
    if bend:
        with pytest.raises(Refused, match="no polynomials of p"):
            family.Family(system, "p", 1.0, 2.0, [])
        return
    made = family.Family(system, "p", 1.0, 2.0, [])
    assert made.identical.tolist() == [False, True, False] and made.constant.tolist() == [False, False, True]
    (series, rounding), = made.series.values()
    z = 0.3  # p = 1.65
    assert np.polynomial.polynomial.polyval(z, series) == pytest.approx(size * (1.0 + 1.65 + 1.65**2), rel=1e-14)
    assert rounding == pytest.approx(family.ULPS * size * 7.0, rel=0.1) and len(series) == 3
