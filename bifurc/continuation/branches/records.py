"""A branch as plain arrays and a header, and back: rows rebuilt from them are bit for bit those of the trace."""
import copy

import numpy as np

from ... import io
from ..kinds import CorrectorStatus, End, LocationStatus, SpecialPointKind, StopReason
from ..monitors import WithMonitors, unknown
from ..peaks import WithPeaks
from ..problem import Corrected, Problem
from ..registry import OF_RECORD, named
from ..steps.rows import Part, Row
from .special import SpecialPoint

TOLD = ("s", "parameter", "slope", "iterations", "residual", "angle", "det_sign", "det_log", "singular", "ds")  # one number a row


def to_arrays(rows, parts):
    """Return the arrays of rows in the order of arclength; ``parts`` (m,) index of the problem of each row."""
    sizes = [row.x.size for row in rows]
    counts = [len(row.tests) - 1 for row in rows]
    told = np.array([(row.s, row.p, row.tests[0], row.iterations, row.residual, row.angle, row.det_sign, row.det_log, row.singular,
                      row.ds) for row in rows]).T.copy()
    arrays = {
        **dict(zip(TOLD, told, strict=True)),
        "x": np.concatenate([row.x for row in rows]),
        "tangent": np.concatenate([row.tangent for row in rows]),
        "offsets": np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        "monitors": np.array([value for row in rows for value in row.tests[1:]], float),
        "monitor_offsets": np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        "part": np.array(parts, np.int64),
    }
    arrays["iterations"], arrays["singular"] = arrays["iterations"].astype(np.int64), arrays["singular"].astype(bool)
    names = dict.fromkeys(name for row in rows if row.recorded for name in row.recorded)
    for name in names:
        arrays["recorded/" + name] = np.array([(row.recorded or {}).get(name, np.nan) for row in rows])
    return arrays


def rows_of(arrays, problems):
    """Return the rows that `to_arrays` was given."""
    parts = [Part(problem, k) for k, problem in enumerate(problems)]
    rows = []
    offsets, places = arrays["offsets"], arrays["monitor_offsets"]
    recorded = [name for name in arrays if name.startswith("recorded/")]
    for i in range(arrays["s"].size):
        x = arrays["x"][offsets[i]:offsets[i + 1]].copy()
        tangent = arrays["tangent"][offsets[i]:offsets[i + 1]].copy()
        monitors = arrays["monitors"][places[i]:places[i + 1]].copy()
        status = CorrectorStatus.SINGULAR if arrays["singular"][i] else CorrectorStatus.CONVERGED
        c = Corrected(x, tangent, True, status, int(arrays["iterations"][i]), float(arrays["residual"][i]), 0.0, 0.0,
                      float(arrays["det_sign"][i]), float(arrays["det_log"][i]), monitors)
        row = Row(c, parts[int(arrays["part"][i])], float(arrays["s"][i]), float(arrays["angle"][i]),
                  [float(arrays["slope"][i]), *monitors.tolist()], float(arrays["ds"][i]))
        if recorded:
            row.recorded = {name[len("recorded/"):]: arrays[name][i] for name in recorded}
        rows.append(row)
    counts = np.bincount(arrays["part"], minlength=len(parts))
    for row in (rows[0], rows[-1]):  # a branch that ended right behind a boundary starts again on it
        if len(parts) > 1 and counts[row.part.index] == 1 and row.part.boundary:
            row.part.born = min(row.part.boundary, key=lambda j: abs(row.tests[j]))
    return rows


def branch_record(branch, arrays):
    """Return header and arrays of a branch."""
    points = list(branch.special_points)
    indices = {id(problem): k for k, problem in enumerate(branch.problems)}
    header = {
        "kind": "branch",
        "parameter": branch.parameter,
        "problems": [problem.to_record() for problem in branch.problems],
        "options": branch.options,
        "ends": [{"reason": end.reason.value, "message": end.message, "rejected": end.rejected} for end in branch.ends],
        "special_points": [{"kind": point.kind.value, "status": point.status.value, "name": point.name,
                            "reverses": point.reverses, "before": point.before, "after": point.after,
                            "problem": indices.get(id(point.problem), -1),
                            "successor": indices.get(id(point.successor), -1)} for point in points],
        "unresolved": [[kind, s, p] for kind, s, p in branch.unresolved],
    }
    stored = {name.replace("recorded/", "recorded."): values for name, values in arrays.items()}
    stored["bounds"] = np.array(branch.bounds, float)
    stored["ends"] = np.array([[end.p, end.ds] for end in branch.ends])
    stored["special"] = np.array([[point.s, *point.bracket, point.error] for point in points]).reshape(len(points), 4)
    stored["special_x"] = joined([point.x for point in points])
    stored["special_tangent"] = joined([point.tangent for point in points])
    for name in dict.fromkeys(name for point in points for name in point.recorded):
        stored["special_recorded." + name] = np.array([point.recorded.get(name, np.nan) for point in points])
    crossings = [point.directions.ravel() for point in points if point.directions is not None]
    stored["special_directions"] = joined(crossings)
    stored["special_crossing"] = np.array([point.directions is not None for point in points], bool)
    return header, stored


def from_arrays(kind, header, arrays, problem, elements):
    """Rebuild a branch of class ``kind`` from `branch_record`."""
    problems = [problem_from(record, problem, elements) for record in header["problems"]]
    _check(header, arrays, [made.scale.size for made in problems])
    points, start, crossing = [], 0, 0
    names = [name for name in arrays if name.startswith("special_recorded.")]
    for k, entry in enumerate(header["special_points"]):
        owner = problems[entry["problem"]]
        size = owner.scale.size
        directions = None
        if arrays["special_crossing"][k]:
            directions = arrays["special_directions"][crossing:crossing + 2 * size].reshape(2, size)
            crossing += 2 * size
        s, low, high, error = (float(value) for value in arrays["special"][k])
        x, tangent = (arrays[name][start:start + size] for name in ("special_x", "special_tangent"))
        points.append(SpecialPoint(
            SpecialPointKind(entry["kind"]), float(x[-1]), error, s, (low, high), x, tangent,
            LocationStatus(entry["status"]), entry["reverses"], entry["name"], entry["before"], entry["after"],
            directions, owner, problems[entry["successor"]] if entry["successor"] >= 0 else None,
            {name[len("special_recorded."):]: float(arrays[name][k]) for name in names if np.isfinite(arrays[name][k])}))
        start += size
    ends = tuple(End(StopReason(entry["reason"]), entry["message"], float(p), float(ds), entry["rejected"])
                 for entry, (p, ds) in zip(header["ends"], arrays["ends"], strict=True))
    rows = {name.replace("recorded.", "recorded/"): values for name, values in arrays.items()
            if not name.startswith("special") and name not in ("bounds", "ends")}
    return kind(header["parameter"], problems, rows, points, ends, tuple(float(value) for value in arrays["bounds"]),
                header["options"], [tuple(entry) for entry in header["unresolved"]])


def _check(header, arrays, sizes):
    """Raise ValueError, naming the array, unless the arrays are those of a branch whose problems have ``sizes`` unknowns."""
    recorded = {name: "any m" for name in arrays if name.startswith("recorded.")}
    beside = {name: "real k" for name in arrays if name.startswith("special_recorded.")}
    io.fitted(arrays, {
        **dict.fromkeys(TOLD, "real m"), "s": "finite m", "parameter": "finite m", "iterations": "whole m", "singular": "logical m",
        "part": "whole m", "x": "finite all", "tangent": "finite all", "offsets": "whole m+1", "monitors": "real tests",
        "monitor_offsets": "whole m+1", "bounds": "real *", "ends": "real 2 2", "special": "real k 4",
        "special_crossing": "logical k", **recorded, **beside,
    }, k=len(header["special_points"]))
    part = arrays["part"]
    if not part.size or part.min() < 0 or part.max() >= len(sizes):
        raise ValueError(f"array 'part' holds {part}; it must hold numbers of the {len(sizes)} problems")
    if arrays["offsets"][0] != 0 or not np.array_equal(np.diff(arrays["offsets"]), np.array(sizes)[part]):
        raise ValueError("array 'offsets' does not divide 'x' into the unknowns of each row")
    if arrays["monitor_offsets"][0] != 0 or (np.diff(arrays["monitor_offsets"]) < 0).any():
        raise ValueError("array 'monitor_offsets' does not divide 'monitors' among the rows")
    mine = [sizes[entry["problem"]] for entry in header["special_points"]]
    turns = 2 * sum(size for size, crossing in zip(mine, arrays["special_crossing"], strict=True) if crossing)
    io.fitted(arrays, {"x": "finite all", "monitors": "real tests", "special_x": "finite mine", "special_tangent": "finite mine",
                       "special_directions": "finite turns"}, all=int(arrays["offsets"][-1]),
              tests=int(arrays["monitor_offsets"][-1]), mine=sum(mine), turns=turns)


def problem_from(record, problem, elements):
    """Return the problem of a record; the code of an algebraic problem must be given."""
    for key, around in (("monitors", _monitored), ("peaks", _peaked)):
        if key in record:
            return around(problem_from({k: v for k, v in record.items() if k != key}, problem, elements), record[key])
    if record["kind"] == "problem" and "peaks" not in record:
        if problem is None:
            return Missing(record)
        if type(problem).__name__ != record["class"]:
            raise ValueError(f"the branch belongs to a problem of class {record['class']!r}, "
                             f"got {type(problem).__name__!r}")
        made = copy.copy(problem)
        made.x0 = np.array(record["x0"], float)
        made.scale = np.array(record["scale"], float)
        return made
    if record["kind"] in ("curve", "unfolded"):
        base = problem_from(record["of"], problem, elements)
        return Missing(record) if isinstance(base, Missing) else named(OF_RECORD[record["kind"]])(record, base)
    return named(OF_RECORD[record["kind"]])(record, elements)


def _peaked(problem, names):
    return WithPeaks(problem, names)


def _monitored(problem, names):
    return WithMonitors(problem, {name: unknown(name) for name in names})


class Missing(Problem):
    """Stands for an algebraic problem whose code was not given: rows can be read, not extended."""

    def __init__(self, record):
        self.record = record
        self.x0 = np.array(record["x0"], float)
        self.scale = np.array(record["scale"], float)
        self.size = self.x0.size - 1

    def to_record(self):
        """Return the record it was read from."""
        return self.record

    def bounded(self, low, high, made):
        """Refuse: the code of the problem is not in the file."""
        raise ValueError(f"the file holds no code: give Branch.load(path, problem={self.record['class']}(...))")


def joined(pieces):
    """Concatenate, also nothing."""
    return np.concatenate(pieces) if pieces else np.empty(0)
