"""Attractors without a period: points on a curve are told from others."""
import numpy as np

from bifurc.basins.attractors.attractors import on_curve


def test_points_on_a_curve_are_told_from_others():
    rng = np.random.default_rng(0)
    turns = np.arange(4000) * 2.399963
    circle = np.column_stack([np.cos(turns), np.sin(turns), 0.3 * np.cos(2.0 * turns), np.sin(turns)])
    assert on_curve(circle)
    slow = np.arange(4000) * (2.0 * np.pi / 5.0 + 1e-5)  # nearly locked: five short arcs
    assert on_curve(np.column_stack([np.cos(slow), np.sin(slow)]))
    assert not on_curve(rng.random((4000, 4))) and not on_curve(np.column_stack([circle[:, :2], rng.random((4000, 2))]))
    assert not on_curve(np.zeros((4000, 4)))
