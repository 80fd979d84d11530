"""Effects a system is made of, and the protocol to write new ones: see `Element`."""
from . import local
from .atrow import AtRow
from .driven import Driven
from .element import ALWAYS, Element
from .forcing import BaseMotion, ConstantForce, HarmonicForce
from .friction import Coulomb, Jenkins, LoadedContact, RegularizedFriction, Stribeck
from .kinds import EventKind
from .loadedslip import LoadedMicroSlip
from .local import Affine, Core, Frame
from .microslip import Iwan, MicroSlip, SliderSet
from .mode import Guard, Hold, Kick, Law, Mode, Rate, Restitution, Slaved
from .site import Rows
from .springs import CubicSpring, Force, LinearSpring, PolynomialSpring
from .stops import ElasticStop, RigidStop, Wall

__all__ = ["ALWAYS", "Affine", "AtRow", "BaseMotion", "ConstantForce", "Core", "Coulomb", "CubicSpring",
           "Driven", "ElasticStop", "Element", "EventKind", "Force", "Frame", "Guard", "HarmonicForce", "Hold", "Iwan",
           "Jenkins", "Kick", "Law", "LinearSpring", "LoadedContact", "LoadedMicroSlip", "MicroSlip", "Mode",
           "PolynomialSpring", "Rate",
           "RegularizedFriction", "Restitution", "RigidStop", "Rows", "Slaved", "SliderSet", "Stribeck", "Wall", "local"]

BUILT_IN = {cls.__name__: cls for cls in (BaseMotion, ConstantForce, Coulomb, CubicSpring, Driven, ElasticStop, Force,
                                          HarmonicForce, Iwan, Jenkins, LinearSpring, LoadedMicroSlip, MicroSlip,
                                          PolynomialSpring, RegularizedFriction, RigidStop, Stribeck)}
