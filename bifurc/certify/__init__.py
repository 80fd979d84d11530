"""Proofs in ball arithmetic: of periodic orbits, of special points, and of branches from row to row.

What is proved, and what is assumed, is described in ``docs/explanation/certificates.md``.  Needs the
extra ``certify`` (python-flint).
"""
from .branch import BranchCertificate, certify_branch
from .certificate import Certificate, EventEnclosure, PointCertificate, StretchCertificate, Verdict
from .orbit import certify_orbit
from .special import certify_point

__all__ = ["BranchCertificate", "Certificate", "EventEnclosure", "PointCertificate", "StretchCertificate", "Verdict",
           "certify_branch", "certify_orbit", "certify_point"]
