"""Old public names still work, with a warning that gives the new one."""
from dataclasses import dataclass

import pytest

import bifurc as bf
from bifurc.basins.maps import reliability
from bifurc.hbm.status import BalanceStatus


def test_old_names_of_modules_warn_and_are_the_new_things():
    with pytest.warns(DeprecationWarning, match="Slaved is called Algebraic"):
        assert bf.elements.Slaved is bf.elements.Algebraic
    with pytest.warns(DeprecationWarning, match="TrustKind is called ReliabilityKind"):
        assert reliability.TrustKind is reliability.ReliabilityKind
    with pytest.raises(AttributeError, match="has no attribute 'Slave'"):
        bf.elements.Slave  # noqa: B018


def test_an_element_of_a_users_own_may_give_its_undeformed_memory_under_the_old_name():
    with pytest.warns(DeprecationWarning, match="Old.relaxed is called virgin"):
        @dataclass(frozen=True)
        class Old(bf.elements.Element):
            relaxed = (bf.elements.local.affine(0.5),)
    assert Old().virgin == (bf.elements.local.affine(0.5),)


def test_an_old_status_in_a_file_is_read_as_the_new_one():
    with pytest.warns(DeprecationWarning, match="contacts_failed"):
        assert BalanceStatus("march_failed") is BalanceStatus.CONTACTS_FAILED
