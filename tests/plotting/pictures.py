"""Every picture of the package, drawn from small made-up results and told in words and numbers: lines, areas, labels, limits.

``pictures.json`` holds what was seen and found good.  ``python -m tests.plotting.pictures`` writes it anew: look at the pictures
that differ before you commit it.
"""

import json
import pathlib
from types import SimpleNamespace as Made

import matplotlib

matplotlib.use("Agg")

import networkx
import numpy as np
from matplotlib.colors import to_hex

from bifurc import plotting
from bifurc.elements import ElasticStator, ElasticStop, HarmonicForce, RigidStator, RigidStop
from bifurc.plotting import basins as basins_pictures
from bifurc.plotting import style
from bifurc.plotting.motions import loops, phase_plane, rotors
from tests.plotting import fakes

KNOWN = pathlib.Path(__file__).with_name("pictures.json")


# ---- a picture in words --------------------------------------------------------------------------------------------------------


def _numbers(values):
    """Return count, sums and some entries of numbers: enough to tell them from others."""
    flat = np.ma.filled(np.ma.asarray(values, float), np.nan).ravel()
    good = flat[np.isfinite(flat)]
    if not good.size:
        return [int(flat.size), 0]
    weights = np.cos(np.arange(good.size))
    picked = good[np.linspace(0, good.size - 1, min(good.size, 4)).astype(int)]
    return [
        int(flat.size),
        int(good.size),
        float(good.sum()),
        float(good @ weights),
        float(np.abs(good).sum()),
        *map(float, picked),
    ]


def _color(value):
    return None if isinstance(value, str) and value == "none" else to_hex(value, keep_alpha=True)


def _line(line):
    shown = line.get_label()
    return {
        "label": "" if shown.startswith("_") else shown,
        "x": _numbers(line.get_xdata()),
        "y": _numbers(line.get_ydata()),
        "look": [
            _color(line.get_color()),
            str(line.get_linestyle()),
            str(line.get_marker()),
            float(line.get_linewidth()),
            float(line.get_markersize()),
            _color(line.get_markerfacecolor()),
            _color(line.get_markeredgecolor()),
            float(line.get_markeredgewidth()),
            float(line.get_zorder()),
            line.get_alpha(),
            len(line.get_path_effects() or []),
            str(line.get_markevery()),
        ],
    }


def _patch(patch):
    points = patch.get_path().vertices if type(patch).__name__ in ("Circle",) else patch.get_xy()
    place = list(patch.center) + [patch.radius] if type(patch).__name__ == "Circle" else _numbers(points)
    if type(patch).__name__ == "Rectangle":
        place = [*patch.get_xy(), patch.get_width(), patch.get_height()]
    return {
        "is": type(patch).__name__,
        "place": place,
        "look": [
            _color(patch.get_facecolor()),
            _color(patch.get_edgecolor()),
            float(patch.get_linewidth()),
            str(patch.get_hatch()),
            float(patch.get_zorder()),
            patch.get_alpha(),
        ],
        "label": "" if patch.get_label().startswith("_") else patch.get_label(),
    }


def _collection(item):
    paths = [_numbers(path.vertices) for path in item.get_paths()]
    found = {
        "is": type(item).__name__,
        "paths": paths,
        "faces": [_color(c) for c in item.get_facecolor()][:6],
        "edges": [_color(c) for c in item.get_edgecolor()][:6],
        "zorder": float(item.get_zorder()),
        "widths": [float(w) for w in np.atleast_1d(item.get_linewidth())],
        "hatch": str(getattr(item, "hatches", item.get_hatch())),
        "sizes": _numbers(item.get_sizes()) if hasattr(item, "get_sizes") else None,
        "offsets": _numbers(np.asarray(item.get_offsets())),
    }
    if item.get_array() is not None:
        found |= {"array": _numbers(item.get_array()), "limits": list(map(float, item.get_clim())), "map": item.get_cmap().name}
    return found


def _image(image):
    return {
        "array": _numbers(image.get_array()),
        "extent": list(map(float, image.get_extent())),
        "limits": [float(x) for x in image.get_clim()],
        "map": image.get_cmap().name,
        "colors": [_color(image.get_cmap()(k)) for k in range(min(image.get_cmap().N, 8))],
        "norm": type(image.norm).__name__,
        "origin": image.origin,
        "zorder": float(image.get_zorder()),
    }


def described(ax) -> dict:
    """Return what is on axes."""
    legend = ax.get_legend()
    texts = [
        {
            "text": item.get_text(),
            "place": [float(x) for x in item.xy] if hasattr(item, "xy") else list(map(float, item.get_position())),
            "size": float(item.get_fontsize()),
            "at": [str(item.get_ha()), str(item.get_va()), [float(x) for x in getattr(item, "xyann", ())]],
        }
        for item in ax.texts
    ]
    found = {
        "lines": [_line(line) for line in ax.get_lines()],
        "patches": [_patch(patch) for patch in ax.patches],
        "collections": [_collection(item) for item in ax.collections],
        "images": [_image(image) for image in ax.get_images()],
        "texts": texts,
        "x": [ax.get_xlabel(), *map(float, ax.get_xlim())],
        "y": [ax.get_ylabel(), *map(float, ax.get_ylim())],
        "title": [ax.get_title(loc=loc) for loc in ("left", "center", "right")],
        "legend": None
        if legend is None
        else [
            [text.get_text() for text in legend.get_texts()],
            legend.get_title().get_text(),
            legend._ncols,
            float(legend.get_zorder()),
        ],
        "insets": [described(child) for child in ax.child_axes],
        "aspect": str(ax.get_aspect()),
    }
    return {key: value for key, value in found.items() if value not in ([], None)}


# ---- made-up results -----------------------------------------------------------------------------------------------------------


def event(time, kind, speed=0.5):
    return Made(time=time, kind=kind, speed=speed, element="stop")


def path(t):
    """Return states of two displacements at times."""
    t = np.asarray(t, float)
    return np.column_stack(
        [np.cos(t) + 0.2 * np.sin(3 * t), 0.4 * np.sin(t) - 0.1, -np.sin(t) + 0.6 * np.cos(3 * t), 0.4 * np.cos(t)]
    )


def motion(elements=(), events=(), omega=2.0, periods=2, span=2.0 * np.pi, start=0.0, **more):
    system = Made(elements=tuple(elements), omega=omega, n=2)

    def sample(n):
        t = np.linspace(start, start + span, n)
        return t, path(t)

    given = {
        "periodic": True,
        "autonomous": omega is None,
        "regime": "",
        "signature": "",
        "stable": True,
        "period": span,
        "periods": periods,
        "events": list(events),
        "system": system,
        "sample": sample,
        "sections": path(start + np.arange(periods) * (span / periods)),
    }
    return Made(**{**given, **more})


def branch(**more):
    s = np.linspace(0.0, 2.0, 9)
    x, y = 0.5 + s - 0.35 * s**2, 0.2 + 0.3 * s + 0.05 * np.sin(3 * s)
    stable = np.array([1, 1, 1, 1, 0, 0, -1, 0, 0])
    columns = {
        "s": s,
        "omega": x,
        "rms_0": y,
        "max_0": 1.5 * y,
        "rms_1": 0.5 * y,
        "max_1": 0.7 * y,
        "state_0": y - 0.1,
        "stable": stable,
        "n_events": np.array([0, 0, 0, 1, 1, 2, 2, 2, 1]),
    }
    points = [
        Made(kind="grazing", parameter=0.95, s=0.6, measures={"rms_0": 0.43}),
        Made(kind="fold", parameter=1.21, s=0.9, measures={}),
        Made(kind="peak", parameter=0.9, s=1.7, measures={"max_0": 0.9}),
        Made(kind="own_kind", parameter=0.6, s=1.9, measures={}),
    ]
    made = fakes.FakeBranch(columns, points, "omega", **more)
    made.column_names = tuple(columns)
    return made


class Cells(fakes.FakeMap):
    """A small map of starts with everything that a picture can show."""

    section = None
    periods = np.array([[3, 4, 5, 6], [1, 2, 3, 4], [7, 8, 9, 1], [2, 2, 2, 2], [5, 4, 3, 2]])
    impacts = 2 * periods
    speeds = np.where(periods > 4, np.inf, 0.1 * periods)
    reliability = Made(statement="Labels hold to 3 +- 1 of a thousand.")

    def entropy(self):
        return Made(boundary=0.1234)

    def points(self, label):
        return np.atleast_2d(self.attractors[label].sections)


def basins():
    labels = np.array([[0, 0, 1, 1], [0, 1, 1, -1], [-1, 0, 1, 1], [0, 0, -1, 1], [-1, 0, 0, 1]])
    states = np.where(labels >= 0, 0, 1)
    states[2, 0], states[4, 0] = 2, 3
    grid = Made(names=("q0", "v0"), low=(-1.0, -2.0), high=(1.5, 2.0))
    first = motion([RigidStop(1.0)], [event(1.0, "impact")], sections=np.array([[0.2, 0.3], [0.4, -0.5]]))
    second = motion(regime="chaotic", periodic=False, sections=np.cos(np.arange(500).reshape(250, 2)))
    made = Cells(labels, grid, (first, second), {0: 0.452, 1: 0.0412, -1: 0.2}, 0.031, states, Made(n=1))
    return made


def atlas():
    def one(shift, low=0.5, span=1.0):
        s = np.linspace(0.0, 1.0, 7)
        columns = {"s": s, "omega": low + span * s, "rms_0": 0.3 + shift + 0.2 * s**2, "stable": np.array([1, 1, 1, 0, 0, 1, 1])}
        points = [Made(kind="fold", parameter=low + 0.4 * span, s=0.4, measures={})]
        return fakes.FakeBranch(columns, points, "omega")

    branches = [one(0.0), one(0.2, 1.0, 0.03), one(0.25, 1.01, 0.03), one(0.3, 1.02, 0.02), one(0.5, 0.6, 0.5)]
    rows = [
        {"periods": n, "from": b.columns["omega"][0], "to": b.columns["omega"][-1]}
        for n, b in zip((1, 2, 2, 1, 3), branches, strict=True)
    ]
    for made in branches:
        made.columns["n_events"] = np.zeros(7, int)
    return Made(
        branches=branches,
        table=lambda: rows,
        bounds=(0.5, 1.5),
        parameter="omega",
        system=Made(n=1),
        chaos=[(1.2, 1.3, 0)],
        coexistence=[(0.5, 1.0, (0,)), (1.0, 1.1, (0, 1, 2)), (1.1, 1.2, ()), (1.2, 1.22, (1,))],
        probes=[Made(value=0.7), Made(value=1.1)],
    )


def sweep():
    values = np.array([1.0, 1.1, 1.2])

    def item(periods, chaotic=False, hits=0):
        return Made(
            periodic=not chaotic,
            periods=periods,
            regime="chaotic" if chaotic else "",
            autonomous=False,
            events=[event(0.1, "impact")] * hits,
            system=Made(elements=(RigidStop(1.0),)),
            sections=np.zeros((1, 2)),
            rms=lambda dof: 0.3 + 0.1 * (periods or 0) + dof,
            maximum=lambda dof: 1.0 + dof,
            minimum=lambda dof: -1.0 - dof,
        )

    tracks = [
        Made(number=0, values=values, attractors=[item(1), item(1), item(2)], fractions=np.array([0.5, 0.4, 0.3])),
        Made(number=1, values=values[:2], attractors=[item(1, hits=1), item(0, True)], fractions=np.array([0.3, 0.4])),
        Made(number=2, values=values[1:], attractors=[item(1, hits=2), item(3)], fractions=np.array([0.1, 0.5])),
    ]
    shares = np.array([[0.5, 0.3, 0.0], [0.4, 0.4, 0.1], [0.3, 0.0, 0.5]])
    return Made(system=Made(n=2), parameter="omega", values=values, tracks=tracks, families=((0,), (1,), (2,)), fractions=shares)


def cells():
    labels = np.array([[0, 0, 1], [-1, 1, -1], [0, -1, 1], [-1, 0, 0]])
    fates = np.where(labels >= 0, 0, np.array([[0, 0, 0], [1, 0, 2], [0, 3, 0], [1, 0, 0]]))
    graph = networkx.DiGraph()
    for node, content in {
        0: (True, 12, 0, 1, "attracting"),
        1: (False, 3, -1, 1, "transient"),
        2: (False, 40, -1, 2, "transient"),
        3: (True, 5, -1, 3, "spurious"),
        "left": (True, 0, -1, 1, "left"),
    }.items():
        closed, count, label, period, kind = content
        graph.add_node(node, closed=closed, cells=count, attractor=label, period=period, kind=kind, low=(0.1 * count,))
    graph.add_edges_from([(2, 1), (1, 0), (2, 3), (2, "left"), (2, 0)])
    attractors = (motion([RigidStop(1.0)], [event(1.0, "impact")] * 2), motion())
    return Made(
        labels=labels,
        fates=fates,
        attractors=attractors,
        fractions=[0.4, 0.25],
        samples=4,
        periods=3,
        morse=graph,
        grid=Made(
            names=("q0", "v0"),
            low=(-1.0, -2.0),
            high=(1.0, 2.0),
            widths=np.array([0.5, 4.0 / 3.0]),
            points=lambda numbers: np.column_stack([0.1 * numbers, -0.2 * numbers]),
        ),
        points=lambda label: np.array([[0.1, 0.2], [0.3, -0.4]]) * (label + 1),
        audit=Made(fraction=0.012, bounds=(0.0, 0.034)),
        groups=[
            Made(kind="spurious", cells=np.array([1, 3])),
            Made(kind="attracting", cells=np.array([2])),
            Made(kind="spurious", cells=np.array([5])),
        ],
        density=lambda group: np.array([[0.1, 0.2, 0.0], [0.3, 1e-6, 0.1], [0.1, 0.1, 0.05], [0.05, 0.0, 0.0]]) + 0.01 * group,
        absorption=lambda: Made(
            time=np.arange(12.0).reshape(4, 3),
            unresolved=0.1 * np.ones((4, 3)),
            left=0.2 * np.ones((4, 3)),
            probability=np.stack([0.3 * np.ones((4, 3)), np.linspace(0, 0.7, 12).reshape(4, 3)], axis=-1),
        ),
    )


def loop():
    def sample(n):
        t = np.linspace(0.0, np.pi, n)
        return t, np.cos(2 * t), np.sin(2 * t) + 0.5

    pieces = [
        Made(start=0.0, end=1.0, key="stick"),
        Made(start=1.0, end=2.0, key="slip+"),
        Made(start=2.0, end=3.0, key="apart"),
        Made(start=3.0, end=5.0, key="slip-"),
        Made(start=5.0, end=6.0, key="other"),
    ]
    return Made(
        sample=sample,
        displacement=lambda t: np.cos(2 * t),
        force=lambda t: np.sin(2 * t) + 0.5,
        pieces=pieces,
        omega=2.0,
        events=[event(0.3, "slip"), event(0.9, "stick"), event(1.4, "slip")],
    )


def curve(kind="fold", name="", shift=0.0):
    values = {
        "s": np.arange(6.0),
        "omega": np.arange(6.0) ** 1.5 + shift,
        "gap": np.cos(np.arange(6.0)),
        "max_0": 1.0 + 0.1 * np.arange(6.0),
    }
    points = [
        Made(kind="cusp", name="", parameters={"omega": 1.0, "gap": 0.5}, measures={"max_0": 1.1}),
        Made(kind="extremum", name="max_0", parameters={"omega": 2.0, "gap": 0.1}, measures={"max_0": 1.25}),
        Made(kind="fold", name="gap", parameters={"omega": 3.0, "gap": 0.3}, measures={"max_0": 1.3}),
    ]
    return Made(parameters=("omega", "gap"), kind=kind, special_points=points, name=name, column=values.__getitem__)


def ramp():
    heights = np.arange(12.0).reshape(2, 3, 2)
    return Made(
        parameter="zeta",
        directions=("up", "down"),
        values=np.array([[0.1, 0.2, 0.3], [0.3, 0.2, 0.1]]),
        maximum=heights,
        minimum=-heights,
        jumps=[Made(direction="up", value=0.21), Made(direction="down", value=0.12)],
    )


def pictures() -> dict:
    """Return all pictures by name, described."""
    found = {}

    def keep(name, *axes):
        found[name] = [described(ax) for ax in axes]
        figure = axes[0].figure
        if figure.get_supxlabel():
            found[name].append({"below": figure.get_supxlabel()})
        extra = [other for other in figure.axes if other not in axes]
        if name.startswith(("chart", "field", "cells")):
            found[name] += [
                {"bar": [other.get_ylabel(), [item.get_text() for item in other.get_yticklabels()] if "chart p" in name else None]}
                for other in extra
            ]
        matplotlib.pyplot.close("all")

    def axes(columns=1, rows=1):
        made = plotting.figure(columns=columns, rows=rows)[1]
        return made[0] if len(made) == 1 else made

    import matplotlib.pyplot

    keep("branch", plotting.plot_branch(branch(), axes()))
    keep("branch max", plotting.plot_branch(branch(kind="contact"), axes(), "max_0", names={"omega": "speed"}))
    keep("branch bare", plotting.plot_branch(branch(), axes(), points=False))
    proved = branch(certificate=Made(proved_rows=np.arange(9) % 2 == 0, points=[Made(proved=k == 1) for k in range(4)]))
    keep("branch proved", plotting.plot_branch(proved, axes()))
    both = plotting.plot_branches([branch(), branch(kind="slip")], axes())
    keep("branches over", plotting.plot_over(both, [[0.6, 0.3], [0.9, 0.4], [2.0, 1.0]], [0.01, 0.03, np.inf]))
    keep("branch fresh", plotting.plot_branch(branch()))

    stops = [HarmonicForce(1.0), RigidStop(1.3), ElasticStop(0.9, side=-1), RigidStop(0.2, dof=1)]
    events = [event(0.7, "impact"), event(2.0, "contact"), event(2.4, "separation"), event(5.0, "graze"), event(9.0, "impact")]
    keep("orbit", *plotting.plot_orbit(motion(stops, events), axes(2)))
    keep("orbit other", *plotting.plot_orbit(motion(stops, events, omega=None, stable=None), axes(2), 1, 300))
    swinging = [RigidStop(1.4, amplitude=0.2, harmonic=1, phase=0.3), RigidStop(1.2, side=-1)]
    keep("orbit wall", *plotting.plot_orbit(motion(swinging, [], stable=False), axes(2)))
    keep("trajectory", *plotting.plot_trajectory(motion(stops, events, start=0.3, periodic=False), axes(2)))
    keep("trajectory free", *plotting.plot_trajectory(motion([], [], omega=None)))
    ring, casing = ElasticStator(radius=0.8, centre_x=0.1), RigidStator(radius=1.2, x=0, y=1, against_x=2, against_y=3)
    keep("rotor", *plotting.plot_orbit(motion([ring], events), axes(2)))
    keep("rotor in a casing", *plotting.plot_trajectory(motion([casing], events, start=0.2, periodic=False), axes(2)))
    keep("spectrum", plotting.plot_full_spectrum(motion([ring], samples=64), axes(), samples=64))
    keep("spectrum free", plotting.plot_full_spectrum(motion([ring], omega=None, periodic=False), axes(), (1, 0), 64, 3.0))
    keep("loop", plotting.plot_loop(loop(), axes(), 20, color="red"))
    keep("loop states", loops.plot_states(loop(), axes(), 20))

    keep(
        "basins",
        plotting.plot_basins(
            basins(),
            axes(),
            saddle=[
                Made(sections=np.array([[0.1, 0.2]])),
                Made(sections=np.zeros((0, 2))),
                Made(sections=np.array([[0.3, 0.4], [0.5, 0.6]])),
            ],
        ),
    )
    sets = Made(points=np.array([[0.0, 0.1], [0.2, 0.3], [0.4, 0.5]]), curves=np.array([0, 0, 1]))
    other = basins()
    other.section, other.reliability, other.states = Made(), None, None
    other.label_uncertainty = 1e-7
    keep("basins sets", plotting.plot_basins(other, axes(), Made(sections=np.array([[0.1, 0.2]])), sets, sets))
    keep("basins fresh", plotting.plot_basins(basins()))
    for field in ("periods", "impacts", "speeds"):
        keep(f"field {field}", plotting.plot_field(basins(), field, axes()))
    keep(
        "edge",
        plotting.plot_edge(Made(basins=basins(), saddle=Made(sections=np.array([[0.1, 0.2], [0.3, 0.1]]))), None, sets, sets),
    )
    keep("sweep", *plotting.plot_sweep(sweep(), axes(rows=2), [branch()]))
    keep("sweep max", *plotting.plot_sweep(sweep(), axes(rows=2), measure="max_1"))
    keep("sweep min", *plotting.plot_sweep(sweep(), None, measure="min_0"))
    keep("ramp", plotting.plot_ramp(ramp(), axes(), branches=[branch()]))
    keep("ramp min", plotting.plot_ramp(ramp(), axes(), "min_1"))
    diagram = Made(
        parameter="omega",
        values=np.array([1.0, 1.5, 2.0]),
        directions=("up", "down"),
        points=np.sin(np.arange(48.0)).reshape(2, 3, 2, 2, 2),
    )
    diagram.points[0, 1, 0] = np.nan
    keep("diagram", plotting.plot_diagram(diagram, axes(), branches=[branch(), fakes.branch_without()]))
    keep(
        "diagram one",
        plotting.plot_diagram(
            Made(parameter="gap", values=np.array([1.0]), directions=("down",), points=np.ones((1, 1, 2, 2, 4))), axes(), 2
        ),
    )
    chart = Made(
        parameters=("omega", "own"),
        values=(np.array([1.0, 2.0, 4.0]), np.array([0.5])),
        periods=np.array([[1], [0], [-1]]),
        impacts=np.array([[1.0], [np.nan], [3.0]]),
        attractors=np.array([[2], [1], [0]]),
        exponents=np.array([[0.5], [-0.7], [np.nan]]),
    )
    for field in ("periods", "impacts", "attractors", "exponents"):
        keep(f"chart {field}", plotting.plot_chart(chart, axes(), field))
    many = Made(parameters=("omega", "mu"), values=(np.arange(7.0), np.arange(2.0)), periods=np.arange(14).reshape(7, 2) - 1)
    keep("chart periods of many", plotting.plot_chart(many, axes()))
    for field in ("labels", "doubt", "time", "density"):
        keep(f"cells {field}", plotting.plot_cells(cells(), axes(), field, 1))
    keep("morse", plotting.plot_morse(cells(), axes()))
    keep("morse of few", plotting.plot_morse(cells(), axes(), 10))
    keep("atlas", plotting.plot_atlas(atlas(), axes()))
    plain = atlas()
    plain.chaos, plain.branches = [], plain.branches[:2]
    rows = plain.table()[:2]
    plain.table = lambda: rows
    keep("atlas plain", plotting.plot_atlas(plain, axes(), "rms_0"))
    keep(
        "backbone",
        *plotting.plot_backbone(
            Made(omega=np.array([1.0, 1.2]), amplitude=np.array([0.1, -0.5]), damping=np.array([0.01, 0.03])), axes(2)
        ),
    )
    feedback = Made(
        intervals=[(0.1, 0.3), (0.5, 0.6)],
        gains=np.linspace(0.0, 1.0, 5),
        moduli=np.array([1.5, 0.9, 0.7, 1.2, 4.0]),
        ends=[Made(kind="fold", gain=0.1), Made(kind="own", gain=0.3)],
        best_gain=0.2,
        best_modulus=0.65,
        bounds=(0.0, 1.0),
        of="velocity",
    )
    keep("feedback", plotting.plot_feedback(feedback, axes()))
    nothing = Made(
        **{**vars(feedback), "gains": np.empty(0), "moduli": np.empty(0), "best_gain": None, "intervals": [], "ends": []}
    )
    keep("feedback none", plotting.plot_feedback(nothing, axes()))
    keep(
        "controlled",
        *plotting.plot_controlled(
            Made(states=path(np.arange(6.0)), corrections=np.array([0.0, 0.1, -0.2]), parameter="gap"), axes(2)
        ),
    )
    keep("delayed", *plotting.plot_delayed(Made(sections=path(np.arange(4.0)), start=0.5, stop=3.5, feedback=np.cos), axes(2)))
    ax = plotting.plot_curve(curve(), axes())
    keep("curves", plotting.plot_curve(curve("grazing", "own name"), plotting.plot_curve(curve(shift=1.0), ax), points=False))
    keep(
        "map",
        plotting.plot_map_diagram(
            Made(parameter="mu", values=np.array([1.0, 2.0]), points=np.arange(12.0).reshape(2, 3, 2)), axes(), 1
        ),
    )
    keep(
        "responses",
        plotting.plot_responses(
            [branch(), branch()], [0.1, 0.25], "zeta", axes(), curve=curve(), measured=np.array([[0.5, 0.3], [0.9, 0.5]])
        ),
    )
    keep("peaks", plotting.plot_peaks({"one": (curve(), [(1.0, 1.0), (13.0, 1.6)]), "": (curve(shift=2.0), [])}, "omega", axes()))
    return found


def words() -> dict:
    """Return labels, names and colours that pictures share."""
    texts = {name: style.parameter_label(name) for name in ("omega", "zeta", "gap", "mu", "own")}
    texts |= {name: style.measure_label(name) for name in ("max_0", "min_1", "rms_2", "h1_0", "u_0")}
    texts |= {f"{name} alone": style.measure_label(name, True) for name in ("max_0", "h1_0")}
    texts |= {f"component {k} of {n}": style.component_label(k, n) for n in (1, 2) for k in range(6)}
    texts |= {
        "ramp": style.sequence(5),
        "one": style.sequence(1),
        "percents": [basins_pictures._percent(x) for x in (0.05, 0.1, 0.734)],
        "small": [basins_pictures._scientific(x) for x in (0.0, 3e-4, 1e-7, 0.02, 0.004)],
        "tints": basins_pictures.tints_of(9),
        "markers": [basins_pictures.marker_color(k) for k in range(9)],
    }
    for kinds in ((), ("impact",), ("chatter", "impact"), ("contact",) * 2):
        for element in (RigidStop(), ElasticStop(), HarmonicForce()):
            made = motion([element], [event(0.1, kind) for kind in kinds])
            texts[f"{type(element).__name__} {' '.join(kinds)}"] = phase_plane.describe(made)
            texts[f"{type(element).__name__} {' '.join(kinds)}, no clock"] = phase_plane.describe(
                motion([element], made.events, omega=None)
            )
    frequency, amplitude = rotors.full_spectrum(motion(), (1, 0), 32)
    texts["spectrum"] = [_numbers(frequency), _numbers(amplitude)]
    return texts


def same(found, known, where="") -> list[str]:
    """Return what differs, numbers but for rounding."""
    if isinstance(known, dict) and isinstance(found, dict):
        keys = [f"{where}: {sorted(set(known) ^ set(found))}"] if set(known) != set(found) else []
        return keys + [text for key in known if key in found for text in same(found[key], known[key], f"{where}/{key}")]
    if isinstance(known, list) and isinstance(found, list):
        if len(known) != len(found):
            return [f"{where}: {len(found)} for {len(known)}"]
        return [text for k, (a, b) in enumerate(zip(found, known, strict=True)) for text in same(a, b, f"{where}/{k}")]
    if isinstance(known, float) or isinstance(found, float):
        close = (
            isinstance(known, int | float) and isinstance(found, int | float) and abs(found - known) <= 1e-6 * max(1.0, abs(known))
        )
        return [] if close or found != found and known != known else [f"{where}: {found!r} for {known!r}"]
    return [] if found == known else [f"{where}: {found!r} for {known!r}"]


if __name__ == "__main__":
    KNOWN.write_text(
        json.dumps({"pictures": pictures(), "words": words()}, separators=(",", ":")).replace('"],', '"],\n'), encoding="utf-8"
    )
