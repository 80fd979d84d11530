"""Force laws at samples of the motion: compiled loops around the text of a law, its slopes given or differenced."""
import hashlib
import pathlib
import sys

import numba
import numpy as np

from .._cache import cache_folder
from ..compose import written
from ..compose.lawtext import standalone
from ..compose.writer import _check
from .parts import ForceLaw

_loaded: dict[tuple, object] = {}

_TEXT = '''"""A law at samples, written by bifurc.hbm.laws."""
import numpy as np

from bifurc._jit import njit

{laws}

@njit
def forces(values, U, V, f):
{load}    for j in range(U.shape[1]):
        {out} = law({local})


@njit
def slopes(values, U, V, g):
{load}{steps}    for j in range(U.shape[1]):
{slope}
'''

_STEPS = """    du, dv = np.empty({Q}), np.empty({Q})
    for q in range({Q}):  # a thousandth of the largest value met on the way
        du[q] = 1e-3 * max(np.abs(U[q]).max(), 1e-12)
        dv[q] = 1e-3 * max(np.abs(V[q]).max(), 1e-12)
"""


def compiled(law: ForceLaw):
    """Return the module with ``forces(values, U, V, f)`` and ``slopes(values, U, V, g)`` of a law.

    U, V, f have the shape (Q, N), g has (Q, 2 Q, N): derivatives of each force by the coordinates, then by the speeds.

    Raises
    ------
    LawError
        When the law cannot be written or compiled.
    """
    Q, count = len(law.rows), len(law.law.values)
    key = (law.law.function, law.law.jacobian, Q, count)
    if key not in _loaded:
        _loaded[key] = _module(_text(law, Q, count))
    return _loaded[key]


def _text(law: ForceLaw, Q: int, count: int) -> str:
    class Checked:  # what `compose.writer` checks
        rows, outs, reads, curved, law, name = Q, Q, False, False, None, None

    Checked.law, Checked.name = law.law, law.name  # type: ignore[assignment]
    _check(Checked)
    names = [f"p{i}" for i in range(count)]
    load = "".join(f"    {name} = values[{i}]\n" for i, name in enumerate(names))
    local = [f"U[{q}, j]" for q in range(Q)] + [f"V[{q}, j]" for q in range(Q)]
    call = ", ".join(local + names)
    laws, steps = standalone(law.law.function, "law"), ""
    if law.law.jacobian is not None:
        laws += "\n" + standalone(law.law.jacobian, "slope")
        places = ", ".join(f"g[{a}, {b}, j]" for a in range(Q) for b in range(2 * Q))
        slope = f"        {places} = slope({call})"
    else:
        steps, lines = _STEPS.format(Q=Q), []
        for b in range(2 * Q):
            step = f"du[{b}]" if b < Q else f"dv[{b - Q}]"
            for i, shift in enumerate((-2.0, -1.0, 1.0, 2.0)):
                moved = [*local[:b], f"{local[b]} + {shift} * {step}", *local[b + 1:]]
                lines.append(f"        {', '.join(f'd{i}_{a}' for a in range(Q))} = law({', '.join(moved + names)})")
            for a in range(Q):
                lines.append(f"        g[{a}, {b}, j] = (d0_{a} - d3_{a} + 8.0 * (d2_{a} - d1_{a})) / (12.0 * {step})")
        slope = "\n".join(lines)
    return _TEXT.format(laws=laws, load=load, out=", ".join(f"f[{a}, j]" for a in range(Q)), local=call, steps=steps, slope=slope)


def _module(text: str):
    """Write the text to a file named by its hash and import it."""
    key = hashlib.sha256("\n".join((numba.__version__, sys.version, text)).encode()).hexdigest()[:20]
    name = f"bifurc_written_hbm_{key}"
    return written.load(name, pathlib.Path(cache_folder()) / "written" / f"hbm_{key}.py", text)


class Sampled:
    """Tables that turn coefficients of rows into samples, and samples into coefficients and spectra.

    Parameters
    ----------
    waves : ndarray (mi,)
        Harmonic of each internal slot.
    place : ndarray (slots,)
        Internal slots of the balance.
    samples : int
    """

    def __init__(self, waves, place, samples: int):
        self.samples = samples
        mi = len(waves)
        angle = np.multiply.outer(waves, np.arange(samples)) % samples * (2.0 * np.pi / samples)
        sine = np.arange(mi) % 2 == 0
        sine[0] = False
        self.basis = np.where(sine[:, None], np.sin(angle), np.cos(angle))  # (mi, N)
        weight = np.full(len(place), 2.0 / samples)
        weight[place == 0] = 1.0 / samples
        self.project = np.ascontiguousarray(self.basis[place].T * weight)  # (N, slots)
        l = np.arange(2 * int(waves[-1]) + 1) % samples
        self.mirrored = l > samples // 2
        self.index = np.where(self.mirrored, samples - l, l)

    def spectrum(self, signal):
        """Return the integrals (..., L, 2) of signal cos l theta and signal sin l theta over the period, by 2 pi."""
        found = np.fft.rfft(signal, axis=-1)[..., self.index] / self.samples
        return np.stack([found.real, np.where(self.mirrored, found.imag, -found.imag)], axis=-1)


STEP = 1e-6  # relative, of the difference by the values of a law


def law_forces(laws: tuple[ForceLaw, ...], tables: Sampled, values, dvalues, c, v, SU, SS, F, J) -> None:
    """Add what laws give along rows with coefficients ``c``, ``v`` (nr, mi); the arrays as in `spectra.gather`.

    Forces enter as their part that is not proportional to the motion: the spectra of the slopes give the rest.
    """
    for law in laws:
        module, rows = compiled(law), list(law.rows)
        own, turn = values[law.values], dvalues[law.values]
        U, V = c[rows] @ tables.basis, v[rows] @ tables.basis
        Q = len(rows)
        f, g = np.empty((Q, tables.samples)), np.empty((Q, 2 * Q, tables.samples))
        module.forces(own, U, V, f)
        module.slopes(own, U, V, g)
        rest = f - np.einsum("abn,bn->an", g, np.concatenate([U, V]))
        G = tables.spectrum(g)
        for a, row in enumerate(rows):
            F[row] += rest[a] @ tables.project
            for b, target in enumerate(rows):
                SU[row, target] += G[a, b]
                SS[row, target] += G[a, Q + b]
        if turn.any():
            step = STEP / max(float(np.abs(turn / np.where(own == 0.0, 1.0, own)).max()), 1e-300)
            above, below = np.empty_like(f), np.empty_like(f)
            module.forces(own + step * turn, U, V, above)
            module.forces(own - step * turn, U, V, below)
            change = (above - below) / (2.0 * step)
            for a, row in enumerate(rows):
                J[row, :, 0, -1] += change[a] @ tables.project
