"""Stability along balances of few harmonics: where it changes without a special point the audit names it, and what would decide."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ElasticStop, HarmonicForce

K = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
SCENES = [(0.493, 0.585, 0.358, 7.562), (1.374, 0.311, 0.395, 3.176)]


def clearances(omega, force, first, second, stop):
    """Three masses with two elastic clearances between them."""
    return bf.System(np.eye(3), 0.05 * K, K, [HarmonicForce(force), ElasticStop(first, stop, row=(1.0, -1.0, 0.0)),
                                              ElasticStop(second, stop, row=(0.0, 1.0, -1.0))], omega=omega)


def traced(harmonics, scene, **options):
    orbit = bf.find_orbit(clearances(0.7, *scene), method=bf.HarmonicBalance(harmonics))
    return bf.trace(orbit, "omega", bounds=(0.7, 2.2), max_steps=600, **options)


def silent_changes(branch):
    """Return the pairs of arclengths between which `stable` changes and no special point lies."""
    s, stable = branch.column("s"), branch.column("stable")
    known = [i for i, told in enumerate(stable) if told is not None]
    marks = [point.s for point in branch.special_points]
    return [(s[i], s[j]) for i, j in zip(known[:-1], known[1:], strict=True)
            if bool(stable[i]) != bool(stable[j]) and not any(s[i] - 1e-9 <= at <= s[j] + 1e-9 for at in marks)]


@pytest.mark.parametrize("scene", SCENES)
def test_a_change_of_stability_that_nothing_explains_is_named_with_the_harmonics_that_decide(scene):
    branch = traced(9, scene)
    wanted = silent_changes(branch)
    assert wanted and not branch.audit.ok and "give" in repr(branch.audit)
    assert [(a, b) for a, b, _ in branch.audit.truncated] == wanted
    omega = branch.column("omega")
    for a, b, harmonics in branch.audit.truncated:
        assert harmonics in (19, 39)
        near = omega[(branch.column("s") >= a - 0.2) & (branch.column("s") <= b + 0.2)]
        more = traced(harmonics, scene, audit="fast")  # the whole branch with so many: there all changes have their points
        s, here = more.column("s"), more.column("omega")
        for left, right in silent_changes(more):
            place = here[(s >= left) & (s <= right)]
            assert not (near.min() <= place.min() and place.max() <= near.max())
    assert traced(9, scene, audit="fast").audit.truncated == ()  # it asks for no multipliers


def test_a_duffing_oscillator_is_decided_by_its_harmonics():
    branch = bf.trace(bf.find_orbit(bf.systems.duffing_oscillator(), method=bf.HarmonicBalance(7)), "omega", bounds=(0.5, 2.5))
    assert branch.audit.truncated == () and branch.audit.ok
