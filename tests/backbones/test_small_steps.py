"""A backbone that Newton loses is followed in smaller steps: which amplitudes are tried, on modes that are only numbers."""
from types import SimpleNamespace

import pytest

from bifurc.backbones.backbone import HALVINGS, _stepped

LEAST = 0.5**HALVINGS


@pytest.mark.parametrize("start, value", [(1.0, 2.0), (2.0, 1.0)])
@pytest.mark.parametrize("reach, halved", [(1.0, 0), (0.5, 1), (0.3, 2), (LEAST, HALVINGS), (0.4 * LEAST, None)])
def test_steps_are_halved_until_newton_succeeds(start, value, reach, halved, monkeypatch):
    """Newton reaches so far from a mode that it has: the end is reached in such steps, or the smallest step fails."""
    tried = []

    def extended_mode(system, aim, guess, **options):
        assert options == {"option": 1}
        tried.append(aim)
        return SimpleNamespace(amplitude=aim, success=abs(aim - guess.amplitude) <= reach * (1.0 + 1e-12))

    monkeypatch.setitem(_stepped.__globals__, "extended_mode", extended_mode)
    found = _stepped(None, SimpleNamespace(amplitude=start), value, {"option": 1})
    way = value - start
    if halved is None:
        assert not found.success and tried == [start + way * 0.5**k for k in range(HALVINGS + 1)]
    else:
        count = 2**halved
        assert found.success and found.amplitude == value
        assert tried == [*(start + way * 0.5**k for k in range(halved)), *(start + way * k / count for k in range(1, count + 1))]
