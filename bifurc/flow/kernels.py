"""Kernels of affine scenes under one roof."""
from .dense import sample
from .scan import run, workspace

__all__ = ["run", "sample", "workspace"]
