"""Branches, special points, their curves and their classification, of a system and of its exact images."""
import functools

import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from tests.reference.images import IMAGES, SCENES, in_units, later, pair

TRACED = {  # scene, parameter, bounds
    "impacts": ("stop", "harmonic_force.amplitude", (0.3, 1.2)),
    "restitution": ("stop", "rigid_stop.restitution", (0.3, 0.9)),
    "moving stop": ("two stops, one moves", "rigid_stop_2.gap", (0.65, 0.72)),
    "impacts and friction": ("stop and friction", "omega", (0.76, 0.9)),
    "static friction": ("stop and friction", "coulomb.static_ratio", (1.0, 1.5)),
    "belts": ("belts", "constant_force.force", (0.0, 0.4)),
    "belt speed": ("belts", "coulomb.belt_speed", (0.2, 0.35)),
    "elastic": ("elastic", "elastic_stop.stiffness", (4.0, 9.0)),
    "mass": ("elastic", "mass[1,1]", (1.4, 1.5)),
    "load": ("varying load", "omega", (0.75, 1.1)),
    "law": ("cubic", "cubic_spring.beta", (0.5, 1.3)),
    "falling friction": ("falling friction", "omega", (0.56, 0.9)),
}
UNITS = {"tiny": lambda system: in_units(system, 1e-8, 1e6, 1e9), "huge": lambda system: in_units(system, 1e8, 1e-6, 1e-9)}
ALIKE = {**IMAGES, **UNITS}


@functools.cache
def branch_of(case):
    scene, parameter, bounds = TRACED[case]
    return bf.trace(bf.find_orbit(SCENES[scene]), parameter, bounds=bounds)


def image_of(case, image):
    """The image of the system of a case, the name of its parameter there, and by what its values are multiplied."""
    scene, parameter, _ = TRACED[case]
    image = ALIKE[image](SCENES[scene])
    if parameter.startswith("mass"):
        old = [int(np.argmax(np.abs(image.matrix[:, k]))) for k in range(2)]
        parameter = f"mass[{old[1]},{old[1]}]"
    return image, parameter, image.factor(parameter)


# every branch with some images and every image with some branches: the others in the slow suite
@pytest.mark.parametrize("case, image", [pytest.param(case, image, marks=[pytest.mark.slow] if (i + k) % 3 else [])
                                         for i, case in enumerate(TRACED) for k, image in enumerate(ALIKE)
                                         if (case, image) not in {("mass", "turned"), ("mass", "crowded"), ("elastic", "crowded")}])
def test_images_have_the_image_of_the_branch(case, image):
    """The same special points at the same values of the parameter, and the same ends."""
    branch = branch_of(case)
    start = branch.orbits[len(branch) // 2]
    image, parameter, factor = image_of(case, image)
    begun = start.system.parameters[start.system.parameter_name(TRACED[case][1])] * factor
    system = image.system.with_parameters(**{parameter: begun})
    found = bf.trace(bf.find_orbit(system, image.state(start.state), periods=start.periods), parameter,
                     bounds=sorted(factor * value for value in TRACED[case][2]))
    points = sorted(found.special_points, key=lambda p: p.parameter / factor)
    expected = sorted(branch.special_points, key=lambda p: p.parameter)
    assert [(str(p.kind), p.status) for p in points] == [(str(p.kind), p.status) for p in expected]
    width = np.ptp(TRACED[case][2])
    for a, b in zip(points, expected, strict=True):
        assert abs(a.parameter / factor - b.parameter) < 1e-12 * width + 20.0 * b.error
        assert a.error < 1e-9 * width * abs(factor)
    assert set(found.stop_reason) == set(branch.stop_reason)
    assert found.audit.ok == branch.audit.ok


@pytest.mark.parametrize("case", ["impacts", "impacts and friction", "load", "falling friction", "belt speed"])
def test_a_later_clock_has_the_same_branch(case):
    scene, parameter, bounds = TRACED[case]
    image, branch = later(SCENES[scene], 0.41), branch_of(case)
    found = bf.trace(bf.find_orbit(image.system), parameter, bounds=bounds)
    assert [str(p.kind) for p in found.special_points] == [str(p.kind) for p in branch.special_points]
    ends = [[p.parameter for p in one.special_points] for one in (found, branch)]
    assert np.allclose(*ends, rtol=1e-11, atol=0)


@pytest.mark.parametrize("image", ["tiny", "huge", "reversed", "opposite", "turned"])
@pytest.mark.parametrize("case", ["impacts", "moving stop", "belts", "load", "law"])
def test_rows_of_images_are_images_of_rows(case, image):
    """Every row of the branch solves the image; what the branch records there is its image."""
    branch, orbit = branch_of(case), branch_of(case).orbits[3]
    image, parameter, factor = image_of(case, image)
    value = orbit.system.parameters[orbit.system.parameter_name(TRACED[case][1])]
    found = bf.find_orbit(image.system.with_parameters(**{parameter: factor * value}), image.state(orbit.state),
                          periods=orbit.periods)
    assert found.success
    again = bf.trace(found, parameter, bounds=sorted(factor * b for b in TRACED[case][2]), max_steps=2)
    mine = sorted(again.column(again.parameter) / factor)
    assert min(abs(np.array(mine) - value)) < 1e-12 * abs(value)
    row = int(np.argmin(abs(again.column(again.parameter) / factor - value)))
    for name in ("n_events", "stable", "period"):
        scale = image.time if name == "period" else 1.0
        assert again.column(name)[row] == pytest.approx(branch.column(name)[3] * scale, rel=1e-12)
    n = orbit.system.n
    A = image.matrix[:n, :n]
    if np.count_nonzero(A) == n:
        for new in range(n):
            old = int(np.argmax(np.abs(A[new])))
            assert again.column(f"rms_{new}")[row] == pytest.approx(abs(A[new, old]) * branch.column(f"rms_{old}")[3], rel=1e-10)
            ends = A[new, old] * np.array([branch.column(f"max_{old}")[3], branch.column(f"min_{old}")[3]])
            assert again.column(f"max_{new}")[row] == pytest.approx(ends.max(), rel=1e-10)


GRAZED = {"one mass": bf.System(1.0, 0.1, 1.0, (el.HarmonicForce(0.52), el.RigidStop(1.0, 0.7)), omega=0.6),
          "two masses": pair(el.HarmonicForce(0.5, dof=1), el.RigidStop(1.0, 0.6, row=(1.0, 0.4)), omega=0.6),
          "elastic": pair(el.HarmonicForce(0.5, dof=1), el.ElasticStop(1.0, 8.0, 0.3, dof=1), omega=0.6),
          "two stops": pair(el.HarmonicForce(0.5, dof=1), el.RigidStop(1.0, 0.6, dof=1), el.RigidStop(1.0, 0.6, side=-1, dof=1),
                            omega=0.6)}


@functools.cache
def grazing_point(scene, image=None):
    system = GRAZED[scene] if image is None else ALIKE[image](GRAZED[scene]).system
    factor = 1.0 if image is None else ALIKE[image](GRAZED[scene]).factor("harmonic_force.amplitude")
    first = system.elements[[type(e) is el.HarmonicForce and e.label != "no_load" for e in system.elements].index(True)].amplitude
    branch = bf.trace(bf.find_orbit(system), "harmonic_force.amplitude", bounds=sorted((first, 3.0 * first)))
    return min(branch.special_points.of("grazing"), key=lambda p: abs(p.parameter)), factor


@pytest.mark.parametrize("image", ["tiny", "huge", "reversed", "opposite", "turned"])
@pytest.mark.parametrize("scene", GRAZED)
def test_grazings_of_images_are_classified_alike(scene, image):
    """Apex accelerations have their unit; h E^k B is a number where impulses are speeds, so that all verdicts agree."""
    (point, _), (found, factor) = grazing_point(scene), grazing_point(scene, image)
    a, b, length = point.grazing, found.grazing, {"tiny": 1e-8, "huge": 1e8}.get(image, 1.0)
    image = ALIKE[image](GRAZED[scene])
    assert found.parameter == pytest.approx(factor * point.parameter, rel=1e-13)
    assert b.verdict is a.verdict and b.hysteresis == a.hysteresis
    assert b.apex == pytest.approx(a.apex * length / image.time**2, rel=1e-9)
    assert len(b.s) == pytest.approx(len(a.s), abs=2)
    k = min(len(a.s), len(b.s), 12)
    assert np.abs(b.s[:k] / b.s[0] - a.s[:k] / a.s[0]).max() < 1e-8
    assert b.multiplier == pytest.approx(a.multiplier, rel=1e-8)
    assert (np.sign(b.births[:6]) == np.sign(a.births[:6])).all() and (b.admissible[:6] == a.admissible[:6]).all()
    assert b.confirmed == a.confirmed


CURVES = {"period_doubling": ("impacts", ("omega", "harmonic_force.amplitude"), ((0.75, 0.85), (0.2, 0.5))),
          "stick_onset": ("load", ("omega", "jenkins.limit"), ((0.75, 0.95), (0.3, 0.5))),
          "fold": ("impacts and friction", ("omega", "coulomb.friction"), ((0.76, 0.82), (0.35, 0.45)))}


@functools.cache
def curve_of(kind):
    case, names, bounds = CURVES[kind]
    return bf.trace_curve(branch_of(case).special_points.of(kind)[0], names, bounds=bounds)


@pytest.mark.parametrize("kind", CURVES)
def test_points_of_a_curve_are_points_of_branches(kind):
    """A branch traced across the curve has its special point on it; the motion there is the one of the curve."""
    case, names, bounds = CURVES[kind]
    curve = curve_of(kind)
    k = len(curve) // 3
    first, second = (float(curve.column(name)[k]) for name in names)
    orbit = curve.orbits[k]
    width = 0.02 * np.ptp(bounds[0])
    system = orbit.system.with_parameters(**{names[0]: first - 0.3 * width})
    start = bf.find_orbit(system, orbit.state, periods=orbit.periods)
    if not start.success:
        start = bf.find_orbit(system)
    branch = bf.trace(start, names[0], bounds=(first - width, first + width))
    points = branch.special_points.of(kind)
    assert min(abs(p.parameter - first) for p in points) < 1e-9 * abs(first)
    assert orbit.system.parameter(names[1]) == pytest.approx(second, rel=1e-14)


@pytest.mark.parametrize("image", ["tiny", "huge", "reversed", "opposite"])
@pytest.mark.parametrize("kind", ["period_doubling", "stick_onset"])
def test_curves_of_images_are_images_of_the_curve(kind, image):
    """Ends, codimension-two points, and the second parameter as a function of the first."""
    case, names, bounds = CURVES[kind]
    image, curve = ALIKE[image](SCENES[TRACED[case][0]]), curve_of(kind)
    factors = [image.factor(name) for name in names]
    point = branch_of(case).special_points.of(kind)[0]
    start = point.solution
    values = {name: start.system.parameter(name) * factor for name, factor in zip(names, factors, strict=True)}
    near = dict(values)
    near[TRACED[case][1]] *= 1.002
    first = TRACED[case][1]
    orbit = bf.find_orbit(image.system.with_parameters(**near), image.state(start.state), periods=start.periods)
    width = 0.01 * abs(values[first])
    branch = bf.trace(orbit, first, bounds=(values[first] - width, values[first] + width))
    found = bf.trace_curve(branch.special_points.of(kind)[0], names,
                           bounds=[sorted(factor * b for b in pair) for factor, pair in zip(factors, bounds, strict=True)])
    assert sorted(str(p.kind) for p in found.special_points) == sorted(str(p.kind) for p in curve.special_points)
    for name, factor in zip(names, factors, strict=True):
        ends = np.sort([found.column(name)[[0, -1]] / factor, curve.column(name)[[0, -1]]])
        assert np.allclose(ends[0], ends[1], rtol=1e-9)
    for a in found.special_points:
        at = np.array([a.parameters[name] / factor for name, factor in zip(names, factors, strict=True)])
        assert min(np.abs(at / [b.parameters[name] for name in names] - 1.0).max() for b in curve.special_points) < 1e-7


@pytest.mark.parametrize("image", [None, "tiny", "huge", "turned", "opposite"])
@pytest.mark.parametrize("case", [case for case in TRACED if case not in {"restitution", "static friction", "belt speed", "mass"}])
def test_derivatives_of_the_equations_are_those_of_differences(case, image):
    """Fourth-order differences of the residual by every unknown and by the parameter, in steps of its own scales."""
    if image is None:
        branch = branch_of(case)
        problem, x = branch.problems[0], branch.x(0)
    else:
        orbit = branch_of(case).orbits[0]
        image, parameter, factor = image_of(case, image)
        value = orbit.system.parameters[orbit.system.parameter_name(TRACED[case][1])] * factor
        found = bf.find_orbit(image.system.with_parameters(**{parameter: value}), image.state(orbit.state), periods=orbit.periods)
        branch = bf.trace(found, parameter, bounds=sorted(factor * b for b in TRACED[case][2]), max_steps=1)
        problem, x = branch.problems[0], branch.x(0)
    told = np.column_stack(problem.jacobian(x[:-1], x[-1]))
    for k, scale in enumerate(problem.scale):
        steps = []
        for h in (1e-3 * scale, 5e-4 * scale):
            ends = [x + side * h * np.eye(x.size)[k] for side in (1.0, -1.0)]
            above, below = (problem.residual(end[:-1], end[-1]) for end in ends)
            steps.append((above - below) / (2.0 * h))
        seen = (4.0 * steps[1] - steps[0]) / 3.0
        assert np.abs(seen - told[:, k]).max() * scale < 1e-6 * max(1.0, np.abs(told[:, k]).max() * scale)
