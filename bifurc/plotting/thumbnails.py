"""Small pictures of results, for notebooks."""
import base64
import io
from collections.abc import Callable

from ..checks import COUNT, checked, function
from . import style


@checked(plot=function, rows=COUNT, columns=COUNT)
def drawn(plot: Callable, rows: int, columns: int) -> str:
    """Return what ``plot(axes)`` draws as a PNG in base64; ``plot`` gets one axes, or a list where there are several."""
    made, axes = style.figure(3.0 * columns + 1.2, 2.2 * rows + 0.8, columns=columns, rows=rows)
    plot(axes if len(axes) > 1 else axes[0])
    content = io.BytesIO()
    made.savefig(content, format="png", dpi=80)
    return base64.b64encode(content.getvalue()).decode("ascii")
