"""Shared by tests of certificates."""
import pytest


@pytest.fixture
def bits():
    """Balls of 128 bits."""
    from bifurc.certify.arithmetic.balls import working

    with working(128):
        yield


@pytest.fixture(scope="session")
def branch():
    """The branch of the README; nothing is written into it but its certificate."""
    import bifurc as bf

    return bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.5, 2.0))
