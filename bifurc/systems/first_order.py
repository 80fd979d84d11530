"""Systems of first order: a thermostat, relay feedback, a converter, a neuron, Chua's circuit."""
import numpy as np

from ..piecewise import AffineField, AffineReset, AffineSurface, HybridSystem, Jump, PiecewiseSystem, Switch
from ..system import System, builder


@builder
def thermostat(*, room: float = 10.0, power: float = 20.0, time: float = 5.0, low: float = 19.0, width: float = 2.0) -> System:
    """Return a room that is heated from a low temperature up to a high one: time x' = room + power u - x with u = 0 or 1.

    Parameters
    ----------
    room, power : float
        Temperature without heating, and what heating adds to it.
    time : float
        Time in which differences fall by e.
    low, width : float
        Temperature at which heating begins, and how far above it ends.
    """
    A = [[-1.0 / time]]
    return PiecewiseSystem("x", {"on": AffineField(A, [(room + power) / time]), "off": AffineField(A, [room / time])},
                           [Switch(AffineSurface([1.0]), below="on", above="off", hysteresis=(low, low + width))])


@builder
def relay_feedback(*, s: float = -1.0, zeta: float = 0.5, w: float = 1.0, pole: float = 1.0, r: float = 1.0) -> System:
    """Return relay feedback of three states, x' = A x - B sgn x1, which slides where |x2| is small.

    di Bernardo, Johansson and Vasca, Int. J. Bifurcation Chaos 11 (2001).

    Parameters
    ----------
    s, r : float
        B = (1, 2 s r, r^2): zeros of the plant.
    zeta, w, pole : float
        Damping ratio and frequency of its pair of poles, and the real one.
    """
    A = [[-(2 * zeta * w + pole), 1, 0], [-(2 * zeta * w * pole + w * w), 0, 1], [-pole * w * w, 0, 0]]
    B = np.array([1.0, 2.0 * s * r, r * r])
    return PiecewiseSystem("x1 x2 x3", {"-": AffineField(A, B), "+": AffineField(A, -B)}, [Switch(AffineSurface([1, 0, 0]))])


@builder
def buck_converter(*, E: float = 20.0, R: float = 22.0, L: float = 20e-3, C: float = 47e-6, T: float = 400e-6, a: float = 8.4,
                   Vref: float = 11.3, low: float = 3.8, high: float = 8.2) -> System:
    """Return a buck converter under a voltage control; di Bernardo, Garofalo, Glielmo, Vasca, IEEE Trans. Circuits Syst. I (1998).

    It is on where a (v - Vref) is below a ramp from ``low`` to ``high`` of period T, which falls back at once.

    Parameters
    ----------
    E, R, L, C : float
        Source (V), load (ohm), inductance (H), capacitance (F).
    T, low, high : float
        Period (s) and bounds (V) of the ramp.
    a, Vref : float
        Gain, and reference voltage (V).
    """
    A = [[-1 / (R * C), 1 / C], [-1 / L, 0]]
    ramp = AffineSurface([a, 0], -a * Vref - low, ramp=low - high)
    return PiecewiseSystem("v i", {"on": AffineField(A, [0, E / L]), "off": AffineField(A)},
                           [Switch(ramp, below="on", above="off", sliding=False)], period=T, clock={0.0: "decide"})


@builder
def integrate_and_fire(*, current: float = 1.5, threshold: float = 1.0, rest: float = 0.0) -> System:
    """Return a neuron v' = current - v that is reset where it reaches a threshold.

    Parameters
    ----------
    current : float
        Dimensionless.
    threshold, rest : float
        Where it is reset, and to what.
    """
    return HybridSystem("v", {"rise": AffineField([[-1.0]], [current])}, [
        Jump("rise", AffineSurface([1.0], -threshold), to="rise", reset=AffineReset([[0.0]], [rest]))])


@builder
def chua_circuit(*, alpha: float = 8.2, beta: float = 100.0 / 7.0, m0: float = -8.0 / 7.0, m1: float = -5.0 / 7.0) -> System:
    """Return Chua's circuit x' = alpha (y - x - f(x)), y' = x - y + z, z' = -beta y.

    Parameters
    ----------
    alpha, beta : float
        Dimensionless.
    m0, m1 : float
        Slopes of the characteristic f in |x| < 1, and beyond.
    """
    def piece(slope, offset):
        return AffineField([[-alpha * (1 + slope), alpha, 0], [1, -1, 1], [0, -beta, 0]], [-alpha * offset, 0, 0])
    return PiecewiseSystem("x y z", {"--": piece(m1, m1 - m0), "+-": piece(m0, 0.0), "++": piece(m1, m0 - m1)},
                           [Switch(AffineSurface([1, 0, 0], 1.0)), Switch(AffineSurface([1, 0, 0], -1.0))])
