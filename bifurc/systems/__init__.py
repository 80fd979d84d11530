"""Ready systems of the literature.  Builders take keywords only; the keywords are the parameters of the system."""
from ..lazy import lazy
from ..system import builder as builder  # public: makes a function of yours a builder

_MODULES = {
    "belt": ("belt_oscillator",),
    "chains": ("impact_chain",),
    "dampers": ("friction_damped_oscillator", "macro_slip_contact", "micro_slip_ring", "micro_slip_strip"),
    "first_order": ("buck_converter", "chua_circuit", "integrate_and_fire", "relay_feedback", "thermostat"),
    "friction": ("dry_friction_oscillator", "jenkins_oscillator"),
    "oscillators": ("bilinear_oscillator", "bouncing_ball", "duffing_oscillator", "impact_oscillator",
                    "moving_frame_impact_oscillator", "two_sided_impact_oscillator"),
    "rotors": ("jeffcott_rotor", "oil_film_journal", "oil_film_rotor", "oil_film_rub_rotor", "rigid_stator_rotor",
               "rotating_frame_rotor", "rotor_in_casing", "snubber_rotor"),
    "timed": ("gear_mesh", "mathieu_oscillator", "rotating_pendulum", "vibro_impact_capsule"),
}
_NAMES = {name: module for module, names in _MODULES.items() for name in names}

__all__ = [*sorted(_NAMES)]
__getattr__, __dir__ = lazy(__name__, _NAMES)
