"""Motions under delayed feedback: a system whose force depends on its own past, with events on that past."""
from .motion import DelayedMotion
from .verb import simulate_delayed

__all__ = ["DelayedMotion", "simulate_delayed"]
