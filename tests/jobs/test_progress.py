"""Progress: silent unless shown, a bar with tqdm, one plain line without, and nothing left behind."""
import io
import sys

import pytest

from bifurc.jobs.progress import Progress


class Screen(io.StringIO):
    def isatty(self):
        return True


def work(shown, monkeypatch, screen=None):
    """Run four steps with the error stream replaced (inside the test: pytest resets the stream between its phases)."""
    if screen is not None:
        monkeypatch.setattr(sys, "stderr", screen)
    with Progress("basins", total=4, shown=shown) as progress:
        for k in range(4):
            progress.advance(1, f"{k + 1} of 4")
    return progress.done


def test_silent_unless_shown(monkeypatch):
    screen = Screen()
    assert work(False, monkeypatch, screen) == 4
    assert screen.getvalue() == ""


def test_bar_with_tqdm(monkeypatch):
    pytest.importorskip("tqdm")
    screen = Screen()
    work(True, monkeypatch, screen)
    assert "basins:" in screen.getvalue()


def test_plain_line_without_tqdm_is_wiped(monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)
    screen = Screen()
    work(True, monkeypatch, screen)
    assert "basins:  25 % 1 of 4" in screen.getvalue()
    assert screen.getvalue().endswith(" " * 79 + "\r")


def test_plain_line_is_not_written_to_files(monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)
    file = io.StringIO()
    work(True, monkeypatch, file)
    assert file.getvalue() == ""


def test_the_bar_closes_on_an_interrupt_and_lets_it_pass():
    with pytest.raises(KeyboardInterrupt), Progress("trace", total=1) as progress:
        progress.advance(0.5)
        raise KeyboardInterrupt
    assert progress.done == 0.5


def test_more_work_than_announced_stays_at_the_end():
    with Progress("trace", total=1.0, shown=False) as progress:
        progress.advance(3.0)
    assert progress.done == 1.0
