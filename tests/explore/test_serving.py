"""How the explorer begins and ends in a process: what it leaves as it was."""
import signal
from types import SimpleNamespace

import pytest

import bifurc as bf

pytest.importorskip("bokeh")
from bifurc.explore import desk, server, serving


@pytest.mark.parametrize("ending", [None, KeyboardInterrupt, RuntimeError])
def test_what_was_done_at_a_signal_is_done_again_behind_the_explorer(monkeypatch, ending):
    """Whichever way it ends; its desk is closed, and while it runs the signal ends it."""
    said, seen, closed = [], [], []

    def run():
        signal.getsignal(signal.SIGTERM)(signal.SIGTERM, None)
        if ending is not None:
            raise ending

    loop = SimpleNamespace(add_callback_from_signal=seen.append)
    made = SimpleNamespace(url="http://127.0.0.1:1/", loop=loop, end="the end", run=run,
                           desk=SimpleNamespace(close=lambda: closed.append(1)))
    monkeypatch.setattr(server, "Explorer", lambda desk: made)
    asked: list = []
    monkeypatch.setattr(desk, "Desk", lambda *arguments: asked.append(arguments))

    def own(number, frame):
        pytest.fail("the explorer was not running")
    before = signal.signal(signal.SIGTERM, own)
    try:
        if ending is RuntimeError:
            with pytest.raises(RuntimeError):
                serving.serve(bf.systems.impact_oscillator(), out="here", workers=3, browser=False, say=said.append)
        else:
            serving.serve(bf.systems.impact_oscillator(), out="here", workers=3, browser=False, say=said.append)
        assert signal.getsignal(signal.SIGTERM) is own and seen == ["the end"] and closed == [1]
        assert [arguments[1:] for arguments in asked] == [("here", 3)]
    finally:
        signal.signal(signal.SIGTERM, before)
    assert said[0].startswith("explorer: http://127.0.0.1:1/") and ("explorer closed" in said) == (ending is KeyboardInterrupt)
