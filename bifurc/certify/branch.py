"""The proof of a branch: of every row, every special point, and every stretch between two rows."""
import json
import time
from dataclasses import dataclass

import numpy as np

from .. import io
from ..checks import checked
from ..content import Content
from .certificate import Certificate, PointCertificate, StretchCertificate, Verdict
from .orbit import certify_orbit
from .parameter.stretch import Stretches
from .special import certify_point

# of the largest value of the parameter on the branch: a row that near to a special point is decided by the proof of the point
AT_POINT = 1e-6


@dataclass(frozen=True, eq=False)
class BranchCertificate(Content):
    """What was proved of a branch.

    Attributes
    ----------
    parameter : str
    values : ndarray (rows,)
        Parameter of the rows.
    rows : tuple of Certificate
    points : tuple of PointCertificate
        In the order of the branch's special points.
    stretches : tuple of StretchCertificate
        Between a row and the next, in the order of the rows.
    seconds : float
        Processor time.
    message : str
        What was proved, what was not, and where.
    """

    parameter: str
    values: np.ndarray
    rows: tuple[Certificate, ...]
    points: tuple[PointCertificate, ...]
    stretches: tuple[StretchCertificate, ...]
    seconds: float
    message: str

    @property
    def proved_rows(self) -> np.ndarray:
        """Which rows are proved motions, (rows,) of bool."""
        return np.array([row.proved for row in self.rows], bool)

    @property
    def undecided(self) -> tuple[int, ...]:
        """Rows that are not proved and lie on no proved special point."""
        on = [0.5 * sum(point.parameter) for point in self.points if point.proved]
        return tuple(i for i, row in enumerate(self.rows) if not row.proved and not any(
            abs(float(self.values[i]) - p) <= AT_POINT * float(np.abs(self.values).max()) for p in on))

    @property
    def proved(self) -> bool:
        """Whether every special point, every stretch, and every row that does not lie on a special point is proved."""
        return (all(point.proved for point in self.points) and not self.undecided
                and all(stretch.proved for stretch in self.stretches))

    def __repr__(self):
        return (f"BranchCertificate({int(self.proved_rows.sum())} of {len(self.rows)} rows, "
                f"{sum(point.proved for point in self.points)} of {len(self.points)} special points, "
                f"{sum(stretch.proved for stretch in self.stretches)} of {len(self.stretches)} stretches proved, "
                f"{self.seconds:.2f} s)")

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        arrays: dict = {"values": self.values, "seconds": np.array(self.seconds)}
        headers: dict[str, list] = {"rows": [], "points": [], "stretches": []}
        parts_of: tuple = (("rows", self.rows), ("points", self.points), ("stretches", self.stretches))
        for name, items in parts_of:
            for i, item in enumerate(items):
                header, parts = item.to_record()
                headers[name].append(json.loads(json.dumps(header)))
                arrays |= {f"{name}.{i}.{key}": value for key, value in parts.items()}
        return {"kind": "branch_certificate", "parameter": self.parameter, "message": self.message, **headers}, arrays

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "BranchCertificate":
        """Make the certificate that `to_record` described."""
        def read(name, kind):
            return tuple(kind.from_record(item, io.part(arrays, f"{name}.{i}.")) for i, item in enumerate(header.get(name, ())))
        rows, points, stretches = read("rows", Certificate), read("points", PointCertificate), read("stretches", StretchCertificate)
        io.fitted(arrays, {"values": "finite m", "seconds": "real"}, m=len(rows))
        return cls(header["parameter"], arrays["values"], rows, points, stretches, float(arrays["seconds"]), header["message"])

    @checked()
    def save(self, path) -> None:
        """Write the certificate to an npz file, which `bifurc.load` reads."""
        io.write(path, *self.to_record())


@checked()
def certify_branch(branch, precision: int | None = None, stretches: bool = True) -> BranchCertificate:
    """Return what is proved of a branch of periodic orbits: rows, special points, and what lies between the rows.

    Parameters
    ----------
    branch : Branch
        Of event sequences; a branch of other problems raises.
    precision : int, optional
        Bits; None: see `certify_orbit`; 64 between the rows.
    stretches : bool
        Whether what lies between the rows is to be proved: most of the time goes there.

    Returns
    -------
    BranchCertificate

    Raises
    ------
    ValueError
        For a branch of harmonic balance, of algebraic problems, or a curve in two parameters.
    """
    if not all(problem.sequence is not None for problem in branch.problems):
        raise ValueError("certify: only branches of event sequences have certificates; polish a harmonic balance with find_orbit")
    start = time.process_time()
    rows = tuple(certify_orbit(orbit, precision) for orbit in branch.orbits)
    points = tuple(certify_point(point, precision) for point in branch.special_points)
    between = Stretches(branch, points, precision)
    proofs = tuple(between.between(i) for i in range(len(branch) - 1)) if stretches else ()
    found = BranchCertificate(branch.parameter, branch.column("parameter"), rows, points, proofs, 0.0, "")
    left = [f"row {i} at {float(found.values[i]):.10g}: {rows[i].message}" for i in found.undecided]
    left += [f"{point.kind}: {point.message}" for point in points if point.exists is not Verdict.PROVED]
    left += [f"rows {part.rows[0]} to {part.rows[1]}: {part.message}" for part in proofs if not part.proved]
    what = ("every special point is proved, every row that does not lie on one, and that no other lies between the rows"
            if stretches else "every special point is proved, and every row that does not lie on one; nothing is said of what lies "
            "between the rows")
    return BranchCertificate(found.parameter, found.values, rows, points, proofs, time.process_time() - start,
                             "; ".join(left) if left else what)
