"""Cost of elastic rub on the small setting: the period closes to rounding, steps that know no contacts tend to it."""
from studies import rub_cost as study
from studies.common import Setting


def test_steps_by_hand_tend_to_the_orbit():
    found = study.costs(Setting.SMALL)
    (_, coarse, _), (_, fine, _) = found.steps
    assert found.error < 1e-13 and fine < 0.2 * coarse and fine < 1e-4  # four times the steps: at least order 1.2
    assert found.branches[1][0] > found.branches[0][0]
    assert "further point" in study.report(found)
