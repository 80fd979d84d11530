"""Matrices from files of other programs: one reader a format, all of them checked alike.

Formats: Matrix Market and CalculiX or Abaqus text (one matrix a file), MATLAB, npz, Nastran OP4 and DMIG (extra ``fe``).

One file, because a format is a few lines, and all share the names of matrices and what is checked.
"""
import logging
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, mmread

from ..checks import ELEMENTS, POSITIVE, checked, like, number, path, refused
from ..content import Content
from ..io import other_than_file
from ..io.archive import Archive
from ..structure.checks import Structure
from ..structure.checks import checked as structure_of
from ..system import System
from .assembling import assembled

_log = logging.getLogger("bifurc.models")

# what matrices are called in files, in lower case
_WORDS = {"M": ("m", "mass", "maa", "mgg", "mff", "mxx", "mhh", "mred", "m2gg"),
          "K": ("k", "stiffness", "kaa", "kgg", "kff", "kxx", "khh", "kred", "k2gg"),
          "C": ("c", "d", "damping", "baa", "bgg", "bff", "bxx", "b", "b2gg", "b2pp", "cred"),
          "G": ("g", "gyroscopic", "gyro")}


@dataclass(frozen=True, eq=False)
class Model(Content):
    """Matrices of a linear structure, as a file held them.

    Attributes
    ----------
    M, C, K, G : ndarray (n, n)
    dofs : tuple of str, or None
    source : str

    Examples
    --------
    >>> import bifurc as bf
    >>> bf.read("rotor.mat").M.shape      # doctest: +SKIP
    (24, 24)
    """

    M: np.ndarray = field(repr=False)
    C: np.ndarray = field(repr=False)
    K: np.ndarray = field(repr=False)
    G: np.ndarray = field(repr=False)
    dofs: tuple[str, ...] | None = field(default=None, repr=False)
    source: str = ""
    structure: Structure | None = field(default=None, repr=False)

    @checked(elements=ELEMENTS, omega=POSITIVE)
    def system(self, elements: Iterable = (), omega: float | None = None) -> System:
        """Return the system with elements, which may sit on the names of the degrees of freedom."""
        assert self.structure is not None
        return assembled(self.structure, elements, omega)

    def __repr__(self):
        assert self.structure is not None
        return f"Model({self.source}: {self.structure.report})"


@checked(mass=path, stiffness=path, damping=path, gyroscopic=path)
def read(path: str | os.PathLike | None = None, *, mass=None, stiffness=None, damping=None, gyroscopic=None,
         dofs: Sequence | None = None, symmetric: bool = True) -> Model:
    """Read the matrices of a linear structure.

    Parameters
    ----------
    path : path-like, optional
        A file that holds all matrices: ``.mat`` (MATLAB), ``.npz``, ``.op4`` or a bulk file with DMIG entries (``.bdf``,
        ``.dat``, ``.pch``; extra ``fe``). Matrices are found by their usual names (M, K, C, G, mass, KAA, ...).
    mass, stiffness, damping, gyroscopic : path-like, optional
        Instead: one file a matrix: Matrix Market, Abaqus matrix output (``node,dof,node,dof,value``; ``.mtx``), or CalculiX
        (``.mas``, ``.sti`` beside a ``.dof`` file).
    dofs : sequence, optional
        Names; default: those of the file, where it has them.
    symmetric : bool
        False: K and C may have circulatory parts (bearings).

    Returns
    -------
    Model
        ``model.system(elements, omega)`` makes it a system.

    Raises
    ------
    ValueError
        Unknown format, missing or doubled matrices, matrices that the checker refuses.
    FileNotFoundError
    ModuleNotFoundError
        OP4 and DMIG without pyyeti: install ``bifurc[fe]``.

    Examples
    --------
    >>> import bifurc as bf
    >>> rotor = bf.read("rotor.mat")                                           # doctest: +SKIP
    >>> beam = bf.read(mass="beam_M.mtx", stiffness="beam_K.mtx").system()     # doctest: +SKIP
    """
    single = {"M": mass, "K": stiffness, "C": damping, "G": gyroscopic}
    if (path is None) == all(item is None for item in single.values()):
        raise ValueError("read: write read(path) for a file with all matrices, or read(mass=..., stiffness=...) for one file each")
    named: Sequence | None = None
    source, *others = [str(item) for item in (path, *single.values()) if item is not None]
    if path is None:
        found = {}
        for name, item in single.items():
            if item is not None:
                found[name], own = read_matrix(item)
                named = _same_names(named, own, str(item))
    else:
        found, named = read_all(Path(path))
    for name in ("M", "K"):
        if name not in found:
            raise ValueError(f"read: {', '.join([source, *others])} has no {'mass' if name == 'M' else 'stiffness'} matrix; it "
                             f"holds {', '.join(found) or 'none that is known by its name'}")
    try:
        return model(found["M"], found.get("C"), found["K"], found.get("G"), dofs if dofs is not None else named, source, symmetric)
    except ValueError as error:
        raise ValueError(f"read: {', '.join([source, *others])}: {error}") from error


def model(M: Any, C: Any, K: Any, G: Any, dofs: Sequence | None, source: str, symmetric: bool = True) -> Model:
    """Return checked matrices as a `Model`."""
    structure = structure_of(M, C, K, G, dofs, symmetric)
    _log.info("%s: %s", source, structure.report)
    return Model(structure.M, structure.C, structure.K, structure.G, structure.dofs, source, structure)


@checked(rotor=like("a rotor of ROSS", "M", "C", "K", "G"), speed=number)
def from_ross(rotor: Any, speed: float) -> Model:
    """Return the matrices of a ROSS rotor at a spin speed.

    Parameters
    ----------
    rotor : ross.Rotor, or anything with ``M(frequency)``, ``C(frequency)``, ``K(frequency)``, ``G()`` and ``number_dof``
    speed : float
        Spin, radians per time; bearings are taken at this frequency.

    Returns
    -------
    Model
        G is the gyroscopic matrix times the speed; names are ``node.x``, ``node.y``, ``node.alpha``, ``node.beta`` (six a node:
        also ``z`` and ``theta``).

    Raises
    ------
    ValueError

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.from_ross(rotor, speed=100.0).system()     # a `ross.Rotor`  # doctest: +SKIP
    """
    speed = float(speed)
    if not np.isfinite(speed):
        raise ValueError(f"from_ross: speed = {speed!r} is not allowed; it must be finite")
    for name in ("M", "C", "K", "G"):
        if not callable(getattr(rotor, name, None)):
            raise refused("from_ross", "rotor", rotor, f"a ross.Rotor, or have its {name}, a function")
    M, C, K, G = rotor.M(speed), rotor.C(speed), rotor.K(speed), np.asarray(rotor.G(), float)
    directions = {4: ("x", "y", "alpha", "beta"), 6: ("x", "y", "z", "alpha", "beta", "theta")}
    count = int(getattr(rotor, "number_dof", 4))
    n = len(np.asarray(M))
    names = None
    if count in directions and n % count == 0:
        names = [f"{node}.{name}" for node in range(n // count) for name in directions[count]]
    return model(M, C, K, speed * G, names, f"rotor at {speed:g} rad/time", symmetric=False)


def _told(path: Path, reader: Callable[[Path], Any]) -> Any:
    """Return what a reader takes from an ordinary file; whatever it says of one that it cannot read names the file."""
    try:
        other = other_than_file(path)
    except FileNotFoundError:
        raise FileNotFoundError(f"read: there is no file {path}") from None
    if other:
        raise ValueError(f"read: {path} is {other}, not a file")
    try:
        return reader(path)
    except ModuleNotFoundError:
        raise
    except Exception as error:  # whatever foreign bytes make the readers of many formats say
        said = str(error) or type(error).__name__
        if said.startswith("read: "):
            raise
        if "allow_pickle" in said:  # numpy names the option that would run what the file says
            raise ValueError(f"read: {path} holds Python objects, of which none is ever taken from a file") from None
        raise ValueError(f"read: {path} cannot be read: {said.splitlines()[0]}") from error


# ---- one file, all matrices --------------------------------------------------------------------------------------------------


def read_all(path: Path) -> tuple[dict[str, Any], Sequence | None]:
    """Return matrices by letter and names of the degrees of freedom, where the file has them."""
    content = _told(path, _content)
    names = content.pop("dofs", None)
    return sort_out(content, str(path)), names


def _content(path: Path) -> dict[str, Any]:
    reader = _ALL.get(path.suffix.lower())
    if reader is None:
        hint = "; a file with one matrix is read with mass=, stiffness=, damping=" if path.suffix.lower() in _ONE else ""
        raise ValueError(f"read: {path} has an ending that is not known; files with all matrices end in {', '.join(_ALL)}{hint}")
    return reader(path)


def sort_out(content: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return the matrices among named arrays by their letters.

    Raises
    ------
    ValueError
        When two of them could be the same.
    """
    found: dict[str, Any] = {}
    origin: dict[str, str] = {}
    for name, value in content.items():
        for letter, words in _WORDS.items():
            if name.lower() in words and np.ndim(value) == 2 or hasattr(value, "toarray") and name.lower() in words:
                if letter in found:
                    raise ValueError(f"read: {source} has both {origin[letter]!r} and {name!r}; write the one you mean to a file "
                                     "of its own")
                found[letter], origin[letter] = value, name
    if not found:
        raise ValueError(f"read: {source} holds {', '.join(map(repr, content)) or 'nothing'}; none is a matrix with a known name "
                         f"({', '.join(words[1] for words in _WORDS.values())})")
    return found


def _mat(path: Path) -> dict[str, Any]:
    try:
        found: dict[str, Any] = {name: value for name, value in loadmat(path).items() if not name.startswith("__")}
    except NotImplementedError:
        raise ValueError(f"read: {path} is a MATLAB file of version 7.3; save it with -v7") from None
    if "dofs" in found:
        found["dofs"] = [str(np.asarray(item).ravel()[0]) for item in np.asarray(found["dofs"]).ravel()]
    return found


def _npz(path: Path) -> dict[str, Any]:
    known = {"dofs"}.union(*_WORDS.values())
    with open(path, "rb") as file, Archive(file) as content:
        found: dict[str, Any] = {name: content.foreign(name) if name.lower() in known else 0.0 for name in content.names}
    if "dofs" in found:
        found["dofs"] = [str(item) for item in found["dofs"]]
    return found


def _op4(path: Path) -> dict[str, Any]:
    return dict(_nastran().op4.read(str(path)))


def _dmig(path: Path) -> dict[str, Any]:
    frames = _nastran().bulk.rddmig(str(path), expanded=False)
    found: dict[str, Any] = {}
    index = sorted({key for frame in frames.values() for key in (*frame.index, *frame.columns)})
    for name, frame in frames.items():
        found[name] = frame.reindex(index=index, columns=index, fill_value=0.0).to_numpy()
        full = found[name]
        if not np.allclose(full, full.T) and not np.tril(full, -1).any():
            found[name] = full + np.triu(full, 1).T
    directions = ("s", "ux", "uy", "uz", "rx", "ry", "rz")
    found["dofs"] = [f"{node}.{directions[int(place)]}" for node, place in index]
    return found


def _nastran() -> Any:
    try:
        from pyyeti import nastran  # optional
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"OP4 and DMIG are read by pyyeti ({error}): python -m pip install 'bifurc[fe]'") from error
    return nastran


# ---- one file, one matrix ------------------------------------------------------------------------------------------------------


def read_matrix(path: str | os.PathLike) -> tuple[Any, Sequence | None]:
    """Return a matrix and the names of its degrees of freedom, where the file has them."""
    return _told(Path(path), _matrix)


def _matrix(path: Path) -> tuple[Any, Sequence | None]:
    if path.suffix.lower() == ".npy":
        with open(path, "rb") as content:
            return np.lib.format.read_array(content, allow_pickle=False), None
    with open(path, encoding="utf-8", errors="replace") as file:
        first = file.readline()
    if first.startswith("%%MatrixMarket"):
        return mmread(path), None
    if re.match(r"\s*(\*\*|\*MATRIX|\d+\s*,)", first, re.IGNORECASE):
        return _abaqus(path)
    if path.suffix.lower() in (".sti", ".mas", ".dam"):
        return _calculix(path)
    raise ValueError(f"read: {path} is no Matrix Market, Abaqus or CalculiX matrix (it begins with {first.strip()[:40]!r})")


def _abaqus(path: Path) -> tuple[np.ndarray, list[str]]:
    """Lines node,dof,node,dof,value; of a symmetric matrix one triangle, or both."""
    rows = []
    for line in path.read_text().splitlines():
        if line.strip() and not line.lstrip().startswith("*"):
            parts = [part for part in line.split(",") if part.strip()]
            if len(parts) != 5:
                raise ValueError(f"read: {path}: line {line.strip()!r} is not 'node,dof,node,dof,value'")
            rows.append((int(parts[0]), int(parts[1]), int(parts[2]), int(parts[3]), float(parts[4].lower().replace("d", "e"))))
    places = sorted({row[:2] for row in rows} | {row[2:4] for row in rows})
    number = {place: k for k, place in enumerate(places)}
    directions = ("", "ux", "uy", "uz", "rx", "ry", "rz")
    names = [f"{node}.{directions[place]}" if 0 < place < len(directions) else f"{node}.{place}" for node, place in places]
    return _filled([(number[a[:2]], number[a[2:4]], a[4]) for a in rows], len(places)), names


def _calculix(path: Path) -> tuple[np.ndarray, list[str] | None]:
    """Lines row, column, value, counted from 1, one triangle; names in the .dof file beside it."""
    table = np.loadtxt(path, ndmin=2)
    if table.shape[1] != 3:
        raise ValueError(f"read: {path} has {table.shape[1]} numbers a line; a CalculiX matrix has row, column, value")
    names = None
    beside = path.with_suffix(".dof")
    if beside.is_file():
        directions = ("", "ux", "uy", "uz", "rx", "ry", "rz")
        names = [f"{node}.{directions[int(place)]}" for node, place in (line.split(".") for line in beside.read_text().split())]
    n = max(int(table[:, :2].max()), len(names or ()))
    return _filled([(int(i) - 1, int(j) - 1, value) for i, j, value in table], n), names


def _filled(entries: list[tuple[int, int, float]], n: int) -> np.ndarray:
    """Return a full matrix from its entries; one triangle is mirrored."""
    matrix = np.zeros((n, n))
    for i, j, value in entries:
        matrix[i, j] = value
    if not np.triu(matrix, 1).any() or not np.tril(matrix, -1).any():
        return matrix + matrix.T - np.diag(np.diag(matrix))
    return matrix


def _same_names(known: Sequence | None, own: Sequence | None, source: str) -> Sequence | None:
    if known is None or own is None:
        return own if known is None else known
    if list(known) != list(own):
        raise ValueError(f"read: {source} has other degrees of freedom than the file before it ({len(own)} and {len(known)}); "
                         "write all matrices with the same ones")
    return known


_ALL: dict[str, Callable[[Path], dict[str, Any]]] = {
    ".mat": _mat, ".npz": _npz, ".op4": _op4, ".bdf": _dmig, ".dat": _dmig, ".pch": _dmig, ".dmig": _dmig}
_ONE = (".mtx", ".mm", ".npy", ".sti", ".mas", ".dam")
