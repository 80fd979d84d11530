"""The explorer in a real browser without a window: what is drawn, what is clicked, dragged and zoomed, and who is refused.

Needs the extra ``browser`` and Debian's chromium (`CHROMIUM` names another one); without them these tests are skipped,
`.ci/run` installs both.  `BIFURC_SCREENSHOTS`, a folder, keeps pictures of the page.
"""
import http.client
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

playwright = pytest.importorskip("playwright.sync_api")
pytest.importorskip("bokeh")
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
if CHROMIUM is None:
    pytest.skip("no chromium", allow_module_level=True)

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")  # of playwright's own event loop


class Server:
    """The command in a process of its own."""

    def __init__(self, folder, *options):
        self.folder = folder
        command = [sys.executable, "-m", "bifurc", "explore", "impact_oscillator", "--no-browser", "--workers", "2",
                   "--out", str(folder), *options]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.url = ""
        for line in self.process.stdout:
            found = re.search(r"http://127\.0\.0\.1:(\d+)/\?token=(\S+)", line)
            if found:
                self.url, self.port, self.token = found[0], int(found[1]), found[2]
                break
        assert self.url, "the server did not start"

    def get(self, path="/", **headers):
        """Ask by hand; return status, headers and text."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        connection.putrequest("GET", path, skip_host=True)
        for name, value in {"Host": f"127.0.0.1:{self.port}", **headers}.items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders()
        answer = connection.getresponse()
        text = answer.read().decode()
        connection.close()
        return answer.status, dict(answer.getheaders()), text


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    server = Server(tmp_path_factory.mktemp("explored"))
    yield server
    server.process.terminate()
    server.process.wait(20)
    server.process.stdout.close()


@pytest.fixture(scope="module")
def page(server):
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1360, "height": 1090})
        page.asked, page.said = [], []
        page.on("request", lambda request: page.asked.append(request.url))
        page.on("websocket", lambda socket: page.asked.append(socket.url))
        page.on("console", lambda message: page.said.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: page.said.append(str(error)))
        page.goto(server.url, timeout=300_000)
        text(page, r"branch 1: Branch\(omega from 0.5 to 2", 300.0)  # the first page may have to compile
        yield page
        browser.close()


def text(page, pattern, seconds=60.0):
    """Wait until the page shows a text, which bokeh keeps in shadow trees."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        shown = page.locator(".bk-Div .bk-clearfix").all_inner_texts()
        for part in shown:
            found = re.search(pattern, part)
            if found:
                return found[0]
        page.wait_for_timeout(20)
    raise AssertionError(f"the page never showed {pattern!r}: {shown}")


def figure(page, title):
    """Return the model's frame on the screen: left, top, width, height of the drawing area."""
    return page.evaluate("""(title) => {
        const views = [];
        const look = (view) => { if (view.model.type === "Figure") views.push(view); (view.child_views || []).forEach(look); };
        Object.values(Bokeh.index.roots ?? Bokeh.index).forEach(look);
        const view = views.find(v => v.model.title.text.startsWith(title));
        const box = view.el.getBoundingClientRect(), frame = view.frame.bbox;
        const x = view.model.x_range, y = view.model.y_range;
        return {left: box.left + frame.left, top: box.top + frame.top, width: frame.width, height: frame.height,
                x: [x.start, x.end], y: [y.start, y.end]};
    }""", title)


def place(frame, x, y):
    """Return screen coordinates of a point of a plot."""
    return (frame["left"] + (x - frame["x"][0]) / (frame["x"][1] - frame["x"][0]) * frame["width"],
            frame["top"] + (frame["y"][1] - y) / (frame["y"][1] - frame["y"][0]) * frame["height"])


def clicked(page, title, x, y, pattern):
    """Click at a point of a plot until the page shows a text: a click while the page is still drawn anew finds nothing there."""
    for _ in range(20):
        page.mouse.click(*place(figure(page, title), x, y))
        try:
            return text(page, pattern, 3.0)
        except AssertionError as missing:
            last = missing
    raise last


def picture(page, name):
    folder = os.environ.get("BIFURC_SCREENSHOTS")
    if folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        page.screenshot(path=str(Path(folder) / f"{name}.png"), full_page=True)


def test_a_click_shows_the_orbit_there(page):
    clicked(page, "branches", 1.3731, 1.1264, r"branch 1, row \d+ of")
    assert "impact" in text(page, r"\d\.\d+\s+impact\s+rigid_stop\s+\S+")
    assert figure(page, "period 1, 1 impact, stable")
    picture(page, "orbit")


def test_a_special_point_is_switched_at(page):
    clicked(page, "branches", 0.824134, 0.6170, r"period_doubling at 0\.82413429")
    page.get_by_role("button", name="switch here").click()
    text(page, r"branch 2: Branch\(omega from 0\.824134")
    picture(page, "switched")
    page.get_by_role("button", name="back").click()
    text(page, r"period_doubling at 0\.82413429")


def test_a_slice_is_mapped_zoomed_and_clicked(page):
    clicked(page, "branches", 1.3731, 1.1264, r"branch 1, row \d+ of")
    page.get_by_role("button", name="map here").click()
    text(page, r"of 160000")
    picture(page, "map")
    frame = figure(page, "starts, 400")
    page.mouse.move(*place(frame, -1.2, -1.0))
    for _ in range(3):
        page.mouse.wheel(0, -240)
    text(page, r"of 10000\b")
    text(page, r"of 160000")
    closer = figure(page, "starts, 400")
    assert closer["x"][1] - closer["x"][0] < 0.8 * (frame["x"][1] - frame["x"][0])
    page.wait_for_timeout(600)  # a second click at once would be a double click
    page.mouse.click(*place(closer, *(0.5 * sum(closer[axis]) for axis in "xy")))
    text(page, r"attractor \d of the basin map")
    picture(page, "zoom")


def test_a_drag_computes_the_orbit_again(page):
    before = text(page, r"omega=[\d.]+")
    handle = page.locator(".noUi-handle").bounding_box()
    page.mouse.move(handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2)
    page.mouse.down()
    for step in range(1, 9):
        page.mouse.move(handle["x"] + handle["width"] / 2 + 4 * step, handle["y"] + handle["height"] / 2)
    page.mouse.up()
    end = time.monotonic() + 30.0
    while text(page, r"omega=[\d.]+") == before:
        assert time.monotonic() < end
    text(page, r"of 160000")
    picture(page, "drag")


def test_the_page_is_saved_as_a_script_and_files(page, server):
    page.get_by_role("button", name="save").click()
    text(page, r"saved explored\.py")
    assert {"explored.py", "branches.png", "orbit.png", "basins.png"} <= {file.name for file in server.folder.iterdir()}
    assert "bf.basins_of_attraction(" in (server.folder / "explored.py").read_text()


def test_a_reload_keeps_what_is_shown_and_reset_returns(page):
    page.reload()
    text(page, r"saved explored\.py")
    page.get_by_role("button", name="reset").click()
    text(page, r"branch 1: Branch")
    assert figure(page, "starts: press")


def test_the_browser_asks_no_other_host_and_complains_about_nothing(page, server):
    assert {re.match(r"[a-z]+://[^/]+", url)[0] for url in page.asked} == {f"http://127.0.0.1:{server.port}",
                                                                          f"ws://127.0.0.1:{server.port}"}
    assert page.said == []


def test_strangers_are_refused(page, server):
    cookie = "; ".join(f"{item['name']}={item['value']}" for item in page.context.cookies())
    own = f"http://127.0.0.1:{server.port}"
    status, headers, body = server.get(Cookie=cookie)
    assert status == 200 and "Content-Security-Policy" in headers and "https://" not in body
    socket = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Version": "13", "Sec_WebSocket_Key": "x" * 22 + "=="}
    for path, wrong in (("/", {}), (f"/?token={server.token}", {}), ("/?token=x", {}), ("/static/js/bokeh.min.js", {}),
                        ("/", {"Cookie": cookie, "Host": f"localhost:{server.port}"}),
                        ("/", {"Cookie": cookie, "Host": "attacker.example"}),
                        ("/", {"Cookie": cookie, "Origin": "http://attacker.example"}),
                        ("/ws", {**socket, "Cookie": cookie}), ("/ws", {**socket, "Origin": own}),
                        ("/ws", {**socket, "Cookie": cookie, "Origin": "http://attacker.example"})):
        status, headers, body = server.get(path, **wrong)
        assert (status, body[:8]) == (403, "refused:"), (path, wrong, status)
        assert server.token not in body and "Set-Cookie" not in headers
    assert server.get("/autoload.js", Cookie=cookie)[0] == 404  # no page of others embeds this one
    status, headers, _ = server.get("/", Cookie=cookie, Origin=own)
    assert status == 200
    flags = next(value for name, value in headers.items() if name == "Set-Cookie")
    assert "HttpOnly" in flags and "SameSite=Strict" in flags
