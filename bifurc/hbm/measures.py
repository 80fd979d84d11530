"""Gradients of amplitude measures in the packed coefficients of a motion, in closed form; what peaks are found with."""
import numpy as np

from .layout import Layout


def measure_gradient(layout: Layout, name: str, x) -> np.ndarray | None:
    """Return the gradient (layout.size,) of a measure at the packed motion ``x``, or None for other names.

    Parameters
    ----------
    layout : Layout
    name : {"h1_i", "rms_i", "max_i", "min_i"}
        Amplitude of the forcing harmonic, root mean square, largest and smallest value of coordinate i.
    x : ndarray (layout.size,)
    """
    kind, _, end = name.rpartition("_")
    if not end.isdigit() or not int(end) < layout.n:
        return None
    dof = int(end)
    out = np.zeros((layout.slots, layout.n))
    a = np.asarray(x, float).reshape(layout.slots, layout.n)[:, dof]
    if kind == "h1":
        if layout.periods in layout.harmonics:
            first = layout.slot(layout.periods)
            size = float(np.hypot(a[first], a[first + 1]))
            if size > 0.0:
                out[first:first + 2, dof] = a[first:first + 2] / size
    elif kind == "rms":
        weight = np.where(layout.waves == 0, 1.0, 0.5)
        size = float(np.sqrt(a * a @ weight))
        if size > 0.0:
            out[:, dof] = weight * a / size
    elif kind in ("max", "min"):
        out[:, dof] = layout.basis(np.array([summit(layout, a if kind == "max" else -a)]))[0]
    else:
        return None
    return out.ravel()


def summit(layout: Layout, a) -> float:
    """Return the phase of the largest value of the polynomial with coefficients ``a`` (slots,), polished by Newton."""
    count = 16 * max(layout.top, 1)
    theta = 2.0 * np.pi * np.arange(count) / count
    values = layout.basis(theta) @ a
    top = np.flatnonzero((values >= np.roll(values, 1)) & (values >= np.roll(values, -1)))
    if not top.size:
        return float(theta[np.argmax(values)])
    t = theta[top[np.argsort(values[top])[-8:]]]
    sine, k = layout.is_sine, layout.waves
    reach = 0.2 / max(layout.top, 1)
    for _ in range(6):
        angle = np.multiply.outer(t, k)
        co, si = np.cos(angle), np.sin(angle)
        slope = np.where(sine, k * co, -k * si) @ a
        bend = np.where(sine, -k * k * si, -k * k * co) @ a
        t = t - np.where(bend < 0.0, np.clip(slope / np.where(bend < 0.0, bend, -1.0), -reach, reach), 0.0)
    return float(t[np.argmax(layout.basis(t) @ a)])
