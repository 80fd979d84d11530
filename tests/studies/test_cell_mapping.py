"""The small settings of the studies of cell mapping, label noise and refinement, without times."""
from studies import cell_mapping, label_noise, refinement
from studies.common import Setting


def test_many_periods_a_mapping_make_simple_cell_mapping_right():
    found, cost = cell_mapping.run(Setting.SMALL)
    simple = {item.periods: item for item in found if item.samples == 1}
    assert simple[30].wrong < 0.01 < simple[1].wrong + simple[1].undecided
    assert all(item.attractors == 2 for item in found)
    assert cost.cells == 10000 and cost.edges_whole > 8 * cost.cells
    text = cell_mapping.report(found, cost)
    assert "wrong" in text and "Morse graph" in text
    assert cell_mapping.picture(found, cost).axes


def test_noise_is_predicted_within_a_factor_where_there_is_any():
    found = label_noise.run(Setting.SMALL)
    assert found["A"].rescaled == found["A"].moved == 0.0 and found["A"].predicted < 1e-10
    assert 1 / 2 <= found["B"].predicted / found["B"].rescaled <= 2  # 3600 cells tell it to a tenth
    assert str(found["B"].basins.reliability.kind) == "fractions"
    assert "promise" in label_noise.report(found) and label_noise.picture(found).axes


def test_refinement_is_declined_on_the_fractal_boundary():
    found = {item.name: item for item in refinement.run(Setting.SMALL)}
    assert found["B"].status == "declined" and found["B"].share == 1.0
    assert found["A"].missed <= 4e-3
    assert "would not pay" in refinement.report(list(found.values())) and refinement.picture(list(found.values())).axes
