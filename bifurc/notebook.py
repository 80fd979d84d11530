"""Results in notebooks: a small table and a thumbnail, from the same attributes and the same picture as everywhere."""
import html
import logging
from typing import Any, ClassVar

import numpy as np

from . import plotting

_log = logging.getLogger("bifurc.notebook")
_MOST = 4  # entries of an array or a mapping that are written out


class Notebook:
    """A result that shows itself in a notebook.

    Attributes
    ----------
    _facts : tuple of str
        Attributes in the table.
    _panels : (rows, columns) or None
        Axes that ``plot`` draws on; None: no picture.
    """

    __slots__ = ()
    _facts: ClassVar[tuple[str, ...]] = ()
    _panels: ClassVar[tuple[int, int] | None] = (1, 1)

    def _repr_html_(self) -> str:
        """Return name, table and thumbnail as HTML."""
        rows = "".join(f"<tr><th style='text-align:left'>{html.escape(name.replace('_', ' '))}</th>"
                       f"<td style='text-align:left'>{html.escape(short(getattr(self, name)))}</td></tr>" for name in self._facts)
        picture = "" if self._panels is None else thumbnail(self)
        source = f"src='data:image/png;base64,{picture}'"
        image = f"<img alt='{type(self).__name__}' style='max-width:420px' {source}/>" if picture else ""
        return (f"<div><code>{html.escape(repr(self))}</code><div style='display:flex;gap:16px;align-items:flex-start'>"
                f"<table>{rows}</table>{image}</div></div>")


class Table(tuple):
    """A tuple of records that shows itself as a table, and becomes a pandas DataFrame.

    Attributes
    ----------
    _fields : tuple of str
        Attributes of a record that are columns.
    """

    __slots__ = ()
    _fields: ClassVar[tuple[str, ...]] = ()

    def to_pandas(self) -> Any:
        """Return one row a record as a pandas DataFrame."""
        import pandas  # optional

        return pandas.DataFrame({name: [plain(getattr(item, name)) for item in self] for name in self._fields})

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{html.escape(name)}</th>" for name in self._fields)
        rows = "".join("<tr>" + "".join(f"<td>{html.escape(short(getattr(item, name)))}</td>" for name in self._fields) + "</tr>"
                       for item in self)
        return f"<table><tr>{head}</tr>{rows}</table>"


def plain(value: Any) -> Any:
    """Return a value as a column of a table holds it: words of enumerations as text."""
    return str(value) if isinstance(value, str) else value


def short(value: Any) -> str:
    """Return a value in few words."""
    if isinstance(value, bool | np.bool_) or value is None:
        return {True: "yes", False: "no", None: "unknown"}[None if value is None else bool(value)]
    if isinstance(value, complex | np.complexfloating):
        return f"{value.real:.5g}" if value.imag == 0.0 else f"{value.real:.5g}{value.imag:+.5g}i"
    if isinstance(value, float | np.floating):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return ", ".join(f"{short(key)}: {short(item)}" for key, item in value.items())
    if isinstance(value, np.ndarray | list | tuple):
        items = [short(item) for item in list(value)[:_MOST]]
        return ", ".join(items) + (f", ... ({len(value)})" if len(value) > _MOST else "")
    return str(value)


def thumbnail(result: Any) -> str:
    """Return the result's own picture as a small PNG in base64; empty where it cannot be drawn."""
    try:
        return plotting.drawn(result.plot, *result._panels)
    except ValueError as error:  # maps over one or three components have no picture
        _log.debug("no thumbnail of %r: %s", result, error)
        return ""
