"""Random branches: what they hold is motion, their ends are named, both directions of travel see the same."""
import numpy as np
import pytest

import bifurc as bf
from studies import branch_audit
from studies.common import Setting


def slow(*scene):
    """Return a scene for the slow suite: the default one keeps scenes of every kind that are done in a second or two."""
    return pytest.param(*scene, marks=pytest.mark.slow)


@pytest.fixture(scope="module")
def rows():
    """Return the audited scenes of the small setting."""
    return branch_audit.study(Setting.SMALL)


def test_every_row_is_a_motion(rows):
    """No row that simulation does not repeat, none without success."""
    assert sum(row.rows for row in rows) > 150
    for row in rows:
        assert (row.not_repeated, row.failed) == (0, 0), row


def test_ends_are_explained(rows):
    """Bounds, loops, largest numbers of steps, and physical ends that are named."""
    assert [row.ends for row in rows if row.ends] == []


def test_both_directions_see_the_same(rows):
    """Traced back from either end the special points are the same."""
    assert [row.one_way for row in rows if row.one_way] == []


def test_every_row_starts_the_same_branch(rows):
    """Also where a drawn row lies on a boundary of its event sequence."""
    assert [row.starts for row in rows if row.starts] == []


def test_the_table_has_a_line_for_every_kind(rows):
    """One line for each kind of scene and one for all."""
    assert branch_audit.report(rows).count("\n") == len(branch_audit.KINDS) + 3


def test_points_without_a_partner_are_seen():
    """Lists of points are compared kind by kind."""
    assert branch_audit.unmatched([("fold", 1.0), ("grazing", 2.0)], [("fold", 1.0)], 1.0) == [("grazing", 2.0)]
    assert branch_audit.unmatched([("fold", 1.0)], [("fold", 1.0 + 1e-9)], 1.0) == []


@pytest.mark.parametrize(("kind", "number"), [
    ("two_stops", 100), ("two_stops", 122), ("two_stops", 124), ("belt", 112), ("two_masses", 7018), ("one_stop", 8035),
    ("two_stops", 9042), ("two_stops", 17036), ("belt", 12073), ("elastic_stop", 8032), slow("two_masses", 1000),
    slow("two_masses", 6018), slow("two_masses", 9002), slow("one_stop", 8048), slow("two_masses", 5034), slow("two_stops", 11038),
    slow("clearances", 15028), slow("stop_and_friction", 15019), slow("clearances", 16076), slow("mixed", 44001),
    slow("mixed", 53015), slow("clearances", 53007), slow("clearances", 11028), slow("clearances", 11030)])
def test_scenes_that_once_had_other_points_on_the_way_back(kind, number):
    """Special points accumulate towards the end of chattering; up to a stated distance both directions list the same.

    Where two slips are born at once, and where an orbit has several forcing periods, the branch goes on from either side.  A start
    beside such a birth, whose equations have all but lost a rank, goes along their null vector.
    A sequence that lives for 3e-8 of the frequency begins where the shortest of its intervals does; a multiplier that comes to -1
    and goes back within two steps flips twice; orbits that become those of their parent where a contact ends merge there, also when
    the parameter is one of that contact.  A moment of slip in which another contact begins to slip is a slip.  Where dp/ds = 0 on
    the end of a sequence that lives for 9e-9, the old equations know that place to less.
    """
    row = branch_audit.audited(kind, number, drawn=False)
    assert row.found and (row.not_repeated, row.failed, row.ends, row.one_way) == (0, 0, [], [])


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "number"), [
    ("stop_and_friction", 10013), ("two_masses", 7054), ("two_masses", 11022), ("two_masses", 8129), ("stop_and_friction", 7049),
    ("two_masses", 9048), ("two_masses", 10015), ("two_masses", 21039)])
def test_friction_that_changes_places_with_the_impacts_of_a_train(kind, number):
    """One exchange follows the other up to the end of the chattering: the branch neither turns back nor ends among them, and where
    it ends because the chattering does not complete any more it does so from both sides.  Where an exchange is a corner of the
    interval that vanishes, it is located by its flat side too."""
    row = branch_audit.audited(kind, number)
    assert row.found and (row.not_repeated, row.failed, row.ends, row.one_way, row.starts) == (0, 0, [], [], [])


@pytest.mark.parametrize(("kind", "number"), [("elastic_stop", 14079), slow("clearances", 13053), slow("two_masses", 14065),
                                              slow("two_masses", 11011), slow("stop_and_friction", 14018)])
def test_changes_of_the_sequence_beside_others(kind, number):
    """Two events that exchange their order twice in one step are seen where the step ends on another change; a change between the
    impacts of a chattering has one name from both sides; a contact that is born before others end with it is not passed over;
    behind a stick that begins with the square of its duration, or a slip with a higher power, the branch goes on and not back."""
    row = branch_audit.audited(kind, number, drawn=False)
    assert row.found and row.ok and (row.not_repeated, row.failed, row.ends, row.one_way) == (0, 0, [], [])


@pytest.mark.slow
def test_no_fold_where_a_slip_is_born():
    """Beside the birth of a slip, of third order in its duration, the slope of the parameter is rounding, and places of the step
    are that birth itself."""
    system, name, bounds = branch_audit.scene("two_masses", 14039)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    assert branch.audit.ok and len(branch.special_points.of("fold")) == 0 < len(branch.special_points.of("slip_onset"))


def test_what_is_zero_with_the_cube_of_the_way_to_a_birth_is_no_pair():
    """Its values are rounding long before the end of the step; no pair of grazings is suspected there, from any row."""
    system, name, bounds = branch_audit.scene("two_masses", 21023)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    for row in (6, len(branch) - 3):
        other = bf.trace(branch.orbits[row], name, bounds=bounds)
        assert other.audit.ok and other.stop_reason == ("bound", "bound")
        assert branch_audit.differences(branch, other, bounds, 0) == []


@pytest.mark.parametrize("number", [11023, 12014])
def test_a_chattering_that_completes_a_little_further_on_ends_the_branch(number):
    """With small restitution three impacts are as slow as rounding: beyond a change of their number motions complete."""
    system, name, bounds = branch_audit.scene("stop_and_friction", number)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    assert name == "rigid_stop.restitution" and branch.stop_reason == ("chattering", "bound") and branch.audit.ok


def test_a_change_of_the_list_as_near_to_the_bound_as_any():
    """The last impact but one is left out of a list at a restitution of 1e-8, beside the bound at zero."""
    system, name, bounds = branch_audit.scene("stop_and_friction", 13066)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    assert branch.stop_reason == ("bound", "bound") and branch.column(name)[0] == 0.0 and branch.audit.ok
    assert branch.orbits[0].success


@pytest.mark.parametrize("number", [6003, 8121])
def test_a_bound_that_is_met_at_no_angle_is_reached(number):
    """Restitution falls to nothing like the square of what else changes."""
    system, name, bounds = branch_audit.scene("stop_and_friction", number)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    assert name == "rigid_stop.restitution" and branch.stop_reason[0] == "bound"
    assert branch.column(name)[0] == 0.0 and branch.orbits[0].success


@pytest.mark.parametrize(("kind", "number"), [("two_stops", 2001), ("two_stops", 4030), ("belt", 2002), ("two_masses", 3014),
                                              ("two_masses", 4029), ("stop_and_friction", 15074)])
def test_scenes_whose_audit_once_was_not_ok(kind, number):
    """Every change of multipliers has its special point, every special point a place.

    Towards restitution 0 the distance of a peak from the stop falls like its square to rounding, of which no minimum is looked for.
    """
    system, name, bounds = branch_audit.scene(kind, number)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    assert branch.audit.ok, branch.audit
    assert np.isfinite([[point.s, point.parameter] for point in branch.special_points]).all()


@pytest.mark.parametrize("number", [121, 3001, 3014, 3021])
def test_chattering_under_friction_ends_where_it_completes_no_more(number):
    """The push falls to the limit of friction: rows are motions to the end, which is named."""
    row = branch_audit.audited("stop_and_friction", number, back=False)
    assert row.found and row.ok and (row.not_repeated, row.failed, row.ends) == (0, 0, [])


def test_folds_among_grazings_that_accumulate_are_all_found():
    """Between two births of an impact the parameter turns back once, down to impacts as slow as 1e-9; each fold is nearer to the
    end of the chattering by the restitution of the stop, the ratio of the last flights."""
    system, name, bounds = branch_audit.scene("between_masses", 60038)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    points = [point for point in branch.special_points if point.kind in ("fold", "grazing")][:12]
    assert branch.audit.ok and [point.kind for point in points] == ["fold", "grazing"] * 6
    assert all(point.reverses for point in points)
    assert np.all(np.diff(np.sign(np.diff([point.parameter for point in points]))))  # up and down by turns
    steps = np.diff([point.parameter for point in points[::2]])
    ratios = steps[:-1] / steps[1:]
    assert np.all(np.diff(ratios) < 0.0)  # the nearer, the better
    assert ratios[0] == pytest.approx(system.parameter("rigid_stop_2.restitution"), rel=0.01)


def test_where_points_accumulate_is_told():
    """Geometric sequences have a limit, from either end; others have none."""
    values = [1.0 - 0.4**k for k in range(5)]
    assert branch_audit.limits(values) == [pytest.approx(1.0, abs=1e-12)]
    assert branch_audit.limits(values[::-1]) == [] == branch_audit.limits([0.0, 1.0, 1.5, 1.6, 1.61])
    assert branch_audit.limits(values[:4]) == []
    both = [1.0 - part * 0.4**k for k in range(5) for part in (1.0, 0.7)]  # exchanged with each impact twice
    assert branch_audit.limits(both) == pytest.approx([1.0, 1.0], abs=1e-12)
