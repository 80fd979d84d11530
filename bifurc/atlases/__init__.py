"""The whole diagram: all motions of a system over a parameter, found, traced, connected, and what 'nothing else' is worth."""
from .result import Atlas, AtlasStatus, Probe
from .verb import atlas

__all__ = ["Atlas", "AtlasStatus", "Probe", "atlas"]
