"""A system becomes numbers for kernels: mode tables for affine scenes, a written module for laws that are not."""
from .scene import Scene, scene_of

__all__ = ["Scene", "scene_of"]
