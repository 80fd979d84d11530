"""How many steps a period are chosen, for errors that fall by a known power; starts on the surface of a guard."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.ensemble.batch import smooth
from bifurc.ensemble.batch.tables import meeting


@pytest.mark.parametrize("order, size", [(4, 1e-3), (4, 1e3), (6, 1.0), (2, 1e-6)])
@pytest.mark.parametrize("units", [np.ones(2), np.array([1e-9, 1e7])])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_error_that_steps_leave_is_as_small_as_asked(monkeypatch, order, size, units, sign):
    """The images carry size / steps^order of the region, too far or not far enough: what is left is below the wish, and not far
    below."""
    asked = []

    def images(scene, kind, steps, X, periods=1):
        asked.append(steps)
        return X + sign * units * size / steps**order

    monkeypatch.setattr(smooth, "images", images)
    monkeypatch.setattr(smooth, "region", lambda scene, kind: units)
    kind = SimpleNamespace(order=order)
    steps, error = smooth.steps_for(None, kind, 1e-5)
    exact = size * (1.0 - 2.0**-order)
    assert error == pytest.approx(exact / steps**order, rel=1e-6) and error <= 1e-5
    least = (exact / 1e-5)**(1.0 / order)
    assert steps == smooth.COARSE or steps <= max(1.2 * least, smooth.COARSE + 1.0)


def test_steps_that_never_suffice_are_refused(monkeypatch):
    monkeypatch.setattr(smooth, "images", lambda scene, kind, steps, X: X + np.random.default_rng(steps).normal(size=X.shape))
    monkeypatch.setattr(smooth, "region", lambda scene, kind: np.ones(2))
    with pytest.raises(ArithmeticError, match="leave an error"):
        smooth.steps_for(None, SimpleNamespace(order=4), 1e-9)


def test_one_lost_start_in_a_hundred_does_not_count(monkeypatch):
    """Nor do starts that are lost by the finer steps; more of them do."""
    def images(scene, kind, steps, X, lost=1):
        Y = np.array(X)
        if steps > 2 * smooth.COARSE:
            return Y
        Y[:lost] += 1.0 / steps
        return Y

    monkeypatch.setattr(smooth, "images", images)
    monkeypatch.setattr(smooth, "region", lambda scene, kind: np.ones(2))
    assert smooth.steps_for(None, SimpleNamespace(order=4), 1e-9) == (smooth.COARSE, 0.0)
    monkeypatch.setattr(smooth, "images", lambda *given: images(*given, lost=20))
    assert smooth.steps_for(None, SimpleNamespace(order=4), 1e-9)[0] > smooth.COARSE


def test_starts_that_meet_a_guard(rng):
    """They lie on its surface and on those that hold, and spread over all else."""
    ns, nx = 4, 7
    T = SimpleNamespace(A=np.zeros((2, ns, nx)), G=rng.normal(size=(2, 3, nx)), H=rng.normal(size=(2, 2, nx)),
                        S=rng.normal(size=(2, 2, nx)), n_holds=np.array([0, 1]))
    for m, held in ((0, []), (1, [T.H[1, 0], T.S[1, 0]])):
        X, sizes = meeting(T, m, 2)
        rows = np.array([T.G[m, 2], *held])
        assert (X[:, ns] == 1.0).all() and sizes[ns] == 1.0
        assert (np.abs(rows @ X.T) <= 1e-12 * (np.abs(rows) @ np.abs(X).T + sizes.max())).all()
        free = np.delete(X, ns, axis=1)
        assert np.linalg.matrix_rank(free - free.mean(axis=0), tol=1e-9 * np.abs(free).max()) == nx - 1 - len(rows)
