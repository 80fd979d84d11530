"""Damaged files of results: each is refused by name, or holds what was saved; quickly, and in little memory."""
import pytest

from tests.hard.damaged import BAD, KINDS, UNKNOWN, VOUCHED, study

QUICK = ("orbit", "sweep", "certificate")


def judged(count, folder, kinds, seed):
    """Return the bad rows of so many files."""
    rows = study(count, folder, seed, kinds)
    assert len(rows) == count and len({row[1] for row in rows}) > min(count, len(UNKNOWN) + len(VOUCHED)) / 3
    assert sum(row[2] == "refused" for row in rows) > count / 2
    return [row for row in rows if row[2] in BAD]


def test_a_hundred_damaged_files(tmp_path):
    """Of three kinds of results: one motion, several with their rows, texts."""
    assert judged(100, tmp_path, QUICK, seed=7) == []


@pytest.mark.slow
def test_a_thousand_damaged_files(tmp_path):
    """Of all kinds."""
    assert judged(1000, tmp_path, tuple(KINDS), seed=1000) == []
