"""The derivative of an event against finite differences in balls of 400 bits: a wrong sign there would prove falsehoods."""
import pytest

import bifurc as bf
from bifurc import System
from bifurc.certify.arithmetic.balls import flint, working
from bifurc.certify.candidate import candidate_of
from bifurc.certify.orbit import prepare, solve
from bifurc.certify.spectrum import saltations
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop

pytest.importorskip("flint")

SCENES = {
    "impact": bf.systems.impact_oscillator(omega=0.8),
    "moving table": bf.systems.bouncing_ball(),
    "impact in a chain": bf.systems.impact_chain(),
    "stick and slip": System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Coulomb(0.6, static_ratio=1.2)], omega=0.4),
    "elastic slider": System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Jenkins(2.0, 0.6)], omega=0.9),
    "elastic stop": System(1.0, 0.1, 1.0, [HarmonicForce(1.0), ElasticStop(0.5, 6.0, damping=0.4)], omega=0.9),
    "rest on the stop": System(1.0, 0.1, 1.0, [HarmonicForce(1.0), RigidStop(0.3, 0.0)], omega=0.9),
}
GUESSES = {"moving table": (2.49, 2.37)}  # a bouncing ball; from rest it is carried along


@pytest.mark.parametrize("scene", SCENES, ids=str)
def test_saltation_is_the_derivative_of_the_motion_through_an_event(scene):
    orbit = bf.find_orbit(SCENES[scene], guess=GUESSES.get(scene))
    with working(400):
        proof, why, _ = solve(prepare(candidate_of(orbit)), (1e-9,))
        assert proof is not None, why
        pieces, solved = proof.pieces, proof.solved
        jumps = saltations(pieces, solved)
        arb = flint().arb
        before_or_after, size = arb(2) ** -10, arb(2) ** -120
        events = 0
        for i, G in enumerate(pieces.G):
            if G is None:
                continue
            B0, B1, R, G = pieces.B[i - 1].value, pieces.B[i].value, pieces.R[i].value, G.value
            x = mid(solved.x[i].value)
            x = on_guard(x, B0, G)
            start = (B0 * -before_or_after).exp() * x
            centre = (B1 * before_or_after).exp() * R * x
            whole = (B1 * before_or_after).exp() * jumps[i] * (B0 * before_or_after).exp()
            for c in range(pieces.ns):
                moved = flint().arb_mat(start.nrows(), 1, [start[k, 0] + (size if k == c else 0) for k in range(start.nrows())])
                time = arrival(moved, B0, G, before_or_after)
                end = (B1 * (2 * before_or_after - time)).exp() * R * (B0 * time).exp() * moved
                for r in range(pieces.ns):
                    slope = (end[r, 0] - centre[r, 0]) / size
                    assert abs(float((slope - whole[r, c]).mid())) < 1e-12 * max(1.0, abs(float(whole[r, c].mid()))), (i, r, c)
            events += 1
        assert events


def mid(x):
    """The middles of a matrix of balls."""
    return flint().arb_mat(x.nrows(), x.ncols(), [v.mid() for v in x.entries()])


def arrival(x, B, G, guess):
    """The phase at which a guard vanishes, by Newton."""
    for _ in range(12):
        y = (B * guess).exp() * x
        guess = (guess - (G * y)[0, 0] / (G * (B * y))[0, 0]).mid()
    return guess


def on_guard(x, B, G):
    """A state carried along until it is on the guard to the working precision."""
    return mid((B * arrival(x, B, G, flint().arb(0))).exp() * x)
