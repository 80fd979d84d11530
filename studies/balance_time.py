"""Time and accuracy of harmonic balance on the elastic slider: exact events beside samples, against the number of harmonics.

The job is J1: x'' + 0.02 x' + x + Jenkins(stiffness 1, limit 1) = cos(omega t), the whole response from omega 0.4 to 2 with
multipliers at every point.  pyHarm can be run beside: ``--pyharm SCRIPT --pyharm-python PYTHON`` names a program that is
called as ``SCRIPT jenkins H N`` and prints one JSON object with ``median_cpu_s`` and ``points``.
"""
import json
import subprocess
import sys
from dataclasses import dataclass

import numpy as np

import bifurc as bf

from .common import Setting, interleaved, parser, publish, table

HARMONICS = {Setting.SMALL: (7,), Setting.FULL: (7, 21, 51)}
SAMPLES = {7: 256, 21: 1024, 51: 1024}
PEER_SAMPLES = {7: 128, 21: 128, 51: 256}  # where pyHarm is fastest with an error next to that of truncation
GAPS = {Setting.SMALL: (256, 1024), Setting.FULL: (256, 1024, 4096, 16384)}
ROUNDS = {Setting.SMALL: 1, Setting.FULL: 7}
BOUNDS = (0.4, 2.0)
ASKED = {7: 60.0, 21: 40.0, 51: 20.0}  # times faster than the peer


@dataclass(frozen=True)
class Response:
    """The whole response with one method: CPU seconds of trace and of multipliers, points, Newton steps, special points."""

    harmonics: int
    samples: int | None
    trace: float
    multipliers: float
    points: int
    iterations: int
    onsets: tuple[float, ...]
    largest: float


def oscillator(omega: float):
    """Return J1 at a frequency."""
    return bf.systems.jenkins_oscillator(zeta=0.01, omega=omega, amplitude=1.0, stiffness=1.0, limit=1.0)


def response(harmonics: int, samples: int | None, rounds: int) -> Response:
    """Return the measured response."""
    method = bf.HarmonicBalance(harmonics, aft="sampled" if samples else "exact", samples=samples)
    orbit = bf.find_orbit(oscillator(BOUNDS[0]), method=method)
    branch = bf.trace(orbit, "omega", bounds=BOUNDS)

    seconds = interleaved({"trace": lambda: bf.trace(orbit, "omega", bounds=BOUNDS),
                           "whole": lambda: bf.trace(orbit, "omega", bounds=BOUNDS).column("multiplier_0")}, rounds)
    iterations = int(branch.column("iterations").sum())
    return Response(harmonics, samples, seconds["trace"], seconds["whole"] - seconds["trace"], len(branch), iterations,
                    tuple(point.parameter for point in branch.special_points), float(branch.column("h1_0").max()))


def gaps(samples: tuple[int, ...]) -> list[tuple[float, int, float]]:
    """Return (omega, samples, relative difference of the first harmonic from that with exact events), seven harmonics."""
    rows = []
    for omega in (1.1, 1.3):
        exact = bf.find_orbit(oscillator(omega), method=bf.HarmonicBalance(7))
        for count in samples:
            method = bf.HarmonicBalance(7, aft="sampled", samples=count)
            sampled = bf.find_orbit(oscillator(omega), guess=exact, method=method)
            rows.append((omega, count, abs(sampled.harmonic(1)) / abs(exact.harmonic(1)) - 1.0))
    return rows


def errors(harmonics: tuple[int, ...] = (3, 5, 7, 11, 15, 21, 31, 51)) -> list[tuple[int, float, float]]:
    """Return (H, distance of the motion at omega 1.1 from that with 161 harmonics, estimate that the orbit states)."""
    true = bf.find_orbit(oscillator(1.1), method=bf.HarmonicBalance(161))
    theta = np.linspace(0.0, 2.0 * np.pi, 4001)
    rows = []
    for H in harmonics:
        orbit = bf.find_orbit(oscillator(1.1), guess=true, method=bf.HarmonicBalance(H))
        away = orbit.layout.values(orbit.coefficients, theta) - true.layout.values(true.coefficients, theta)
        rows.append((H, float(np.abs(away).max()), float(orbit.how["error"][0])))
    return rows


@dataclass(frozen=True)
class Study:
    """Everything that is measured."""

    responses: list[Response]
    gaps: list[tuple[float, int, float]]
    errors: list[tuple[int, float, float]]


def study(setting: Setting = Setting.FULL) -> Study:
    """Return the measurements."""
    responses = [response(H, samples, ROUNDS[setting]) for H in HARMONICS[setting] for samples in (None, SAMPLES[H])]
    return Study(responses, gaps(GAPS[setting]), errors())


def peer(script: str, python: str, harmonics) -> dict[int, tuple[float, int]]:
    """Return CPU seconds and points of pyHarm for each number of harmonics."""
    found = {}
    for H in harmonics:
        done = subprocess.run([python, script, "jenkins", str(H), str(PEER_SAMPLES[H])], capture_output=True, text=True, check=True)
        answer = json.loads(done.stdout.strip().splitlines()[-1])
        found[H] = (answer["median_cpu_s"], answer["points"])
    return found


def report(made: Study, others: dict[int, tuple[float, int]] | None) -> str:
    """Return the tables."""
    rows = []
    for r in made.responses:
        total = r.trace + r.multipliers
        ratio = None if others is None else others[r.harmonics][0] / total
        rows.append((r.harmonics, r.samples or "exact", f"{1e3 * r.trace:.1f}", f"{1e3 * r.multipliers:.1f}", r.points,
                     r.iterations, f"{r.largest:.6f}", None if ratio is None else f"{ratio:.1f}", ASKED[r.harmonics]))
    text = table("response from omega 0.4 to 2 with multipliers",
                 ("H", "samples", "trace ms", "multipliers ms", "points", "Newton", "largest |h1|", "x pyHarm", "asked"), rows)
    if others is None:
        text += "\n\npyHarm: not run (give --pyharm SCRIPT)"
    else:
        text += "\n\npyHarm, CPU ms: " + ", ".join(f"{1e3 * s:.0f} (H {H}, {PEER_SAMPLES[H]} samples, {points} points)"
                                                  for H, (s, points) in others.items())
    text += "\n\n" + table("first harmonic, sampled over exact - 1, seven harmonics", ("omega", "samples", "gap"),
                           [(omega, count, f"{gap:.1e}") for omega, count, gap in made.gaps])
    return text + "\n\n" + table("largest distance from the motion with 161 harmonics at omega 1.1", ("H", "error", "stated"),
                                 [(H, f"{away:.1e}", f"{stated:.1e}") for H, away, stated in made.errors])


def picture(made: Study):
    """Return the figure: the response with where slip begins and ends, and errors against harmonics and samples."""
    from bifurc.plotting import style
    figure, (left, right) = style.figure(6.6, 3.0, columns=2)
    for H, colour in ((1, style.VERMILION), (7, style.BLUE)):
        orbit = bf.find_orbit(oscillator(BOUNDS[0]), method=bf.HarmonicBalance((1,) if H == 1 else H))
        branch = bf.trace(orbit, "omega", bounds=BOUNDS, ds_max=0.05)
        left.plot(branch.column("omega"), branch.column("max_0"), color=colour, lw=1.2, label=f"{H} harmonic{'s' * (H > 1)}")
    for n, point in enumerate(branch.special_points):
        left.axvline(point.parameter, color="0.6", lw=0.8, ls=":", label="slip begins, ends" if n == 0 else None)
    left.set(xlabel="omega", ylabel="largest displacement", yscale="log")
    style.legend(left)
    H, away, stated = zip(*made.errors, strict=True)
    right.loglog(H, away, color=style.BLUE, marker="o", ms=4, lw=1.2, label="truncation, true")
    right.loglog(H, stated, color=style.BLUE, marker="x", ms=5, lw=0, label="truncation, as stated")
    mine = [(count, abs(gap)) for omega, count, gap in made.gaps if omega == 1.1]
    right.loglog([count for count, _ in mine], [gap for _, gap in mine], color=style.VERMILION, marker="s", ms=4, lw=1.2,
                 label="sampling (7 harmonics)")
    right.set(xlabel="harmonics, or samples a period", ylabel="error at omega 1.1")
    style.legend(right)
    return figure


def main(arguments: list[str] | None = None) -> int:
    """Run the study from the command line."""
    line = parser(__doc__)
    line.add_argument("--pyharm", metavar="SCRIPT", help="program that runs pyHarm, see the head of this file")
    line.add_argument("--pyharm-python", default=sys.executable, help="Python that runs it")
    given = line.parse_args(arguments)
    made = study(given.setting)
    others = None if given.pyharm is None else peer(given.pyharm, given.pyharm_python, HARMONICS[given.setting])
    publish(given, "balance_time", report(made, others), lambda: picture(made))
    return 0


if __name__ == "__main__":
    sys.exit(main())
