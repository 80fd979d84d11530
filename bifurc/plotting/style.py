"""Colours, markers, words and figures that all pictures share.

Colours are those of M. Okabe and K. Ito (Color Universal Design, 2008): they stay apart for colour-blind readers and,
with the line styles and marker shapes used beside them, in grey print.
"""
import contextvars
import functools
import os
import re
import secrets
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..checks import COUNT, POSITIVE, checked, like, refused

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
GREY = "#808080"

FREE, IMPACTING = BLUE, VERMILION

# kind of special point: (marker, face colour, words)
POINTS = {
    "fold": ("o", "white", "fold"),
    "period_doubling": ("D", ORANGE, "period doubling"),
    "neimark_sacker": ("s", PURPLE, "Neimark-Sacker"),
    "branch_point": ("^", YELLOW, "branch point"),
    "grazing": ("v", GREEN, "grazing"),
    "stick_onset": ("P", SKY, "stick onset"),
    "slip_onset": ("X", SKY, "slip onset"),
    "separation": ("<", "white", "separation"),
    "chatter_completion": ("*", ORANGE, "chatter completion"),
    "peak": ("d", "white", "peak"),
    "hopf": ("h", YELLOW, "Hopf"),
    "cycle_end": ("X", VERMILION, "end of the cycle"),
    "boundary_equilibrium": ("<", SKY, "boundary equilibrium"),
}

# kind of event: (marker, colour, words)
EVENTS = {
    "impact": ("o", VERMILION, "impact"),
    "contact": ("^", VERMILION, "contact"),
    "separation": ("v", BLUE, "separation"),
    "release": ("v", GREEN, "release"),
    "chatter": ("*", PURPLE, "chatter"),
    "graze": ("d", ORANGE, "graze"),
    "stick": ("s", SKY, "stick"),
    "slip": ("D", YELLOW, "slip"),
    "cross": ("h", GREY, "crossing"),
    "slide_begin": ("s", SKY, "slide begins"),
    "slide_end": ("D", YELLOW, "slide ends"),
    "reset": ("o", VERMILION, "reset"),
}

_SYMBOLS = {"omega": r"\omega", "zeta": r"\zeta", "alpha": r"\alpha", "beta": r"\beta", "mu": r"\mu", "nu": r"\nu"}
_MEANINGS = {"omega": "forcing frequency", "amplitude": "forcing amplitude", "zeta": "damping ratio", "gap": "gap",
             "restitution": "coefficient of restitution", "stiffness_ratio": "stiffness ratio", "normal_load": "normal load"}
# from light to dark, for ordered families of lines; readable in grey and to the colour blind
_RAMP = ["#7fb8d6", "#4a98c9", "#1f78b4", "#8a6d00", "#d55e00", "#a63603", "#6b2300", "#000000"]
_MEASURES = {"max": r"\max\,", "min": r"\min\,", "rms": r"\mathrm{rms}\,"}

RC: dict[Any, Any] = {
    "font.size": 9, "axes.labelsize": 9, "axes.titlesize": 9, "xtick.labelsize": 8, "ytick.labelsize": 8,
    "legend.fontsize": 7.5, "legend.frameon": True, "legend.framealpha": 0.9, "legend.edgecolor": "none",
    "legend.borderpad": 0.3, "legend.labelspacing": 0.35, "legend.handlelength": 2.4,
    "axes.linewidth": 0.7, "lines.linewidth": 1.5, "xtick.direction": "in", "ytick.direction": "in",
    "xtick.top": True, "ytick.right": True, "xtick.minor.visible": True, "ytick.minor.visible": True,
    "xtick.major.width": 0.7, "ytick.major.width": 0.7, "xtick.minor.width": 0.5, "ytick.minor.width": 0.5,
    "mathtext.fontset": "dejavusans", "figure.dpi": 120, "savefig.dpi": 300, "pdf.fonttype": 42,
}


_NO_LABELS: dict[str, str] = {}
_LABELS: contextvars.ContextVar[dict[str, str]] = contextvars.ContextVar("labels", default=_NO_LABELS)


def checked_names(names: Mapping[str, str]) -> dict[str, str]:
    """Return labels by name.

    Raises
    ------
    ValueError
        When it is no mapping of text to text.
    """
    if not isinstance(names, Mapping) or not all(isinstance(item, str) for pair in names.items() for item in pair):
        raise refused("", "names", names, "a mapping of names to labels, such as {'omega': 'speed (rad/s)'}")
    return dict(names)


def styled(function: Callable) -> Callable:
    """Run a plotting function under the package's style; the user's own settings are untouched afterwards."""

    @functools.wraps(function)
    def inside(*arguments, names: Mapping[str, str] | None = None, **keywords):
        token = _LABELS.set({**_LABELS.get(), **checked_names(names)}) if names is not None else None
        try:
            with matplotlib.rc_context(RC):
                return function(*arguments, **keywords)
        finally:
            if token is not None:
                _LABELS.reset(token)

    return inside


@styled
@checked(width=POSITIVE, height=POSITIVE, columns=COUNT, rows=COUNT)
def figure(width: float = 6.3, height: float = 3.9, columns: int = 1, rows: int = 1,
           **options) -> tuple[Figure, list[Axes]]:
    """Return a figure that belongs to no window, for scripts and machines without a screen.

    Parameters
    ----------
    width, height : float
        Inches; 6.3 is the text width of most journals.
    columns, rows : int
        Of the grid of axes.
    **options
        Passed to `matplotlib.figure.Figure.subplots`.

    Returns
    -------
    figure : matplotlib.figure.Figure
    axes : list of matplotlib.axes.Axes
        Row by row.
    """
    made = Figure(figsize=(width, height), layout="constrained")
    return made, list(made.subplots(rows, columns, squeeze=False, **options).flat)


def shown_figure(width: float, height: float, columns: int = 1, **options) -> list[Axes]:
    """Return axes of a pyplot figure, which notebooks and ``plt.show()`` display."""
    from matplotlib import pyplot  # opens a window system where there is one: only for figures of our own

    _, axes = pyplot.subplots(1, columns, figsize=(width, height), layout="constrained", squeeze=False, **options)
    return list(axes.flat)


@styled
@checked(made=like("a figure of matplotlib", "savefig", "canvas"))
def save_figure(made: Figure, path: str | os.PathLike, **options) -> Path:
    """Write a figure to a file that appears complete or not at all; the suffix names the format.

    Parameters
    ----------
    made : matplotlib.figure.Figure
    path : path-like
        With a suffix that matplotlib knows: png, pdf, svg, ...
    **options
        Passed to `matplotlib.figure.Figure.savefig`; 300 dots per inch unless ``dpi`` is given.

    Returns
    -------
    pathlib.Path
        The file.
    """
    path = Path(path)
    known = made.canvas.get_supported_filetypes()
    kind = path.suffix[1:].lower()
    if kind not in known:
        endings = ", ".join("." + name for name in sorted(known))
        raise ValueError(f"path must end in one of {endings}, got {str(path)!r}")
    temporary = path.with_name(f".{path.name}.{os.getpid()}.{secrets.token_hex(4)}.tmp")
    try:
        made.savefig(temporary, format=kind, **{"dpi": RC["savefig.dpi"], **options})
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def sequence(count: int) -> list[str]:
    """Return ``count`` colours for lines that follow one another."""
    return [_RAMP[round(k * (len(_RAMP) - 1) / max(count - 1, 1))] for k in range(count)]


def parameter_label(name: str) -> str:
    """Return words and symbol of a parameter: ``omega`` -> forcing frequency, Greek omega; the user's own label first."""
    if name in _LABELS.get():
        return _LABELS.get()[name]
    symbol = _SYMBOLS.get(name)
    meaning = _MEANINGS.get(name)
    if meaning and symbol:
        return f"{meaning} ${symbol}$"
    return meaning or (f"${symbol}$" if symbol else name)


def measure_label(name: str, single: bool = False) -> str:
    """Return the symbol of a branch column: ``max_0`` -> max x_1 (counted from 1 in print; a single body is x)."""
    if name in _LABELS.get():
        return _LABELS.get()[name]
    match = re.fullmatch(r"(max|min|rms|h1)_(\d+)", name)
    if match is None:
        kind, _, state = name.partition("_")
        return f"{kind} {state}" if kind in _MEASURES and state else name
    x = "x" if single else f"x_{{{int(match[2]) + 1}}}"
    return f"$|h_1({x})|$" if match[1] == "h1" else f"${_MEASURES[match[1]]}{x}$"


def component_label(index: int, n: int, states: Sequence[str] = ()) -> str:
    """Return the symbol of state component ``index`` of ``n`` displacements, then ``n`` velocities, then memory; ``states`` have
    names of their own."""
    if states:
        return _LABELS.get().get(states[index], states[index])
    kind, place = ("q", index) if index < n else ("v", index - n) if index < 2 * n else ("w", index - 2 * n)
    if f"{kind}{place}" in _LABELS.get():
        return _LABELS.get()[f"{kind}{place}"]
    if index >= 2 * n:
        return f"$w_{{{index - 2 * n + 1}}}$"
    letter = "x" if index < n else r"\dot{x}"
    return f"${letter}$" if n == 1 else f"${letter}_{{{index % n + 1}}}$"


def legend(ax: Axes, **options) -> None:
    """Draw one entry a label, in the order in which the labels first appeared."""
    handles: dict = {}
    for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
        handles.setdefault(label, handle)
    if handles:
        ax.legend(list(handles.values()), list(handles), **options).set_zorder(20)
