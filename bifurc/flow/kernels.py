"""Kernels of affine scenes under one roof."""
from .dense import sample
from .scan import run, workspace
from .settle import affine_series as series
from .tangent import grow

__all__ = ["grow", "run", "sample", "series", "workspace"]
