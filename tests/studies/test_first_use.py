"""First use of a law on the small setting: a new law compiles its own step, and the next process next to nothing."""
from studies import first_use as study
from studies.common import Setting


def test_a_new_law_compiles_its_step_and_values_only():
    rows = study.uses(Setting.SMALL)
    assert all(row.success and row.compiled < 60 and row.compiled_again < 10 for row in rows), rows
    assert "magnet" in study.report(rows)
