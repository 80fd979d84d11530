"""Old public names still work, with a warning that gives the new one."""
import pytest

import bifurc as bf
from bifurc.basins.maps import reliability


def test_old_names_of_modules_warn_and_are_the_new_things():
    with pytest.warns(DeprecationWarning, match="Slaved is called Algebraic"):
        assert bf.elements.Slaved is bf.elements.Algebraic
    with pytest.warns(DeprecationWarning, match="TrustKind is called ReliabilityKind"):
        assert reliability.TrustKind is reliability.ReliabilityKind
    with pytest.raises(AttributeError, match="has no attribute 'Slave'"):
        bf.elements.Slave  # noqa: B018
