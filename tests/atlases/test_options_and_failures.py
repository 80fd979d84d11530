"""Options of an atlas are checked before any work, and what fails in its own calls is told."""
import pytest

import bifurc as bf
from bifurc.atlases import jobs
from bifurc.atlases.result import AtlasStatus

REGION = {"q0": (-3, 1), "v0": (-4, 4)}
SMALL = {"probes": 2, "checks": 1, "samples": 20, "periods": 1}


def asked(**options):
    return bf.atlas(bf.systems.impact_oscillator(), "omega", (1.2, 1.6), REGION, **{**SMALL, **options})


@pytest.mark.parametrize(("options", "text"), [
    ({"nope": 1}, "'nope'"), ({"stop": lambda point: False}, "'stop'"), ({"direction": 1}, "'direction'"), ({"ds": 0.0}, "ds = 0."),
    ({"ds_max": -1.0}, "ds_max = -1.0"), ({"ds_min": "small"}, "ds_min = 'small'"), ({"max_steps": 2.5}, "max_steps = 2.5"),
    ({"peaks": "max_7"}, "max_7"), ({"peaks": 3}, "peaks"), ({"audit": "slow"}, "audit"), ({1: 2}, "1"), ([1], "mapping"),
    ("ds", "mapping")])
def test_options_of_trace_are_checked_before_work(options, text, tmp_path):
    with pytest.raises(ValueError, match=text) as told:
        asked(trace=options, file=tmp_path / "atlas.npz")
    assert "atlas: trace" in str(told.value) and not list(tmp_path.iterdir())  # not a chunk was begun


def test_good_options_reach_the_traces():
    found = asked(trace={"ds_max": 0.05, "peaks": ["max_0"], "audit": "fast", "max_steps": 300})
    assert found.branches
    assert all(branch.options["ds_max"] == 0.05 and branch.options["audit"] == "fast" for branch in found.branches)
    assert found.status is not AtlasStatus.FAILED and found.failures == ()


@pytest.mark.parametrize("name", ["trace", "switch_branch", "periods_of"])
def test_what_its_own_calls_raise_is_told(name, monkeypatch):
    """Without a failure the same call finds one branch and nothing more."""
    def broken(*_, **__):
        raise IndexError(f"{name} is broken")
    monkeypatch.setattr(jobs, name, broken)
    found = bf.atlas(bf.systems.impact_oscillator(), "omega", (0.4, 0.9), REGION, **SMALL, workers=1)
    assert found.status is AtlasStatus.FAILED and any(f"{name} is broken" in text for text in found.failures)
    assert "failed" in found.statement and "failures" in found.message
    assert (len(found.branches) > 0) == (name == "switch_branch")  # what was traced is kept
