"""Certificates of branches: the README's branch, files, the command line."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.certify.branch import BranchCertificate
from bifurc.cli import main

pytest.importorskip("flint")


def test_rows_and_special_points_of_the_readme_are_proved(branch, tmp_path):
    found = branch.certify(stretches=False)
    assert found.proved, found.message
    assert len(found.points) == 6 and all(point.proved for point in found.points)
    stable = np.array([row.stable.value for row in found.rows])
    for i in np.flatnonzero(found.proved_rows):
        assert stable[i] == {True: "proved", False: "disproved", None: "undecided"}[branch.orbits[int(i)].stable]
    places = [point.parameter[0] for point in found.points]
    for i in np.flatnonzero(~found.proved_rows):  # rows on the grazings
        assert min(abs(found.values[i] - p) for p in places) < 1e-9
    assert "nothing is said of what lies between" in found.message
    assert branch.certificate is found
    found.save(tmp_path / "proof.npz")
    read = bf.load(tmp_path / "proof.npz")
    assert repr(read) == repr(found) and read.points == found.points and (read.values == found.values).all()
    import matplotlib.pyplot as plt

    axes = branch.plot()
    assert "proved" in [text.get_text() for text in axes.get_legend().get_texts()]
    plt.close(axes.figure)


def test_the_command_line_proves_what_was_saved(tmp_path, capsys):
    orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=0.8))
    orbit.save(tmp_path / "orbit.npz")
    assert main(["certify", str(tmp_path / "orbit.npz")]) == 0
    assert "Certificate(proved, stable" in capsys.readouterr().out
    assert bf.load(tmp_path / "orbit.certificate.npz").proved
    bf.simulate(orbit.system, y0=(0.0, 0.0), periods=1)
    assert main(["certify", str(tmp_path / "orbit.certificate.npz")]) == 2
    assert "can be proved" in capsys.readouterr().err


def test_branches_of_other_problems_raise():
    damped = bf.find_orbit(bf.systems.bilinear_oscillator(omega=1.0), method=bf.HarmonicBalance(harmonics=5))
    with pytest.raises(ValueError, match="event sequences"):
        bf.trace(damped, "omega", bounds=(0.95, 1.05)).certify()


def test_a_branch_is_proved_where_every_part_of_it_is():
    """Rows, special points and stretches; a row on a proved special point need not be."""
    def made(rows=(True,) * 4, points=((2.0, True),), stretches=(True,) * 3):
        return BranchCertificate("p", np.arange(4.0), tuple(SimpleNamespace(proved=row) for row in rows),
                                 tuple(SimpleNamespace(parameter=(p - 1e-12, p + 1e-12), proved=good) for p, good in points),
                                 tuple(SimpleNamespace(proved=good) for good in stretches), 0.0, "")
    assert made().proved and made().undecided == () and made(stretches=()).proved
    on = made(rows=(True, True, False, True))
    assert on.proved and on.undecided == () and on.proved_rows.tolist() == [True, True, False, True]
    beside = made(rows=(True, False, False, True))
    assert not beside.proved and beside.undecided == (1,)
    lost = made(rows=(True, True, False, True), points=((2.0, False),))
    assert not lost.proved and lost.undecided == (2,)
    assert not made(points=((2.0, True), (3.0, False))).proved
    assert not made(stretches=(True, False, True)).proved and made(stretches=(True, False, True)).undecided == ()
    assert repr(made(stretches=(True, False, True))) == (
        "BranchCertificate(4 of 4 rows, 1 of 1 special points, 2 of 3 stretches proved, 0.00 s)")
