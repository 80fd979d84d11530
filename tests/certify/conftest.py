"""Shared by tests of certificates."""
import pytest


@pytest.fixture
def bits():
    """Balls of 128 bits."""
    from bifurc.certify.arithmetic.balls import working

    with working(128):
        yield
