"""Kernels of affine scenes under one roof."""
from .dense import sample
from .scan import run, workspace
from .settle import affine_series as series

__all__ = ["run", "sample", "series", "workspace"]
