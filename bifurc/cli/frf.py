"""``bifurc frf SYSTEM``: frequency responses by harmonic balance, their peaks, and the best value of a second parameter."""
import argparse
import inspect
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import bifurc as bf
from bifurc.warm import warm_up

from .common import UsageError, check_files, check_measure, folder_of, number, range_of, reason, say_saved, system_of

FURTHER = 12  # responses beyond the end of a curve of peaks


@dataclass(frozen=True)
class Comparison:
    """What a system's responses are compared over when nothing but its name is given."""

    name: str  # the second parameter
    values: tuple[float, ...]
    span: tuple[float, float]  # over which its peak is followed
    variants: tuple[str, tuple[str, ...]] = ("", ("",))  # a keyword of the builder, and what it may be


_COMPARISONS = {
    "friction_damped_oscillator": Comparison("normal_load", (10.0, 50.0, 100.0, 200.0, 400.0, 1000.0), (10.0, 1100.0),
                                             ("damper", ("macro", "micro"))),
    "jenkins_oscillator": Comparison("limit", (0.1, 0.5, 1.0, 2.0, 4.0), (0.05, 6.0)),
}


def add(commands, shared) -> None:
    """Add the command to the parser."""
    frf = commands.add_parser("frf", parents=[shared], help="frequency responses by harmonic balance, and their peaks",
                              description=inspect.getdoc(run_frf))
    frf.add_argument("--parameter", metavar="NAME", help="the parameter along the response")
    frf.add_argument("--bounds", metavar=("A", "B"), type=number, nargs=2, help="its range")
    frf.add_argument("--vary", metavar="X", nargs="+", help="name of a second parameter, then its values")
    frf.add_argument("--harmonics", metavar="H", type=int, default=21, help="kept in the balance (default: %(default)s)")
    frf.add_argument("--measure", metavar="COLUMN", default="max_0", help="whose peaks are sought (default: %(default)s)")
    frf.add_argument("--data", metavar="FILE", help="measured points drawn over the responses: columns parameter, amplitude")
    frf.set_defaults(run=run_frf)


def run_frf(options: argparse.Namespace) -> int:
    """Trace frequency responses, check their peaks against the true motion, follow the peak over a second parameter."""
    name, system, story = system_of(options)
    parameter = system.parameter_name(options.parameter or story.parameter)
    low, high = range_of(options, system, story, parameter)
    compared = _compared(name, system, options)
    check_measure(options.measure, system)
    if low == high:
        raise UsageError(f"--bounds must be two different numbers, got {low:g} twice")
    if options.harmonics < 1:
        raise UsageError(f"--harmonics must be at least 1, got {options.harmonics}")
    measured = None if options.data is None else read_points(options.data)
    method = bf.HarmonicBalance(harmonics=options.harmonics)
    folder = Path(options.out)
    keyword, variants = compared.variants
    files = {(variant, value): folder / f"{_stem(name, 'frf', variant, f'{value:g}' if compared.name else '')}.npz"
             for variant in variants for value in compared.values}
    curves = {variant: folder / f"{_stem(name, 'peaks', variant)}.npz" for variant in variants}
    check_files(*files.values(), *curves.values())
    print(f"{system!r}: {parameter} from {low:g} to {high:g}, {options.harmonics} harmonics", flush=True)
    warm_up()
    folder = folder_of(options.out)
    drawn: dict[str, tuple[list, Any, list]] = {}
    for variant in variants:
        chosen = system if not keyword else rebuilt(name, system, keyword, variant)
        print(f"\n{keyword} {variant}".rstrip() if keyword else "")
        head = f"{compared.name or 'response':>12}{'peak at ' + parameter:>20}{'balance':>14}{'true motion':>14}  stable"
        print(head + "\n" + "-" * len(head))
        branches = []
        for value in compared.values:
            start = chosen.with_parameters(**{parameter: low, **({compared.name: value} if compared.name else {})})
            orbit = bf.find_orbit(start, method=method)
            if not orbit.success:
                raise UsageError(f"no response at {compared.name} = {value:g}: {orbit.message}")
            branch = bf.trace(orbit, parameter, bounds=(low, high), peaks=options.measure, progress=not options.quiet)
            branch.save(files[variant, value])
            branches.append(branch)
            for line in peak_lines(branch, options.measure, f"{value:g}" if compared.name else ""):
                print(line)
            if "interrupt" in reason(branch):
                raise KeyboardInterrupt
        curve = followed(branches, parameter, compared, (low, high), options.measure) if compared.name else None
        peaks = [(value, highest(branch, options.measure)) for value, branch in zip(compared.values, branches, strict=True)]
        if curve is not None:
            peaks += further(chosen, parameter, compared, (low, high), curve, method, options)
            curve.save(curves[variant])
            for point in curve.special_points:
                if point.kind == "extremum" and point.name == options.measure:
                    print(f"extreme peak: {point.measures[options.measure]:.6g} at {compared.name} = "
                          f"{point.parameters[compared.name]:.6g}")
        drawn[variant] = branches, curve, sorted(peak for peak in peaks if peak[1] is not None)
    draw(drawn, compared, name, folder, options, measured)
    return 0


def _stem(*parts: str) -> str:
    return "_".join(filter(None, parts))


def read_points(path: str) -> np.ndarray:
    """Return measured points (k, 2) from a text file of two columns, with or without a line of names.

    Raises
    ------
    UsageError
        Telling the line that cannot be read.
    """
    rows: list[list[float]] = []
    for place, line in enumerate(Path(path).read_text(encoding="utf-8-sig").splitlines(), 1):
        parts = line.split("#")[0].replace(",", " ").replace(";", " ").split()
        try:
            values = [float(part) for part in parts]
        except ValueError:
            if not rows:  # names
                continue
            raise UsageError(f"--data {path}: line {place} is not two numbers: {line.strip()!r}") from None
        if values:
            if len(values) < 2 or not np.isfinite(values).all():
                raise UsageError(f"--data {path}: line {place} is not two finite numbers: {line.strip()!r}")
            rows.append(values[:2])
    if not rows:
        raise UsageError(f"--data {path} holds no points")
    return np.array(rows)


def rebuilt(name: str, system: Any, keyword: str, variant: str) -> Any:
    """Return the system of the same builder with another word for one of its keywords."""
    return getattr(bf.systems, name)(**{**system.parameters, keyword: variant})


def peak_lines(branch: Any, measure: str, value: str) -> list[str]:
    """Return a line a peak: its place, its height by the balance and of the true motion there, and whether it is stable."""
    lines = []
    for point in branch.special_points.of("peak"):
        balanced = point.solution
        true = bf.find_orbit(balanced.system, guess=balanced)
        height = _height(true, measure) if true.success else float("nan")
        stable = {True: "yes", False: "no"}.get(true.stable if true.success else balanced.stable, "unknown")
        exact = f"{height:>14.6f}" if true.success else f"{'not found':>14}"
        lines.append(f"{value:>12}{point.parameter:>20.8f}{point.measures[measure]:>14.6f}{exact}  {stable}")
    return lines or [f"{value:>12}{'no peak in the range':>20}"]


def _height(orbit: Any, measure: str) -> float:
    kind, dof = measure.split("_")
    if kind == "h1":
        return abs(orbit.harmonic(1, int(dof)))
    return {"max": orbit.maximum, "min": orbit.minimum, "rms": orbit.rms}[kind](int(dof))


def followed(branches: list, parameter: str, compared: Comparison, bounds: tuple[float, float], measure: str) -> Any:
    """Return the curve of the highest peak of a response in the middle, over the span of the second parameter, or None."""
    with_peaks = [branch for branch in branches if len(branch.special_points.of("peak"))]
    if not with_peaks:
        return None
    middle = with_peaks[(len(with_peaks) - 1) // 2]
    peak = max(middle.special_points.of("peak"), key=lambda point: point.measures[measure])
    return bf.trace_curve(peak, (compared.name, parameter), bounds={compared.name: compared.span, parameter: bounds})


def highest(branch: Any, measure: str) -> float | None:
    """Return the height of the highest located peak of a response, or None."""
    return max((float(point.measures[measure]) for point in branch.special_points.of("peak")), default=None)


def further(system: Any, parameter: str, compared: Comparison, bounds: tuple[float, float], curve: Any, method: Any,
            options: argparse.Namespace) -> list[tuple[float, float | None]]:
    """Return peaks of responses at values that the curve of peaks did not reach: it ends where a peak becomes a corner."""
    reached = curve.column(compared.name)
    values = [value for value in np.geomspace(max(reached.max(), 1e-3 * compared.span[1]), compared.span[1], FURTHER + 1)[1:]
              if value > reached.max() * (1.0 + 1e-9)]
    found = []
    for value in values:
        orbit = bf.find_orbit(system.with_parameters(**{parameter: bounds[0], compared.name: float(value)}), method=method)
        if orbit.success:
            branch = bf.trace(orbit, parameter, bounds=bounds, peaks=options.measure)
            found.append((float(value), highest(branch, options.measure)))
    return found


def draw(drawn: dict[str, tuple[list, Any, list]], compared: Comparison, name: str, folder: Any,
         options: argparse.Namespace, measured: np.ndarray | None = None) -> None:
    """Draw the responses, one picture a variant side by side, with measured points, and the heights of their peaks."""
    figure, axes = bf.plotting.figure(3.6 * len(drawn) + 0.6, 3.4, columns=len(drawn), sharey=True)
    for ax, (variant, (branches, curve, _)) in zip(axes, drawn.items(), strict=True):
        bf.plotting.plot_responses(branches, compared.values, compared.name, ax, options.measure, curve, measured)
        ax.set_title(variant, loc="left", fontsize=8)
    say_saved(bf.plotting.save_figure(figure, folder / f"{name}_frf.{options.format}"))
    curves = {variant: (curve, peaks) for variant, (_, curve, peaks) in drawn.items() if curve is not None}
    if curves:
        figure, (ax,) = bf.plotting.figure(4.6, 3.2)
        bf.plotting.plot_peaks(curves, compared.name, ax, options.measure)
        say_saved(bf.plotting.save_figure(figure, folder / f"{name}_peaks.{options.format}"))


def _compared(name: str, system: Any, options: argparse.Namespace) -> Comparison:
    """Return what is compared: that of the command line, or of the system's story, or the one system as it is."""
    if options.vary is None:
        return _COMPARISONS.get(name, Comparison("", (0.0,), (0.0, 0.0)))
    varied, *texts = options.vary
    varied = system.parameter_name(varied)
    system.parameter(varied)  # it varies
    values = tuple(sorted(number(text) for text in texts))
    if len(values) < 2:
        raise UsageError(f"--vary takes a parameter and two or more values, got {' '.join(options.vary)!r}")
    variants = _COMPARISONS[name].variants if name in _COMPARISONS else ("", ("",))
    return Comparison(varied, values, (values[0], values[-1]), variants)
