"""A system and its exact images (other units, coordinates, side, order, clock) move alike, whatever engine carries them."""
import functools

import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from tests.reference.images import IMAGES, SCENES, in_units, later, side_by_side, with_elements

PERIODS = 4  # to which motions are followed
every_scene = pytest.mark.parametrize("scene", SCENES)


@functools.cache
def motion_of(scene):
    motion = bf.simulate(SCENES[scene], np.zeros(2 * SCENES[scene].n), periods=PERIODS)
    assert motion.success and len(motion.events) >= 3
    return motion


def assert_same(found, motion, image, tol=1e-11, shift=0.0):
    """The motion ``found`` of an image is ``motion``, ``shift`` (time) later in its own clock."""
    sizes = np.abs(motion.y).max(axis=0)
    back = np.linalg.inv(image.matrix)
    period = motion.system.period
    events = [e for e in motion.events if e.time > shift]
    assert [(e.element, e.kind) for e in found.events] == [(e.element, e.kind) for e in events]
    for a, b in zip(found.events, events, strict=True):
        assert abs(a.time / image.time + shift - b.time) < tol * period
        assert np.abs((a.before @ back.T - b.before) / sizes).max() < tol
        assert np.abs((a.after @ back.T - b.after) / sizes).max() < tol
        assert (a.ratio is None) == (b.ratio is None)
        if image.mirrored is False and a.mode_after is not None:
            keys = dict(zip(found.system.labels, a.mode_after, strict=True))
            assert tuple(keys[name] for name in motion.system.labels) == b.mode_after
    times = np.linspace(shift, motion.stop, 37)
    assert np.abs((found((times - shift) * image.time) @ back.T - motion(times)) / sizes).max() < tol


@pytest.mark.parametrize("image", IMAGES)
@every_scene
def test_images_move_alike(scene, image):
    image = IMAGES[image](SCENES[scene])
    assert_same(bf.simulate(image.system, np.zeros(2 * image.system.n), periods=PERIODS), motion_of(scene), image)


@every_scene
@pytest.mark.parametrize("units", [(1e-4, 1.0, 1.0), (1.0, 1e5, 1e-3), (1e5, 1.0, 1.0)], ids=str)
def test_speeds_of_events_have_the_unit_of_their_guards(scene, units):
    """An impact is as fast, a force that reaches its limit grows as fast, in any unit."""
    image = in_units(SCENES[scene], *units)
    length, time, mass = units
    rates = {length / time, length / time**2, mass * length / time**3, 1.0 / time}  # of gaps, speeds, forces and loads
    found = bf.simulate(image.system, np.zeros(2 * image.system.n), periods=PERIODS)
    for a, b in zip(found.events, motion_of(scene).events, strict=True):
        assert a.speed == pytest.approx(b.speed * min(rates, key=lambda r: abs(a.speed - b.speed * r)), rel=1e-9)


@every_scene
@pytest.mark.parametrize("part", [0.25, 0.5, 1.3])
def test_a_later_clock_goes_on_with_the_same_motion(scene, part):
    motion = motion_of(scene)
    shift = part * motion.system.period
    image = later(motion.system, part)
    found = bf.simulate(image.system, motion(shift), duration=motion.stop - shift)
    assert_same(found, motion, image, shift=shift)


@every_scene
def test_a_start_at_any_time_goes_on_with_the_same_motion(scene):
    """The same with the clock of the system: ``t0``, with a part of a period and whole ones."""
    motion = motion_of(scene)
    for t0 in (0.37 * motion.system.period, 2.61 * motion.system.period):
        rest = bf.simulate(motion.system, motion(t0), duration=motion.stop - t0, t0=t0)
        assert np.abs(rest.final - motion.final).max() < 1e-10 * np.abs(motion.y).max()
        assert [e.kind for e in rest.events] == [e.kind for e in motion.events if e.time > t0]


PARALLEL = {el.BaseMotion: ("amplitude",), el.HarmonicForce: ("amplitude",), el.LinearSpring: ("stiffness", "damping"),
            el.ElasticStop: ("stiffness", "damping"), el.Jenkins: ("stiffness", "limit"), el.Iwan: ("stiffnesses", "limits"),
            el.MicroSlip: ("spring", "contact", "limits")}  # what a half has half of


@pytest.mark.parametrize("scene, place", [(name, k) for name, system in SCENES.items()
                                          for k, element in enumerate(system.elements) if type(element) in PARALLEL])
def test_halves_of_an_element_do_what_the_whole_does(scene, place):
    """Springs, dashpots, loads and elastic stops in parallel, and two equal sliders of half the size, add up."""
    system = SCENES[scene]
    whole = system.elements[place]
    half = whole.with_parameters(**{name: tuple(0.5 * v for v in value) if isinstance(value, tuple) else 0.5 * value
                                    for name in PARALLEL[type(whole)] for value in [getattr(whole, name)]})
    rest = [e for e in system.elements if e is not whole]
    found = bf.simulate(with_elements(system, [*rest, half, half.with_parameters(label="half")]), np.zeros(2 * system.n), periods=2)
    motion = motion_of(scene)
    times = np.linspace(0.0, found.stop, 29)
    n = 2 * system.n
    assert np.abs(found(times)[:, :n] - motion(times)[:, :n]).max() < 1e-10 * np.abs(motion.y).max()


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("first", [True, False])
def test_an_uncoupled_mass_goes_its_own_way(scene, first):
    """Two systems written as one: each moves as alone, before or behind the other."""
    system, motion = SCENES[scene], motion_of(scene)
    alone = bf.System(2.0, 0.3, 1.5, (el.HarmonicForce(0.4, harmonic=2), el.RigidStop(0.01, 0.5)), omega=system.omega)
    other = bf.simulate(alone, np.zeros(2), periods=PERIODS)
    assert len(other.events) >= 2
    one, at, free = side_by_side(system, alone, first)
    found = bf.simulate(one, np.zeros(2 * one.n), periods=PERIODS)
    times = np.linspace(0.0, found.stop, 23)
    assert np.abs(found(times)[:, at] - motion(times)).max() < 1e-10 * np.abs(motion.y).max()
    assert np.abs(found(times)[:, free] - other(times)).max() < 1e-10 * np.abs(other.y).max()
    assert len(found.events) == len(motion.events) + len(other.events)


def test_a_complete_chattering_in_a_later_period_ends_in_that_period():
    """The end of its infinitely many impacts is a time like any other, counted from the start of the motion."""
    system = bf.System(1.0, 0.1, 1.0, (el.HarmonicForce(1.0), el.RigidStop(0.1, 0.6)), omega=0.3)
    motion = bf.simulate(system, (0.0, 0.0), periods=4)
    ends = [(e.time, e.end) for e in motion.events if e.kind == "chatter"]
    following = [min(e.time for e in motion.events if e.time > time) for time, _ in ends[:-1]]
    assert len(ends) >= 3
    for (time, end), after in zip(ends, following, strict=False):
        assert time < end < after and end - time < 0.1 * system.period
        assert abs(motion(end + 1e-9)[0] - 0.1) < 1e-9 and abs(motion(end + 1e-9)[1]) < 1e-9
