"""``bifurc certify FILE``: proofs of saved orbits and branches, in ball arithmetic."""
import argparse
import inspect
from pathlib import Path

import bifurc as bf

from .common import check_files


def add(commands) -> None:
    """Add the command to the parser."""
    certify = commands.add_parser("certify", help="prove a saved orbit or branch in ball arithmetic",
                                  description=inspect.getdoc(run_certify))
    certify.add_argument("file", metavar="FILE", help="an npz file that an orbit or a branch was saved to")
    certify.add_argument("--precision", type=int, default=None, metavar="BITS", help="of the balls, at least 64")
    certify.add_argument("--rows-only", action="store_true", help="of a branch: rows and special points, not what lies between")
    certify.set_defaults(run=run_certify)


def run_certify(options: argparse.Namespace) -> int:
    """Prove a saved orbit, or a saved branch from row to row; write the certificate beside the file."""
    result = bf.load(options.file)
    place = Path(options.file)
    target = place.with_name(f"{place.stem}.certificate.npz")
    check_files(target)
    branch = isinstance(result, bf.Branch)
    if not (branch or isinstance(result, bf.PeriodicOrbit)):
        raise ValueError(f"{options.file} holds a {type(result).__name__}; orbits and branches can be proved")
    try:
        certificate = (result.certify(options.precision, stretches=not options.rows_only) if branch else
                       result.certify(options.precision))
    except ImportError as error:
        raise ValueError(str(error)) from None
    print(repr(certificate))
    parts = (*certificate.points, *(part for part in certificate.stretches if not part.proved)) if branch else ()
    for part in parts:
        print(f"  {part!r}")
    print(certificate.message)
    certificate.save(target)
    print(f"saved {target}")
    return 0 if certificate.proved else 1
