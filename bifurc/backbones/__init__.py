"""Free vibration over amplitude: frequency and damping of nonlinear modes, with friction too (extended periodic motion)."""
from .backbone import Backbone, backbone
from .modes import ExtendedMode, ModeStatus, extended_mode

__all__ = ["Backbone", "ExtendedMode", "ModeStatus", "backbone", "extended_mode"]
