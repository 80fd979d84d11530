"""Ready systems of the literature.  Builders take keywords only; the keywords are the parameters of the system."""
from .chains import impact_chain
from .dampers import friction_damped_oscillator, macro_slip_contact, micro_slip_ring, micro_slip_strip
from .friction import dry_friction_oscillator, jenkins_oscillator
from .oscillators import (
    bilinear_oscillator,
    bouncing_ball,
    duffing_oscillator,
    impact_oscillator,
    moving_frame_impact_oscillator,
    two_sided_impact_oscillator,
)

__all__ = ["bilinear_oscillator", "bouncing_ball", "dry_friction_oscillator", "duffing_oscillator",
           "friction_damped_oscillator", "impact_chain", "impact_oscillator", "jenkins_oscillator",
           "macro_slip_contact", "micro_slip_ring", "micro_slip_strip", "moving_frame_impact_oscillator",
           "two_sided_impact_oscillator"]
