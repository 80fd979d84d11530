"""The page: branch diagram left, orbit right, slice of starts below; it draws what the desk shows and hands on what is done.

All callbacks are Python: the page holds no script of its own.

One file, because it is one page: figures, tables and buttons name each other.
"""
import html
from typing import Any

import numpy as np
from bokeh.events import RangesUpdate, Tap
from bokeh.layouts import column, row
from bokeh.models import (
    BasicTicker,
    Button,
    ColumnDataSource,
    Div,
    LinearColorMapper,
    Range1d,
    Select,
    Slider,
)
from bokeh.plotting import figure

from ..plotting import style
from ..plotting.motions.phase_plane import describe
from ..structure.components import MEASURES
from . import model, pictures
from .desk import Desk
from .model import Shown

_TOOLS = "pan,wheel_zoom,box_zoom,reset"
SETTLED = 100  # milliseconds after the last turn of the wheel until a zoom counts as done; bokeh waits 500
_SMALL = (":host { font: 12px/1.45 system-ui, sans-serif; color: #222; } table { border-collapse: collapse; } "
          "td, th { padding: 1px 10px 1px 0; text-align: left; font-variant-numeric: tabular-nums; } "
          "th { font-weight: 600; border-bottom: 1px solid #bbb; } code { font-size: 11.5px; } "
          "svg { margin-right: 5px; vertical-align: -2px; } svg text { font-size: 14px; } .item { white-space: nowrap; }")
_STROKES = {"solid": "", "dashed": "7 4", "dotted": "2 3"}
_NO_MAP = "starts: press 'map here'"
_GLYPHS = {"circle": "&#9675;", "diamond": "&#9670;", "square": "&#9632;", "triangle": "&#9650;", "inverted_triangle": "&#9660;",
           "plus": "&#10010;", "x": "&#10006;", "star": "&#9733;"}
_COLUMNS = {"phase": "x v", "jumps": "xs vs", "section": "x v", "history": "t x", "marks": "t x marker fill words",
            "walls": "ts xs x0 x1 hatch fixed", "multipliers": "re im fill"}
_EVENTS = 9  # rows of the table of events
_STEPS = 1000  # of a slider


class View:
    """One page.

    Parameters
    ----------
    doc : bokeh Document
    desk : Desk
    """

    def __init__(self, doc: Any, desk: Desk):
        self.doc, self.desk = doc, desk
        self._drawn: Shown | None = None
        self._quiet = False  # while values are set from here: they are nobody's wish
        self._pending = False
        self._title()
        self._diagram()
        self._orbit()
        self._starts()
        left = _column(self.diagram, self.key)
        right = _column(_row(self.phase, self.circle), self.history, self.events)
        self.root = _column(self.head, self.controls, _row(left, right), _row(self.slice, _column(self.legend, self.message)))
        self.draw()

    # ---- from the desk -------------------------------------------------------------------------------------------------

    def changed(self) -> None:
        """Draw soon what is shown by then; called in any thread."""
        if not self._pending:
            self._pending = True
            self.doc.add_next_tick_callback(self.draw)

    def draw(self) -> None:
        """Draw what has changed since the last time."""
        self._pending = False
        shown, old = self.desk.now, self._drawn
        self._drawn = shown
        self._quiet = True
        try:
            if old is None or (shown.branches, shown.measure, shown.system, shown.parameter) != \
                    (old.branches, old.measure, old.system, old.parameter):
                self._draw_diagram(shown, old)
            if old is None or shown.orbit is not old.orbit or shown.measure != old.measure:
                self._draw_orbit(shown)
            if old is None or shown.basins is not old.basins:
                self._draw_starts(shown, old)
            if old is None or shown.system is not old.system:
                self._draw_values(shown)
            self._draw_words(shown)
        finally:
            self._quiet = False

    # ---- head and controls -----------------------------------------------------------------------------------------------

    def _title(self) -> None:
        shown, desk = self.desk.now, self.desk
        names = model.parameters(shown.system)
        self.head = Div(stylesheets=[_SMALL], sizing_mode="stretch_width")
        self.name = Select(title="parameter", options=names, value=shown.parameter, width=170)
        low, high = shown.bounds
        self.value = Slider(title=shown.parameter, start=low, end=high, step=(high - low) / _STEPS, format="0[.]00000",
                            value=shown.system.parameter(shown.parameter), width=330)
        self.measure = Select(title="diagram shows", options=[shown.measure], value=shown.measure, width=110)
        self.dof = Select(title="coordinate", options=[str(k) for k in range(shown.system.n)], value="0", width=90)
        buttons = []
        for label, action, kind in (("trace here", desk.trace, "primary"), ("switch here", desk.switch, "primary"),
                                    ("map here", desk.map, "primary"), ("back", desk.back, "default"),
                                    ("reset", desk.reset, "default"), ("save", desk.save, "success")):
            button = Button(label=label, button_type=kind, width=92, margin=(23, 3, 5, 3))
            button.on_click(lambda _=None, action=action: action())
            buttons.append(button)
        self.buttons = {button.label: button for button in buttons}
        self.name.on_change("value", self._named)
        self.value.on_change("value", lambda attr, old, new: self._dragged(new, False))
        self.value.on_change("value_throttled", lambda attr, old, new: self._dragged(new, True))
        self.measure.on_change("value", lambda attr, old, new: None if self._quiet else desk.show_measure(new))
        self.dof.on_change("value", lambda attr, old, new: self._draw_orbit(desk.now))
        self.controls = row(self.name, self.value, self.measure, *([self.dof] if shown.system.n > 1 else []), *buttons)

    def _named(self, attr: str, old: str, new: str) -> None:
        value = self.desk.now.system.parameter(new)
        low, high = self.desk.now.bounds if new == self.desk.now.parameter else model.reach(value)
        self._quiet = True
        try:
            self.value.update(title=new, start=min(low, value), end=max(high, value), step=(high - low) / _STEPS, value=value)
        finally:
            self._quiet = False

    def _dragged(self, value: float, done: bool) -> None:
        if not self._quiet:
            self.desk.change(self.name.value, float(value), done)

    def _draw_values(self, shown: Shown) -> None:
        value = shown.system.parameter(self.name.value)
        if value != self.value.value:
            self.value.update(start=min(self.value.start, value), end=max(self.value.end, value), value=value)

    # ---- branch diagram ----------------------------------------------------------------------------------------------------

    def _diagram(self) -> None:
        shown = self.desk.now
        self.lines, self.points, self.here = ColumnDataSource(), ColumnDataSource(), ColumnDataSource({"x": [], "y": []})
        empty = pictures.diagram(shown)
        self.lines.data, self.points.data = empty["lines"], empty["points"]
        low, high = shown.bounds
        title = "branches: click an orbit or a special point"
        self.diagram = _figure(title, shown.parameter, shown.measure, 500, (low, high), (0.0, 1.0))
        self.diagram.multi_line("xs", "ys", line_color="color", line_dash="dash", line_width="width", source=self.lines)
        self.diagram.scatter("x", "y", marker="marker", fill_color="fill", line_color="line", size=9, source=self.points)
        self.diagram.scatter("x", "y", size=16, fill_color=None, line_color="black", line_width=2.5, source=self.here)
        self.diagram.on_event(Tap, self._tapped)
        self.key = Div(stylesheets=[_SMALL], sizing_mode="stretch_width", min_height=22)

    def _tapped(self, event: Any) -> None:
        spans = [abs(axis.end - axis.start) or 1.0 for axis in (self.diagram.x_range, self.diagram.y_range)]
        self.desk.pick(float(event.x), float(event.y), (spans[0], spans[1]))

    def _draw_diagram(self, shown: Shown, old: Shown | None) -> None:
        data = pictures.diagram(shown)
        self.lines.data, self.points.data = data["lines"], data["points"]
        self.key.text = _diagram_key(data)
        if old is None or (shown.branches, shown.measure) != (old.branches, old.measure):
            self._fit(shown, data)
        self.diagram.xaxis.axis_label, self.diagram.yaxis.axis_label = shown.parameter, shown.measure
        names = [name for branch in shown.branches for name in branch.value.column_names if name.partition("_")[0] in MEASURES]
        self.measure.options = list(dict.fromkeys(names or [shown.measure]))
        self.measure.value = shown.measure

    def _fit(self, shown: Shown, data: dict) -> None:
        """Show all branches."""
        values = [item for line in data["lines"]["ys"] for item in line]
        low, high = (min(values), max(values)) if values else (0.0, 1.0)
        margin = 0.05 * (high - low) or max(0.05 * abs(high), 1e-12)
        _range(self.diagram.y_range, low - margin, high + margin)
        low = min([shown.bounds[0], *(float(x.min()) for x in data["lines"]["xs"])])
        high = max([shown.bounds[1], *(float(x.max()) for x in data["lines"]["xs"])])
        _range(self.diagram.x_range, low - 0.03 * (high - low), high + 0.03 * (high - low))

    # ---- orbit -----------------------------------------------------------------------------------------------------------

    def _orbit(self) -> None:
        self.sources = {name: ColumnDataSource() for name in _COLUMNS}
        for name, columns in _COLUMNS.items():
            self.sources[name].data = {column: [] for column in columns.split()}
        source = self.sources
        look = {"fill_color": "#e9e9e9", "hatch_pattern": "hatch", "hatch_color": "#a0a0a0", "hatch_scale": 9, "hatch_weight": 0.7,
                "source": source["walls"]}
        self.phase = _figure("phase plane", "x", "x'", 270)
        self.phase.vstrip("x0", "x1", line_color="black", **look)
        self.phase.line("x", "v", line_color=style.BLUE, line_width=1.6, source=source["phase"])
        self.phase.multi_line("xs", "vs", line_color=style.VERMILION, line_dash="dashed", line_width=1.6, source=source["jumps"])
        self.phase.scatter("x", "v", size=7, color="black", source=source["section"])
        self.history = _figure("time history", "time / forcing period", "x", 215, (0.0, 1.0))
        self.history.patches("ts", "xs", line_color="black", **look)
        self.history.line("t", "x", line_color=style.BLUE, line_width=1.6, source=source["history"])
        self.history.scatter("t", "x", marker="marker", fill_color="fill", line_color="black", size=9, source=source["marks"])
        self.circle = _figure("multipliers", "Re", "Im", 270, width=265)
        angle = np.linspace(0.0, 2.0 * np.pi, 181)
        self.circle.line(np.cos(angle), np.sin(angle), line_color="#888888")
        self.circle.scatter("re", "im", size=9, fill_color="fill", line_color="black", source=source["multipliers"])
        self.circle.xaxis.ticker = self.circle.yaxis.ticker = BasicTicker(desired_num_ticks=4)
        self.events = Div(stylesheets=[_SMALL], sizing_mode="stretch_width", min_height=60)

    def _draw_orbit(self, shown: Shown) -> None:
        self.here.data = pictures.chosen(shown)
        if shown.orbit is None:
            for name in ("phase", "jumps", "section", "history", "marks", "multipliers"):
                self.sources[name].data = {column: [] for column in self.sources[name].data}
            self.phase.title.text, self.circle.title.text, self.events.text = "no orbit", "multipliers", ""
            return
        orbit, dof = shown.orbit.value, int(self.dof.value)
        data = pictures.motion(orbit, dof)
        for name, source in self.sources.items():
            source.data = data[name]
        _range(self.phase.x_range, *data["x_range"])
        _range(self.phase.y_range, *data["v_range"])
        _range(self.history.x_range, *data["t_range"])
        _range(self.history.y_range, *data["x_range"])
        for axis, name in ((self.phase.xaxis, "x"), (self.phase.yaxis, "x'"), (self.history.yaxis, "x")):
            axis.axis_label = name if shown.system.n == 1 else f"{name} of coordinate {dof}"
        stable = {True: "stable", False: "unstable", None: "stability unknown"}[orbit.stable]
        self.phase.title.text = f"{describe(orbit)}, {stable}"
        self._draw_multipliers(data["all"])
        self.events.text = _event_table(orbit)

    def _draw_multipliers(self, multipliers: np.ndarray) -> None:
        known = multipliers[np.isfinite(multipliers)]
        reach = 1.25 * max(1.0, float(np.abs(known).max(initial=0.0)))
        for axis in (self.circle.x_range, self.circle.y_range):
            _range(axis, -reach, reach)
        words = "multipliers"
        if len(multipliers):
            words += f", largest {abs(known).max():.5g}" if len(known) == len(multipliers) else ", infinite or not unique"
        self.circle.title.text = words

    # ---- slice of starts -----------------------------------------------------------------------------------------------------

    def _starts(self) -> None:
        self.cells = ColumnDataSource({"image": [], "x": [], "y": [], "dw": [], "dh": []})
        self.marks = ColumnDataSource({"x": [], "y": [], "fill": [], "label": []})
        self.colors = LinearColorMapper(palette=["#ffffff"] * 3, low=-0.5, high=2.5)
        across, up = (*self.desk.now.window.values(), (-1.0, 1.0), (-1.0, 1.0))[:2]
        self.slice = _figure(_NO_MAP, "", "", 420, across, up, width=720)
        self.slice.image("image", "x", "y", "dw", "dh", color_mapper=self.colors, source=self.cells)
        self.slice.scatter("x", "y", size=8, fill_color="fill", line_color="white", source=self.marks)
        self.slice.xgrid.visible = self.slice.ygrid.visible = False
        self.slice.on_event(RangesUpdate, self._zoomed)
        self.slice.on_event(Tap, lambda event: self.desk.settle_on(float(event.x), float(event.y)))
        self.legend = Div(stylesheets=[_SMALL], sizing_mode="stretch_width", min_height=120)
        self.message = Div(stylesheets=[_SMALL], sizing_mode="stretch_width")

    def _zoomed(self, event: Any) -> None:
        basins = self.desk.now.basins
        if basins is not None:
            sides = sorted((float(event.x0), float(event.x1))), sorted((float(event.y0), float(event.y1)))
            self.desk.zoom({name: (low, high) for name, (low, high) in zip(basins.value.grid.names, sides, strict=True)})

    def _draw_starts(self, shown: Shown, old: Shown | None) -> None:
        if shown.basins is None:
            self.cells.data = {name: [] for name in self.cells.data}
            self.marks.data = {name: [] for name in self.marks.data}
            self.slice.title.text, self.legend.text = _NO_MAP, ""
            return
        basins = shown.basins.value
        data = pictures.starts(basins)
        left, bottom, right, top = data["box"]
        self.colors.update(palette=data["palette"], low=-0.5, high=len(data["palette"]) - 0.5)
        self.cells.data = {"image": [data["cells"]], "x": [left], "y": [bottom], "dw": [right - left], "dh": [top - bottom]}
        self.marks.data = data["marks"]
        before = None if old is None or old.basins is None else old.basins.value.grid
        if before is None or (before.low, before.high) != (basins.grid.low, basins.grid.high):
            _range(self.slice.x_range, left, right)
            _range(self.slice.y_range, bottom, top)
        self.slice.xaxis.axis_label, self.slice.yaxis.axis_label = (f"{name} at phase 0" for name in basins.grid.names)
        self.slice.title.text = (f"starts, {basins.labels.shape[0]} x {basins.labels.shape[1]} cells, "
                                 f"{shown.parameter} = {basins.system.parameter(shown.parameter):.6g}: zoom, or click one")
        self.legend.text = _basin_table(basins, data["palette"])

    # ---- words ---------------------------------------------------------------------------------------------------------------

    def _draw_words(self, shown: Shown) -> None:
        busy = f" <i>computing: {', '.join(self.desk.busy)} ...</i>" if self.desk.busy else ""
        self.head.text = f"<b>bifurc explore</b> &nbsp; <code>{html.escape(repr(shown.system))}</code>{busy}"
        self.message.text = f"<b>last step</b><br>{html.escape(shown.message)}"
        self.buttons["switch here"].disabled = shown.special_point is None
        self.buttons["back"].disabled = not self.desk.session.can_go_back
        for name in ("trace here", "map here", "save"):
            self.buttons[name].disabled = shown.orbit is None and name != "save"


def _row(*items: Any) -> Any:
    return row(*items, sizing_mode="stretch_width")


def _column(*items: Any) -> Any:
    return column(*items, sizing_mode="stretch_width")


def _figure(title: str, x: str, y: str, height: int, x_range=(-1.0, 1.0), y_range=(-1.0, 1.0), width: int | None = None) -> Any:
    """Return an empty plot with the look of all; as wide as there is room, unless its width is given."""
    size = {"sizing_mode": "stretch_width"} if width is None else {"width": width}
    made = figure(tools=_TOOLS, active_scroll="wheel_zoom", toolbar_location="above", height=height, title=title,
                  lod_timeout=SETTLED,
                  x_range=Range1d(*x_range), y_range=Range1d(*y_range), **size)
    made.toolbar.logo = None
    made.toolbar.autohide = True
    made.xaxis.axis_label, made.yaxis.axis_label = x, y
    made.axis.axis_label_text_font_style = made.title.text_font_style = "normal"
    made.title.text_font_size = "12px"
    made.grid.grid_line_color = "#eeeeee"
    return made


def _range(axis: Any, start: float, end: float) -> None:
    """Show a range, to which the reset tool returns."""
    axis.update(start=float(start), end=float(end), reset_start=float(start), reset_end=float(end))


def _diagram_key(data: dict) -> str:
    """Return the legend of the branch diagram."""
    lines, points = data["lines"], data["points"]
    found = dict.fromkeys(zip(lines["words"], lines["color"], lines["dash"], strict=True))
    marks = dict.fromkeys(zip(points["words"], points["marker"], points["fill"], strict=True))
    items = [f"<span class='item'><svg width='26' height='12'><line x2='26' y1='7' y2='7' stroke='{color}' stroke-width='2.5' "
             f"stroke-dasharray='{_STROKES.get(dash, '')}'/></svg>{html.escape(words)}</span>" for words, color, dash in found]
    items += [f"<span class='item'><svg width='15' height='15'><text y='12' fill='{'black' if fill == 'white' else fill}'>"
              f"{_GLYPHS.get(marker, '&#9679;')}</text></svg>{html.escape(words)}</span>" for words, marker, fill in marks]
    return " &ensp; ".join(items)


def _event_table(orbit: Any) -> str:
    events = list(orbit.events)
    unit = 2.0 * np.pi / orbit.system.omega
    lines = [_cells(f"{event.time / unit:.6f}", str(event.kind), str(event.element), f"{event.speed:.6g}")
             for event in events[:_EVENTS]]
    more = f"<br>and {len(events) - _EVENTS} more" if len(events) > _EVENTS else ""
    head = "<tr><th>time / T</th><th>event</th><th>element</th><th>speed</th></tr>"
    return f"<table>{head}{''.join(lines)}</table>{more}" if events else "no events in a period"


def _basin_table(basins: Any, palette: list[str]) -> str:
    special = len(palette) - len(basins.attractors)
    rows = [(palette[special + k], describe(item), basins.fractions[k]) for k, item in enumerate(basins.attractors)]
    rows.append((palette[0], "unresolved", basins.fractions[-1]))
    lines = [_cells(f"{100.0 * share:.2f} %", first=_swatch(color) + html.escape(words))
             for color, words, share in rows]
    if (~basins.starts).any():
        lines.append(_cells("", first=_swatch(palette[1]) + "beyond a stop"))
    head = "<tr><th>starts lead to</th><th>share</th></tr>"
    return f"<table>{head}{''.join(lines)}</table><p>{html.escape(basins.reliability.statement)}</p>"


def _swatch(color: str) -> str:
    """Return a square of a colour; in attributes, because the page's policy forbids inline styles."""
    return f"<svg width='13' height='13'><rect x='.5' y='.5' width='12' height='12' fill='{color}' stroke='#555'/></svg>"


def _cells(*texts: str, first: str = "") -> str:
    """Return a row of a table; ``first`` is markup already."""
    return "<tr>" + (f"<td>{first}</td>" if first else "") + "".join(f"<td>{html.escape(text)}</td>" for text in texts) + "</tr>"
