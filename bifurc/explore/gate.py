"""Who may talk to the explorer: one browser on this machine, that was handed the token, and no page of another site.

A request is let in when all hold: it names the address it was bound to (Host: a name that was rebound to 127.0.0.1 is
refused), any Origin is exactly the page's own, path and method are among the few that exist, and it carries the token,
once, or the cookie that was given for it.
"""
import hmac
import re
import secrets
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie

ADDRESS = "127.0.0.1"
_PATH = re.compile(r"/|/ws|/favicon\.ico|/static/js(/[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*)+")  # of files whose names are plain


class Gate:
    """Decides about requests.

    Parameters
    ----------
    port : int

    Attributes
    ----------
    host, origin : str
        The only ones that are answered.
    token : str
        Opens the first page; used up then.
    cookie : tuple of str
        Name and value that later requests carry.
    """

    def __init__(self, port: int):
        self.host, self.origin = f"{ADDRESS}:{port}", f"http://{ADDRESS}:{port}"
        self.token = secrets.token_urlsafe(32)
        self.cookie = (f"bifurc-explore-{port}", secrets.token_urlsafe(32))
        self._used = False

    @property
    def url(self) -> str:
        """Address of the first page."""
        return f"{self.origin}/?token={self.token}"

    def refuses(self, method: str, path: str, headers: Mapping[str, str], token: str | None) -> str | None:
        """Return why a request is refused, None if it is let in.

        Parameters
        ----------
        method, path : str
        headers : mapping
            Of the request; names in any case.
        token : str or None
            Of the address.
        """
        found = {name.lower(): value for name, value in headers.items()}
        if found.get("host") != self.host:
            return f"host {found.get('host')!r} is not {self.host}"
        origin = found.get("origin")
        if origin != self.origin and (origin is not None or path == "/ws"):
            return f"origin {origin!r} is not {self.origin}"
        if method not in ("GET", "HEAD"):
            return f"method {method} is not allowed"
        if not exists(path):
            return f"there is no {path}"
        if self._has_cookie(found.get("cookie", "")):
            return None
        if path == "/" and token is not None and not self._used and hmac.compare_digest(token.encode(), self.token.encode()):
            self._used = True
            return None
        return "the token is missing, wrong or used up; open the address that the terminal showed in one browser"

    def _has_cookie(self, header: str) -> bool:
        try:
            found = SimpleCookie(header).get(self.cookie[0])
        except CookieError:
            return False
        return found is not None and hmac.compare_digest(found.value.encode(), self.cookie[1].encode())


def exists(path: str) -> bool:
    """Return whether there is something that a path, as it came in, can name."""
    return _PATH.fullmatch(path) is not None


def policy(host: str, nonce: str) -> str:
    """Return the content security policy of the page: its own scripts and style sheets, this server, nothing else.

    bokeh puts a style sheet into every widget; those that its scripts make carry the nonce, see `server.NONCE`.
    """
    return (f"default-src 'none'; script-src 'self' 'nonce-{nonce}'; style-src 'self' 'nonce-{nonce}'; img-src 'self' data: blob:; "
            f"font-src 'self' data:; connect-src 'self' ws://{host}; base-uri 'none'; form-action 'none'; "
            "frame-ancestors 'none'; object-src 'none'")
