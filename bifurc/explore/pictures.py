"""What is shown as plain arrays for the plots: lines of a diagram, an orbit with its jumps and stops, a slice of starts."""
from typing import Any

import numpy as np

from ..plotting import style
from ..plotting.basins import cell_codes, marker_color, section_points, tints_of
from ..plotting.branches import runs
from ..plotting.motions.phase_plane import stops
from .model import Shown

_JUMPS = ("impact", "chatter")
_SAMPLES = 1500
_FAR = 1e6  # of the size of a motion: where a wall ends
_DASHES = {1: "solid", 0: "dashed", -1: "dotted"}
_PALE = "#c8c8c8"


def diagram(shown: Shown) -> dict[str, dict]:
    """Return ``lines`` and ``points`` of the branch diagram."""
    lines: dict[str, list] = {name: [] for name in ("xs", "ys", "color", "dash", "words", "width")}
    points: dict[str, list] = {name: [] for name in ("x", "y", "marker", "fill", "line", "words")}
    for branch in shown.branches:
        if shown.measure not in branch.value.column_names or branch.value.parameter != shown.parameter:
            continue
        fits = shown.fits(branch)
        found, at_points = runs(branch.value, shown.measure)
        for words, contact, stable, x, y in found:
            color = style.BLACK if contact is None else style.IMPACTING if contact else style.FREE
            for name, value in (("xs", x), ("ys", y), ("color", color if fits else _PALE), ("dash", _DASHES[stable]),
                                ("words", words if fits else "other parameters"), ("width", 2.2 if stable == 1 else 1.5)):
                lines[name].append(value)
        for point, value in zip(branch.value.special_points, at_points, strict=True):
            marker, face, words = style.POINTS.get(str(point.kind), ("o", style.GREY, str(point.kind).replace("_", " ")))
            for name, item in (("x", point.parameter), ("y", value), ("marker", _MARKERS.get(marker, "circle")),
                               ("fill", face if fits else "white"), ("line", "black" if fits else _PALE),
                               ("words", words if fits else "other parameters")):
                points[name].append(item)
    return {"lines": lines, "points": points}


def chosen(shown: Shown) -> dict[str, list]:
    """Return the place of the orbit in the diagram; none where it has not this measure."""
    if shown.orbit is None:
        return {"x": [], "y": []}
    value = measure_of(shown.orbit.value, shown.measure)
    return {"x": [], "y": []} if value is None else {"x": [shown.system.parameter(shown.parameter)], "y": [value]}


def measure_of(orbit: Any, name: str) -> float | None:
    """Return a column's value of one orbit, None for one that an orbit does not tell."""
    kind, _, dof = name.rpartition("_")
    if not dof.isdigit() or kind not in ("max", "min", "rms", "h1"):
        return float(orbit.period) if name == "period" else float(len(orbit.events)) if name == "n_events" else None
    if kind == "h1":
        return abs(orbit.harmonic(1, int(dof)))
    return float({"max": orbit.maximum, "min": orbit.minimum, "rms": orbit.rms}[kind](int(dof)))


def motion(orbit: Any, dof: int) -> dict[str, Any]:
    """Return phase plane, time history, jumps, events, multipliers and stops of an orbit.

    Times are in periods of the excitation.
    """
    t, y = orbit.sample(_SAMPLES)
    n, unit = orbit.system.n, 2.0 * np.pi / orbit.system.omega
    x, v = y[:, dof], y[:, n + dof]
    jumps = [event for event in orbit.events if str(event.kind) in _JUMPS]
    at = np.array([event.time for event in jumps])
    cut = np.searchsorted(t, at)
    before = [(event.before[dof], event.before[n + dof]) for event in jumps]
    after = [(event.after[dof], event.after[n + dof]) for event in jumps]
    places = np.repeat(cut, 3)
    blank = (np.nan, np.nan)
    extra = np.array([item for pair in zip(before, [blank] * len(jumps), after, strict=True) for item in pair]).reshape(-1, 2)
    phase = {"x": np.insert(x, places, extra[:, 0]), "v": np.insert(v, places, extra[:, 1])}
    marks: dict[str, list] = {name: [] for name in ("t", "x", "marker", "fill", "words")}
    for event in orbit.events:
        marker, color, words = style.EVENTS.get(str(event.kind), ("o", style.GREY, str(event.kind)))
        for name, item in (("t", event.time / unit), ("x", float(event.before[dof])), ("marker", _MARKERS.get(marker, "circle")),
                           ("fill", color), ("words", words)):
            marks[name].append(item)
    low, high, walls = _walls(orbit, dof, t, x, unit)
    speed = 0.06 * max(float(np.ptp(v)), 1e-300)
    multipliers = np.array([]) if orbit.multipliers is None else np.asarray(orbit.multipliers, complex)
    known = multipliers[np.isfinite(multipliers)]
    return {
        "phase": phase, "history": {"t": t / unit, "x": x}, "marks": marks, "walls": walls,
        "jumps": {"xs": [[a[0], b[0]] for a, b in zip(before, after, strict=True)],
                  "vs": [[a[1], b[1]] for a, b in zip(before, after, strict=True)]},
        "section": {"x": [x[0]], "v": [v[0]]},
        "multipliers": {"re": known.real, "im": known.imag, "fill": [style.BLUE if abs(m) < 1 else style.VERMILION for m in known]},
        "all": multipliers, "x_range": (low, high), "v_range": (float(v.min()) - speed, float(v.max()) + speed),
        "t_range": (0.0, float(t[-1] / unit)),
    }


def _walls(orbit: Any, dof: int, t: np.ndarray, x: np.ndarray, unit: float) -> tuple[float, float, dict]:
    """Return the range of the coordinate with its stops, and their surfaces over time."""
    low, high = float(x.min()), float(x.max())
    found = stops(orbit.system, dof)
    surfaces = [wall.position + (np.zeros_like(t) if wall.swing is None else wall.swing(t)) for wall in found]
    margin = 0.06 * max(high - low, 1e-300)
    low, high = low - margin, high + margin
    for wall, surface in zip(found, surfaces, strict=True):
        low, high = (low, max(high, surface.max() + margin)) if wall.side > 0 else (min(low, surface.min() - margin), high)
    walls: dict[str, list] = {name: [] for name in ("ts", "xs", "x0", "x1", "hatch", "fixed")}
    for wall, surface in zip(found, surfaces, strict=True):
        far = wall.position + wall.side * _FAR * max(high - low, abs(wall.position))
        still = wall.swing is None
        for name, item in (("ts", [*(t / unit), t[-1] / unit, 0.0]), ("xs", [*surface, far, far]),
                           ("x0", wall.position if still else np.nan), ("x1", far if still else np.nan),
                           ("hatch", "right_diagonal_line" if wall.rigid else "blank"), ("fixed", still)):
            walls[name].append(item)
    return low, high, walls


def starts(basins: Any) -> dict[str, Any]:
    """Return cells, colours, bounds and attractors of a slice of starts."""
    codes, _ = cell_codes(basins)
    count = len(basins.attractors)
    (left, bottom), (right, top) = basins.grid.low, basins.grid.high
    places = basins.grid.places(basins.system.n, len(basins.scale), basins.system.states)
    marks: dict[str, list] = {name: [] for name in ("x", "y", "fill", "label")}
    for label, attractor in enumerate(basins.attractors):
        for row in section_points(attractor)[:400]:
            for name, item in (("x", row[places[0]]), ("y", row[places[1]]), ("fill", marker_color(label)), ("label", str(label))):
                marks[name].append(item)
    return {"cells": codes.T.astype(np.uint8), "palette": tints_of(count), "box": (left, bottom, right, top), "marks": marks}


_MARKERS = {"o": "circle", "D": "diamond", "s": "square", "^": "triangle", "v": "inverted_triangle", "P": "plus", "X": "x",
            "<": "triangle_pin", "*": "star", "d": "diamond"}
