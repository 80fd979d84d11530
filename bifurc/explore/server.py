"""The explorer's server: bokeh behind a gate, on 127.0.0.1 and a free port."""
import logging
import secrets
from collections.abc import Mapping
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.embed.elements import script_for_render_items
from bokeh.embed.util import RenderItem
from bokeh.resources import Resources
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.views.doc_handler import DocHandler
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.netutil import bind_sockets
from tornado.web import RequestHandler

from .desk import Desk
from .gate import ADDRESS, Gate, exists, policy
from .view import View

_log = logging.getLogger("bifurc.explore")

# style sheets that bokeh's scripts make carry the nonce of the page; markup that came in from elsewhere would not
NONCE = """const make = document.createElement.bind(document), nonce = document.currentScript.nonce;
document.createElement = (name, ...more) => {
  const made = make(name, ...more);
  if (made instanceof HTMLStyleElement) made.nonce = nonce;
  return made;
};"""

_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style nonce="{nonce}">html, body {{ margin: 0; padding: 0; background: #fff; }} #page {{ padding: 6px 10px; }}</style>
<script nonce="{nonce}">{styles}</script>
{scripts}
</head><body><div id="page"><div id="{element}" data-root-id="{root}"></div></div>
<script nonce="{nonce}">{start}</script></body></html>
"""


_HEADERS = {"X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer", "Cache-Control": "no-store",
            "Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Resource-Policy": "same-origin"}


class Explorer:
    """A server that shows one desk.

    Parameters
    ----------
    desk : Desk

    Attributes
    ----------
    url : str
        Address of the first page, with its one-time token.
    """

    def __init__(self, desk: Desk):
        self.desk = desk
        self.loop = IOLoop.current()
        sockets = bind_sockets(0, ADDRESS)
        self.gate = Gate(sockets[0].getsockname()[1])

        def document(doc: Any) -> None:
            doc.title = "bifurc explore"
            view = View(doc, desk)
            doc.add_root(view.root)
            doc.on_session_destroyed(lambda context: desk.detach(view.changed))
            desk.attach(view.changed)

        tornado = _Guarded({"/": Application(FunctionHandler(document))}, self.gate)
        http = HTTPServer(tornado, max_buffer_size=64 * 2**20)
        http.add_sockets(sockets)
        self._server = BaseServer(self.loop, tornado, http)
        self._server.start()

    @property
    def url(self) -> str:
        """Address of the first page."""
        return self.gate.url

    def run(self) -> None:
        """Serve until interrupted."""
        self.loop.start()

    def stop(self) -> None:
        """End the server; callable from any thread."""
        self.loop.add_callback(self.end)

    def end(self) -> None:
        """End the server; in its own thread."""
        self._server.stop()
        self._server.unlisten()
        self.desk.close()
        self.loop.stop()


class _Guarded(BokehTornado):
    """Bokeh's application behind the gate, with a page of its own."""

    def __init__(self, applications: Mapping[str, Application], gate: Gate):
        self.gate = gate
        super().__init__(dict(applications), extra_websocket_origins=[gate.host], use_index=False, generate_session_ids=True,
                         include_headers=[], include_cookies=[], keep_alive_milliseconds=10000,
                         unused_session_lifetime_milliseconds=15000)

    def find_handler(self, request: Any, **options: Any) -> Any:
        """Return the handler of a request that the gate lets in; the page makes its sessions itself and takes nothing of them."""
        if request.path == "/" and ({*request.query_arguments} - {"token"} or "Bokeh-Session-Id" in request.headers):
            return self.get_handler_delegate(request, _Refusal, {"status": 400, "why": "the page takes nothing but its token"})
        token = request.query_arguments.get("token", [None])[0]
        why = self.gate.refuses(request.method, request.path, dict(request.headers.get_all()),
                                None if token is None else token.decode("utf-8", "replace"))
        if why is not None:
            _log.warning("refused %s %s: %s", request.method, request.path, why)
            return self.get_handler_delegate(request, _Refusal, {"status": 403 if exists(request.path) else 404, "why": why})
        if request.path == "/":
            context = {"application_context": self._applications["/"], "bokeh_websocket_path": "/ws"}
            return self.get_handler_delegate(request, _Page, context)
        return super().find_handler(request, **options)


class _Refusal(RequestHandler):
    def initialize(self, status: int, why: str) -> None:
        self.status, self.why = status, why

    def prepare(self) -> None:
        self.set_status(self.status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.finish(f"refused: {self.why}\n")


class _Page(DocHandler):
    async def get(self, *args: Any, **kwargs: Any) -> None:
        """Answer with the page."""
        gate, nonce = self.application.gate, secrets.token_urlsafe(16)
        session = await self.get_session()
        item = RenderItem(token=session.token, roots=session.document.roots, use_for_title=True)
        ((root, element),) = item.roots._roots.items()
        files = Resources(mode="server", root_url="/", components=["bokeh", "bokeh-widgets"]).js_files
        self.set_header("Content-Type", "text/html; charset=utf-8")
        self.set_header("Content-Security-Policy", policy(gate.host, nonce))
        for name, value in _HEADERS.items():
            self.set_header(name, value)
        self.set_cookie(*gate.cookie, httponly=True, samesite="Strict", path="/")
        self.write(_PAGE.format(title="bifurc explore", nonce=nonce, styles=NONCE, element=element, root=root.id,
                                scripts="\n".join(f'<script nonce="{nonce}" src="{file}"></script>' for file in files),
                                start=script_for_render_items({}, [item])))
