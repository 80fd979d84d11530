"""The server asked by hand, without a browser: who is let in, what is answered, how it ends."""

import asyncio
import http.client
import threading
from types import SimpleNamespace

import pytest

import bifurc as bf
from bifurc.explore import model

pytest.importorskip("bokeh")
from bifurc.explore.gate import policy
from bifurc.explore.server import NONCE, Explorer


class Desk:
    """A desk at which nothing is computed."""

    def __init__(self):
        self.now = model.of_system(bf.systems.impact_oscillator(), bounds=(0.5, 2.0), window={"q0": (-3.0, 1.0), "v0": (-4.0, 4.0)})
        self.session, self.busy, self.pages, self.closed = SimpleNamespace(can_go_back=False), [], [], False

    def attach(self, page):
        self.pages.append(page)

    def detach(self, page):
        self.pages.remove(page)

    def close(self):
        self.closed = True

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *arguments: None


ODD = ["/?token=%ff", "/?token=%00&token=x", "/ws", "/ws?bokeh-session-id=x"]  # no harm is done
MALFORMED = [*ODD, "/?bokeh-session-id=%00", "/?bokeh-session-id=x", "/?bokeh-token=x", "/?x", "/?%00=%ff",
             "/static/js/%00", "/static/js/a%00.js", "/static/js/%ff", "/static/js/", "/static/js",
             "/static/js/none.js",
             "/static/js/%2e%2e/%2e%2e/x", "/static/js/..%5c..%5cx", "/static/js/" + 5000 * "a",
             "/static/js/" + 300 * "a/", "/%", "/%00",
             "//", "/static/js//etc/passwd", "/ws%00", "/favicon.ico%00", "/autoload.js?bokeh-autoload-element=1", "*", "x",
             "/static/js/lib/", "/static/js/compiler.ts/x"]


@pytest.fixture
def served():
    made, ready = {}, threading.Event()

    def run():
        asyncio.set_event_loop(asyncio.new_event_loop())
        made["explorer"] = Explorer(Desk())
        ready.set()
        made["explorer"].run()

    thread = threading.Thread(target=run)
    thread.start()
    assert ready.wait(30)
    explorer = made["explorer"]
    yield explorer
    explorer.stop()
    thread.join(30)
    assert not thread.is_alive() and explorer.desk.closed


def asked(explorer, path, method="GET", **headers):
    address = explorer.gate.host
    connection = http.client.HTTPConnection(*address.split(":"), timeout=20)
    connection.putrequest(method, path, skip_host=True)
    for name, value in {"Host": address, **headers}.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, dict(answer.getheaders()), text


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")
def test_who_is_let_in_and_what_is_answered(served):
    assert served.url.startswith(f"http://{served.gate.host}/?token=")
    path = served.url.partition(served.gate.host)[2]
    status, headers, text = asked(served, "/")
    assert status == 403 and text.startswith("refused: ") and headers["Content-Type"] == "text/plain; charset=utf-8"
    assert headers["X-Content-Type-Options"] == "nosniff" and "Set-Cookie" not in headers
    assert asked(served, path, Host="evil.example")[0] == 403 and asked(served, path, "POST")[0] == 403
    assert served.desk.pages == []
    status, headers, text = asked(served, path)
    assert status == 200 and headers["Content-Type"] == "text/html; charset=utf-8" and len(served.desk.pages) == 1
    nonce = text.partition('<style nonce="')[2].partition('"')[0]
    assert len(nonce) > 16 and headers["Content-Security-Policy"] == policy(served.gate.host, nonce)
    assert text.count(f'nonce="{nonce}"') >= 4 and NONCE in text and "<title>bifurc explore</title>" in text
    for name, value in (
        ("Referrer-Policy", "no-referrer"),
        ("Cache-Control", "no-store"),
        ("Cross-Origin-Opener-Policy", "same-origin"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
        ("X-Content-Type-Options", "nosniff"),
    ):
        assert headers[name] == value
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie and "Path=/" in cookie
    again = asked(served, "/", Cookie=cookie.partition(";")[0])
    assert again[0] == 200 and again[2].partition('<style nonce="')[2].partition('"')[0] != nonce  # a nonce each
    assert asked(served, path)[0] == 403  # the token was for once
    for wrong in MALFORMED:  # with the cookie, and without
        assert asked(served, wrong, Cookie=cookie.partition(";")[0])[0] in ((200, 400, 403) if wrong in ODD else (400, 404)), wrong
        assert asked(served, wrong)[0] in (400, 403, 404), wrong
    mine = cookie.partition(";")[0]
    assert asked(served, "/", Cookie=mine, **{"Bokeh-Session-Id": "%00"})[0] == 400
    for token in ("x", "e30.e30", "%00", "=", "\u00ff"):
        upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
                   "Sec-WebSocket-Key": "x" * 22 + "==",
                   "Sec-WebSocket-Protocol": f"bokeh, {token}", "Origin": served.gate.origin}
        assert asked(served, "/ws", Cookie=mine, **upgrade)[0] != 500
    script = next(part for part in text.split('"') if part.endswith("bokeh.min.js") or part.endswith("bokeh.js"))
    assert script.startswith("/static/")
