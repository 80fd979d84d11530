"""Cost of straight contacts on the small setting: every piece of work is measured, and compared by name."""
from pathlib import Path

import pytest

from studies import affine_cost as study
from studies import affine_scenes
from studies.common import Setting


@pytest.mark.slow
def test_all_work_is_measured_in_a_process_of_its_own():
    own, other = study.costs(Setting.SMALL, None)
    assert other is None and all(value > 0.0 for value in own.values())
    assert {name.split(",")[0] for name in own} == {"simulate", "find_orbit", "first branch", "further branch", "basin map"}
    assert "1.000" not in study.report(own, None)
    twice = {name: 2.0 * value for name, value in own.items()}
    assert study.report(own, twice).count("0.5\n") + study.report(own, twice).endswith("0.5") == len(own)
    assert len(study.picture(own, twice).axes[0].patches) == len(own)


def test_the_measured_file_asks_for_nothing_but_the_package():
    text = Path(affine_scenes.__file__).read_text(encoding="utf-8")
    assert "from ." not in text
