"""Defaults, constants of methods, fields and enumerations are those that were decided."""
from tests.reference import defaults


def test_what_was_decided_stands():
    defaults.compare("flow")
