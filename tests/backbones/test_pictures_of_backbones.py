"""A backbone hands itself to its picture."""
from bifurc import plotting
from bifurc.backbones.backbone import Backbone


def test_a_backbone_draws_itself(monkeypatch):
    monkeypatch.setattr(plotting, "plot_backbone", lambda *arguments: arguments)
    found = object.__new__(Backbone)
    assert found.plot("axes") == (found, "axes") and found.plot() == (found, None)
