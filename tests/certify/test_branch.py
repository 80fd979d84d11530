"""Certificates of branches: the README's branch, files, the command line."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.cli import main

pytest.importorskip("flint")


@pytest.fixture(scope="module")
def branch():
    """The branch of the README."""
    return bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.5, 2.0))


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
