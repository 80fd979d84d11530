"""Loops of friction contacts: the tables that the study prints."""
from studies import friction_loops as study
from studies.common import Setting


def test_yang():
    cases = study.yang()
    assert [round(case.loops["x"].work, 6) for case in cases] == [40.529433, 31.579637, 53.142857]
    assert all(case.loops.success and case.coupled.settled for case in cases)


def test_rings_converge_with_second_order():
    found = study.rings(Setting.SMALL)
    assert all(abs(r.closed) < 1e-12 for r in found)
    coarse, fine = (next(r for r in found if r.n == n) for n in (3, 15))
    assert abs(coarse.continuum / fine.continuum / 25.0 - 1.0) < 1e-6
    assert fine.force < 5e-3


def test_steps_lose_area():
    """The implicit scheme converges with second order, who takes the slip from the step before only with first."""
    few, many = study.marches(Setting.SMALL)
    assert 0.0 > many.implicit > -1e-4 and few.implicit / many.implicit > 10.0
    assert abs(many.explicit) > 50.0 * abs(many.implicit)


def test_report():
    text = study.report(study.yang(), study.rings(Setting.SMALL), study.marches(Setting.SMALL))
    assert "69.7764279926" in text
