"""Nonlinear modes in other units, coordinates and from the other side."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from tests.reference.images import IMAGES, in_units, pair

SYSTEM = bf.System(pair().mass, 0.02 * np.eye(2), pair().stiffness,
                   (el.HarmonicForce(0.5), el.ElasticStop(0.4, 3.0, dof=1), el.ConstantForce(0.1, dof=1)), omega=1.0)
ALIKE = {"tiny": lambda system: in_units(system, 1e-7, 1e6, 1e8), "huge": lambda system: in_units(system, 1e8, 1e-6, 1e-7),
         **{name: IMAGES[name] for name in ("reversed", "opposite", "reordered")}}


@pytest.mark.parametrize("mode", [0, 1])
@pytest.mark.parametrize("method", [None, bf.HarmonicBalance(harmonics=9)], ids=["shooting", "balance"])
@pytest.mark.parametrize("image", ALIKE)
def test_modes_of_images_are_images_of_the_mode(image, method, mode):
    image = ALIKE[image](SYSTEM)
    dof = int(np.argmax(np.abs(image.matrix[:2, 1])))
    own = bf.extended_mode(SYSTEM, 1.2, dof=1, mode=mode, method=method)
    found = bf.extended_mode(image.system, 1.2 * image.matrix[dof, 1], dof=dof, mode=mode, method=method)
    assert own.success and found.success
    assert found.omega * image.time == pytest.approx(own.omega, rel=1e-9)
    assert found.xi * image.time == pytest.approx(own.xi, rel=1e-7) and found.damping == pytest.approx(own.damping, rel=1e-7)
    assert found.first_harmonic == pytest.approx(abs(image.matrix[dof, 1]) * own.first_harmonic, rel=1e-8)
    assert np.abs(np.linalg.solve(image.matrix, found.state) - own.state).max() < 1e-8


@pytest.mark.parametrize("image", ALIKE)
def test_backbones_of_images(image):
    image = ALIKE[image](SYSTEM)
    dof = int(np.argmax(np.abs(image.matrix[:2, 1])))
    own = bf.backbone(SYSTEM, [0.5, 0.8, 1.2], dof=1)
    found = bf.backbone(image.system, image.matrix[dof, 1] * np.array([0.5, 0.8, 1.2]), dof=dof)
    assert len(own.omega) == 3 and np.allclose(found.omega * image.time, own.omega, rtol=1e-9)
