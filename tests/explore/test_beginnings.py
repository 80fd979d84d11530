"""What an explorer computes first: an orbit, and its branch where none was brought along."""
import threading
from types import SimpleNamespace

import pytest

from bifurc.explore import model
from bifurc.explore.desk import Desk


@pytest.mark.parametrize("branches, orbit, traced", [((), "o", True), (("b",), "o", False), ((), None, False),
                                                     (("b",), None, False)])
def test_a_branch_is_traced_where_there_is_an_orbit_and_none_yet(branches, orbit, traced, monkeypatch):
    asked, session = [], SimpleNamespace(now=SimpleNamespace(branches=branches, orbit=orbit), first=None)

    def worker(name):
        def ask(work, then):
            asked.append(name)
            then(work(None))
        return SimpleNamespace(ask=ask)

    monkeypatch.setattr(model, "begin", lambda shown: {})
    monkeypatch.setattr(model, "trace_here", lambda shown: {})
    desk = SimpleNamespace(session=session, now=session.now, orbits=worker("orbit"), branches=worker("branch"),
                           _put=lambda result, words: None, _lock=threading.RLock(), _tell=lambda: asked.append("told"))
    Desk.begin(desk)
    assert asked == ["orbit", *["branch"] * traced, "told"] and session.first is session.now
