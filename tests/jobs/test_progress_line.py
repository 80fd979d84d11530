"""Progress as it is shown: how often the plain line is written and what it says, what a bar and a function are told."""
import io
import sys
from types import SimpleNamespace

import pytest

from bifurc.jobs import progress as module
from bifurc.jobs.progress import Progress


class Screen(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def line(monkeypatch):
    """A screen without tqdm, and a clock that is set by hand."""
    screen, clock = Screen(), SimpleNamespace(now=100.0)
    monkeypatch.setitem(sys.modules, "tqdm", None)
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: clock.now))

    def show(bar, moments, amount=1.0, note=""):
        """Advance at given moments; return what was written each time (inside the test: pytest resets the stream)."""
        written = []
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stderr", screen)
            for clock.now in moments:
                before = len(screen.getvalue())
                bar.advance(amount, note)
                written.append(screen.getvalue()[before:])
        return written
    return show


def test_a_line_is_written_at_once_and_then_no_more_than_five_times_a_second(line):
    bar = Progress("work", total=100.0)
    written = line(bar, [100.0, 100.1, 100.15, 100.25, 100.4, 100.5, 103.0])
    assert [bool(text) for text in written] == [True, False, False, True, False, True, True]
    assert [text.strip() for text in written if text] == ["work:   1 %", "work:   4 %", "work:   6 %", "work:   7 %"]
    assert all(text.startswith("\r") and len(text) == 79 for text in written if text)
    steady = line(Progress("work", total=1000.0), [0.01 * k for k in range(200)])
    assert 8 <= sum(bool(text) for text in steady) <= 10


@pytest.mark.parametrize("total, amount, words", [
    (3.0, 1.0, "work:  33 % now"), (3.0, 3.0, "work: 100 % now"), (3.0, 9.0, "work: 100 % now"), (0.0, 1.0, "work: 100 % now"),
    (None, 7.4, "work: 7 now"), (200.0, 1.1, "work:   1 % now")])
def test_what_the_line_says(line, total, amount, words):
    (text,) = line(Progress("work", total), [1000.0], amount, "now")
    assert text[1:].rstrip() == words


def test_nothing_is_written_that_was_not_asked_for(line):
    for shown in (False, None):
        assert line(Progress("work", 3.0, shown), [5.0, 9.0]) == ["", ""]


@pytest.mark.parametrize("wrong", ["yes", 1, 0.0, []])
def test_other_ways_to_show_are_refused(wrong):
    with pytest.raises(ValueError, match="work: progress = .* is not allowed; it must be True, False or a function"):
        Progress("work", 1.0, wrong)


def test_a_function_is_told_the_share(capsys):
    told = []
    with Progress("work", 8.0, told.append) as bar:
        for amount in (2.0, 0.0, 4.0, 4.0):
            bar.advance(amount, "note")
    assert told == [0.25, 0.25, 0.75, 1.0] and bar.done == 8.0
    for total, want in ((None, [3.0, 5.0]), (0.0, [0.0, 0.0])):
        told.clear()
        with Progress("work", total, told.append) as bar:
            bar.advance(3.0)
            bar.advance(2.0)
        assert told == want
    assert capsys.readouterr().err == ""


class Bar:
    """What tqdm is asked for."""

    def __init__(self, **asked):
        self.asked, self.n, self.notes, self.closed = asked, 0.0, [], 0

    def update(self, amount):
        self.n += amount

    def set_postfix_str(self, note, refresh):
        self.notes.append((self.n, note, refresh))

    def close(self):
        self.closed += 1


def test_a_bar_is_where_the_work_is(monkeypatch):
    made = []

    def tqdm(**asked):
        made.append(Bar(**asked))
        return made[-1]
    monkeypatch.setitem(sys.modules, "tqdm", SimpleNamespace(tqdm=tqdm))
    places = []
    with Progress("work", 10.0) as bar:
        for amount, note in ((2.5, "one"), (0.0, "two"), (4.0, ""), (9.0, "last")):
            bar.advance(amount, note)
            places.append(made[0].n)
        assert not made[0].closed
    assert places == [2.5, 2.5, 6.5, 10.0] and made[0].closed == 1
    assert made[0].notes == [(0.0, "one", False), (2.5, "two", False), (6.5, "last", False)]
    asked = made[0].asked
    assert (asked["total"], asked["desc"], asked["leave"]) == (10.0, "work", False) and "{percentage" in asked["bar_format"]
    with Progress("work", None) as bar:
        bar.advance(3.0)
        bar.advance(4.0)
    assert made[1].n == 7.0 and "{percentage" not in made[1].asked["bar_format"] and "{n:" in made[1].asked["bar_format"]
    with pytest.raises(KeyboardInterrupt), Progress("work", 1.0):
        raise KeyboardInterrupt
    assert made[2].closed == 1
    for quiet in (False, None, places.append):
        with Progress("work", 1.0, quiet):
            pass
    assert len(made) == 3


def test_the_line_is_wiped_once_and_only_where_one_was_written(monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)
    for steps, left in ((1, "\r" + " " * 79 + "\r"), (0, "")):
        screen = Screen()
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stderr", screen)
            with Progress("work", 4.0) as bar:
                for _ in range(steps):
                    bar.advance(1.0)
                before = len(screen.getvalue())
        assert screen.getvalue()[before:] == left and bool(before) == bool(steps)
