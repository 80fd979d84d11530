"""Effects a system is made of, and the protocol to write new ones: see `Element`."""
from ..lazy import renamed
from . import local
from .atrow import AtRow
from .bearings import OilFilm
from .driven import Driven
from .element import ALWAYS, BUILT_IN, Element
from .feedback import DelayedFeedback
from .forcing import BaseMotion, ConstantForce, HarmonicForce, PeriodicForce
from .friction.dry import Coulomb, CubicFriction, Jenkins, LoadedContact, RegularizedFriction, Stribeck
from .friction.loaded_slip import LoadedMicroSlip
from .friction.microslip import Iwan, MicroSlip, SliderSet
from .kinds import EventKind
from .local import Affine, Core, Frame, WatchedCore
from .mode import Algebraic, Guard, Hold, Kick, Law, Mode, Rate, Restitution
from .site import Circle, Ring, Rows, Surface
from .springs import CubicSpring, Force, LinearSpring, PolynomialSpring
from .stators import AroundPoint, ElasticStator, RigidStator
from .stops import ElasticStop, RigidStop, Wall
from .timed.shift import Shift
from .timed.switched import Pulse, SquareForce, SquareSpring, Switched
from .timed.varying import ParametricSpring, ParametricStop

__all__ = ["ALWAYS", "Affine", "AroundPoint", "AtRow", "BaseMotion", "Circle", "ConstantForce", "Core", "Coulomb",
           "CubicFriction", "CubicSpring", "DelayedFeedback", "Driven", "ElasticStator", "ElasticStop", "Element", "EventKind",
           "Force", "Frame", "Guard", "HarmonicForce", "Hold", "Iwan", "Jenkins", "Kick", "Law", "LinearSpring", "LoadedContact",
           "LoadedMicroSlip", "MicroSlip", "Mode", "OilFilm", "ParametricSpring", "ParametricStop", "PeriodicForce",
           "PolynomialSpring", "Pulse", "Rate", "RegularizedFriction", "Restitution", "RigidStator", "RigidStop", "Ring", "Rows",
           "Algebraic", "Shift", "SliderSet", "SquareForce", "SquareSpring", "Stribeck", "Surface", "Switched", "Wall",
           "WatchedCore", "local"]

BUILT_IN.update({cls.__name__: cls for cls in (
    BaseMotion, ConstantForce, Coulomb, CubicFriction, CubicSpring, DelayedFeedback, Driven, ElasticStator, ElasticStop, Force,
    HarmonicForce, Iwan, Jenkins, LinearSpring, LoadedMicroSlip, MicroSlip, OilFilm, ParametricSpring, ParametricStop,
    PeriodicForce, PolynomialSpring, Pulse, RegularizedFriction, RigidStator, RigidStop, Shift, SquareForce, SquareSpring,
    Stribeck)})

__getattr__ = renamed(globals(), {"Slaved": "Algebraic"})
