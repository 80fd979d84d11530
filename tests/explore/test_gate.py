"""Who is let in: one browser with the token, and nobody else."""
import pytest

from bifurc.explore.gate import Gate, policy


@pytest.fixture
def gate():
    return Gate(5123)


def asked(gate, path="/", token=None, method="GET", **headers):
    return gate.refuses(method, path, {"Host": "127.0.0.1:5123", **{name.title(): value for name, value in headers.items()}}, token)


def test_the_token_opens_once_and_the_cookie_afterwards(gate):
    assert asked(gate, token=gate.token) is None
    assert "used up" in asked(gate, token=gate.token)
    cookie = "=".join(gate.cookie)
    assert asked(gate, cookie=f"other=1; {cookie}") is None
    assert asked(gate, "/static/js/bokeh.min.js", cookie=cookie) is None
    assert asked(gate, "/ws", cookie=cookie, origin="http://127.0.0.1:5123") is None


@pytest.mark.parametrize("host", ["localhost:5123", "127.0.0.1", "127.0.0.1:5124", "attacker.example:5123", "", "127.0.0.1:5123."])
def test_another_host_is_refused_with_the_right_token(gate, host):
    assert "host" in gate.refuses("GET", "/", {"Host": host}, gate.token)
    assert gate.refuses("GET", "/", {}, gate.token)
    assert asked(gate, token=gate.token) is None  # it was not used up by that


@pytest.mark.parametrize("origin", ["http://attacker.example", "null", "https://127.0.0.1:5123", "http://127.0.0.1:5124",
                                    "http://localhost:5123", "http://127.0.0.1:5123.attacker.example", ""])
def test_another_origin_is_refused_with_the_cookie(gate, origin):
    for path in ("/", "/ws", "/static/js/bokeh.min.js"):
        assert "origin" in asked(gate, path, cookie="=".join(gate.cookie), origin=origin)


def test_a_socket_without_an_origin_is_refused(gate):
    assert "origin" in asked(gate, "/ws", cookie="=".join(gate.cookie))


@pytest.mark.parametrize("token", [None, "", "x", "ü"])
def test_no_token_no_page(gate, token):
    assert "token" in asked(gate, token=token)
    assert "token" in asked(gate, "/static/js/bokeh.min.js", token=gate.token)
    assert "token" in asked(gate, cookie=f"{gate.cookie[0]}=wrong")


@pytest.mark.parametrize("path", ["/autoload.js", "/metadata", "/static/../secret", "/static/js/../../x", "/static/extensions/x",
                                  "//", "", "/static/js/", "/static/js", "/static/js/%00", "/static/js/%2e%2e/x",
                                  "/static/js/a%2fb", "/static/js/%ff", "/static/js/.hidden", "/static/js/a..b", "/static/js//a.js",
                                  "/static/js/a.js/",
                                  "/static/js/\u0000", "/static/js/a b", "/ws/", "/%", "/favicon.ico%00", "/static/js/a.js\n"])
def test_only_a_few_paths_exist(gate, path):
    assert "there is no" in asked(gate, path, cookie="=".join(gate.cookie))


def test_nothing_is_posted(gate):
    assert "method" in asked(gate, cookie="=".join(gate.cookie), method="POST")


def test_the_policy_knows_no_other_host_and_no_eval():
    text = policy("127.0.0.1:5123", "abc")
    assert "unsafe-eval" not in text and "*" not in text
    assert "script-src 'self' 'nonce-abc'" in text and "default-src 'none'" in text
    assert "style-src 'self' 'nonce-abc'" in text
    assert "unsafe" not in text
