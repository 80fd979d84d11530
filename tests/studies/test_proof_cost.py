"""Proofs near special points, and of a part of a branch."""
import pytest

from studies import proof_cost as study
from studies.common import Setting

pytest.importorskip("flint")


def test_orbits_of_every_kind_are_proved():
    """At every precision, and for stops, friction and sliders."""
    rows = study.costs(Setting.SMALL)
    assert all(row.proved for row in rows) and {row.bits for row in rows} == {96, 384}


def test_proofs_succeed_near_a_graze_and_a_fold():
    """At 1e-4 and 1e-8 of the load; both motions above the fold."""
    rows = study.near(Setting.SMALL)
    assert {row.point for row in rows} == {"graze", "fold"}
    assert all(row.proved == row.tried for row in rows)


def test_the_fold_is_that_of_the_reference():
    """Its closed form here, in floats, against the one in 34 digits."""
    from tests.reference import one_stop

    force, speed = one_stop.special_forces(study.ZETA, study.OMEGA, study.GAP, study.RESTITUTION)["fold"]
    assert study.special_load() == pytest.approx((float(force), float(speed)), rel=1e-12)


def test_a_part_of_a_branch_is_proved():
    """Rows and stretches; the report has a line for each table."""
    branches = study.wholes(Setting.SMALL)
    (part,) = branches
    assert part.rows[0] == part.rows[1] and part.stretches[0] == part.stretches[1] > 5
    assert "README, a part" in study.report([], [], branches)
