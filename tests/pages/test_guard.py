"""A page answers its own visitors, and no other web site, whatever that sends."""

from __future__ import annotations

import asyncio
import http.client
from collections.abc import Coroutine, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from typing import NamedTuple, TypeVar
from urllib.parse import quote, urlsplit

import msgspec
import pytest

pytest.importorskip("viser", reason="viser is not installed: pip install 'facert[view]'")

import viser
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus
from websockets.frames import CloseCode

from facert.errors import FacertError
from facert.pages import guard
from facert.pages.server import address, page_server

Outcome = TypeVar("Outcome")
PROTOCOL = f"viser-v{viser.__version__}"


@pytest.fixture(scope="module")
def served() -> Iterator[tuple]:
    """A page with a part of each kind; what it was given is kept."""
    with page_server("\x1b[31m<b>take</b>\ud800.h5", port=0) as server:
        seen: list[object] = []
        slider = server.gui.add_slider("jaw", 0.0, 1.0, 0.01, 0.0)
        choice = server.gui.add_dropdown("take", ("a", "b"))
        save = server.gui.add_button("Save")
        hidden = server.gui.add_button("Train", visible=False)
        for part in (slider, choice):
            part.on_update(lambda event: seen.append(event.target.value))
        for button in (save, hidden):
            button.on_click(lambda event: seen.append(event.target.label))
        parts = {"slider": slider, "choice": choice, "save": save, "hidden": hidden}
        yield server, parts, seen


def run(work: Coroutine[object, object, Outcome]) -> Outcome:
    """What some work comes to, in a thread: Playwright keeps the loop of this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()


class Found(NamedTuple):
    status: int
    headers: Mapping[str, str]
    body: bytes


def get(where: str, path: str = "/", **headers: str) -> Found:
    at = urlsplit(where)
    with closing(http.client.HTTPConnection(at.hostname, at.port, timeout=5)) as connection:
        connection.request("GET", quote(path, "/?=&%"), headers={"Host": at.netloc, **headers})
        found = connection.getresponse()
        return Found(found.status, found.headers, found.read())


def opens(where: str, origin: str | None, host: str | None = None, cookie: str = "") -> bool:
    """Whether a socket is opened from a page."""

    async def attempt() -> None:
        at = urlsplit(where)
        headers = {"Cookie": cookie} if cookie else {}
        uri = f"ws://{host or at.netloc}/" + (f"?{at.query}" if at.query else "")
        async with connect(
            uri, origin=origin, host=at.hostname, port=at.port, additional_headers=headers,
            subprotocols=[PROTOCOL], proxy=None,
        ) as ours:  # fmt: skip
            await ours.recv()

    try:
        run(attempt())
    except InvalidStatus as error:
        return error.response.status_code != 403
    return True


FOREIGN = [
    "http://evil.example", "https://evil.example", "null", "http://localhost:{other}",
    "http://evil.example:{port}", "https://localhost:{port}", "http://127.0.0.1:{port}",
    "http://localhost.evil.example:{port}", "http://localhost:{port}/", "file://", None,
]  # fmt: skip


@pytest.mark.parametrize("origin", FOREIGN)
def test_a_socket_is_opened_by_the_page_alone(served, origin: str | None) -> None:
    port = served[0].get_port()
    given = origin and origin.format(port=port, other=port + 1)
    assert not opens(f"http://localhost:{port}", given)
    assert opens(f"http://localhost:{port}", f"http://localhost:{port}")


HOSTS = [
    "evil.example:{port}", "localhost", "localhost:1", "192.168.1.7:{port}", "a@localhost:{port}",
    "localhost:{port}.evil.example", "[::1", "", "0.0.0.0:{port}", "localhost:{port}/x",
]  # fmt: skip


@pytest.mark.parametrize("host", HOSTS)
def test_a_name_that_was_pointed_here_is_refused(served, host: str) -> None:
    where = address(served[0])
    found = get(where, Host=host.format(port=served[0].get_port()))
    assert found.status in (400, 403)
    assert b"<" not in found.body


def test_the_page_stands_in_no_frame_and_asks_no_other_server(served) -> None:
    where = address(served[0])
    page = get(where)
    assert page.status == 200
    policy = page.headers["Content-Security-Policy"]
    assert "frame-ancestors 'none'" in policy
    assert f"connect-src 'self' ws://{urlsplit(where).netloc} " in policy
    assert page.headers["X-Frame-Options"] == "DENY"
    assert page.headers["Referrer-Policy"] == "no-referrer"
    assert get(where, Origin="http://evil.example").status == 403
    led = get(where, "/?websocket=ws://evil.example")
    assert (led.status, led.headers["Location"]) == (303, "/")
    assert get(where, "/%2e%2e/%2e%2e/index.html").status == 404


def sent(server, *messages: object) -> int | None:
    """Send messages over the page's own socket until they are handled; why it ended, if it did."""
    where = address(server)

    async def send() -> int | None:
        netloc = urlsplit(where).netloc
        origin, spoken = f"http://{netloc}", [PROTOCOL]
        async with connect(
            f"ws://{netloc}", origin=origin, subprotocols=spoken, max_size=None, proxy=None
        ) as ours:
            camera = {
                "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [0, 0, 1],
                "fov": 1, "near": 1, "far": 2, "image_height": 600, "image_width": 800,
                "look_at": [0, 0, 0], "up_direction": [0, 1, 0],
            }  # fmt: skip
            for message in (camera, *messages):
                packed = isinstance(message, (str, bytes))
                await ours.send(message if packed else msgspec.msgpack.encode(message))
            await asyncio.sleep(0.15)
            return ours.close_code

    return run(send())


def update(part: object, **updates: object) -> dict[str, object]:
    return {"type": "GuiUpdateMessage", "uuid": part._impl.uuid, "updates": updates}


def test_what_the_page_sends_is_taken_and_nothing_else(served, capfd) -> None:
    server, parts, seen = served
    slider, choice, save, hidden = parts.values()
    seen.clear()
    deep: object = 0.1
    for _ in range(5000):
        deep = [deep]
    sent(
        server,
        *(update(slider, value=value) for value in ("x", True, None, [1], 7.0, -1e300)),
        *(update(slider, value=value) for value in (float("nan"), float("inf"), {"a": 1})),
        *(update(choice, value=value) for value in ("c", "../../etc/passwd", 3, ["a"])),
        update(hidden, value=True),
        update(save, value="x"),
        update(save, label="<script>", value=True),
        update(slider, max=9.0),
        update(slider, update_cb=[]),
        {"type": "ShareUrlRequest"},
        {"type": "FileTransferStartUpload", "source_component_uuid": "x", "transfer_uuid": "x",
         "filename": "../x", "mime_type": "", "part_count": 1, "size_bytes": 1},
        {"type": "RunJavascriptMessage", "source": "alert(1)"},
        {"type": "Unheard"}, {}, [], 3, b"", b"\xc1", b"\x91" * 9000, "text",
        update(slider, value=0.5), update(choice, value="b"), update(save, value=True),
    )  # fmt: skip
    assert sorted(map(str, seen)) == ["0.5", "Save", "b"]
    assert (slider.max, save.label) == (1.0, "Save")
    assert server._share_tunnel is None
    assert capfd.readouterr() == ("", "")


def test_a_large_message_ends_its_socket_and_no_other(served) -> None:
    server, parts, seen = served
    seen.clear()
    assert sent(server, b"\x00" * (guard.MOST_BYTES + 1)) == CloseCode.MESSAGE_TOO_BIG
    assert sent(server, update(parts["save"], value=True)) is None
    assert seen == ["Save"]


def test_so_many_visitors_and_no_more(served, monkeypatch) -> None:
    server, _, _ = served
    monkeypatch.setattr(guard, "MOST_CLIENTS", 2)
    where = address(server)
    netloc = urlsplit(where).netloc

    async def visit(count: int) -> int:
        origin = f"http://{netloc}"
        try:
            async with connect(
                f"ws://{netloc}", origin=origin, subprotocols=[PROTOCOL], proxy=None
            ):
                return await visit(count + 1)
        except InvalidStatus as error:
            return count if error.response.status_code == 503 else -1

    assert run(visit(0)) == 2


def test_what_a_visitor_says_of_himself_is_not_printed(served, capfd) -> None:
    where = address(served[0])
    headers = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}
    headers["Sec-WebSocket-Key"] = "x3JJHMbDL1EzLkh9GBhXDw=="
    headers["Origin"] = where
    for spoken in ("viser-v[/bold]", "viser-v1.1.1,viser-v%x", "other", "viser-v"):
        assert get(where, **headers, **{"Sec-WebSocket-Protocol": spoken}).status == 400
    assert capfd.readouterr() == ("", "")


@pytest.fixture(scope="module")
def open_page() -> Iterator:
    with page_server("take.h5", "0.0.0.0", 0) as server:
        yield server


def test_a_page_for_other_machines_asks_for_its_token(open_page, caplog) -> None:
    where = address(open_page)
    bare, port = where.partition("/?")[0], open_page.get_port()
    token = where.partition("token=")[2]
    cookie = f"facert-{port}={token}"
    assert len(token) > 20
    assert get(bare).status == get(bare, "/?token=").status == 403
    assert get(bare, f"/?token={token[:-1]}").status == get(bare, "/?token=é").status == 403
    assert get(bare, Cookie=cookie + "x").status == 403
    found = get(bare, f"/?token={token}")
    assert (found.status, found.headers["Location"]) == (303, "/")
    assert found.headers["Set-Cookie"].startswith(f"{cookie}; ")
    assert "HttpOnly" in found.headers["Set-Cookie"]
    assert get(bare, Cookie=f"a=b; {cookie}").status == 200
    assert not opens(bare, bare)
    assert not opens(bare, bare, cookie=cookie[:-1])
    assert not opens(bare, "http://evil.example", cookie=cookie)
    assert opens(bare, bare, cookie=cookie)
    assert get(bare, Cookie=cookie, Host=f"evil.example:{port}").status == 403
    assert get(bare, Cookie=cookie, Host=f"192.168.1.7:{port}").status == 200
    assert token not in caplog.text


def test_a_viser_that_starts_its_server_otherwise_serves_nothing(monkeypatch) -> None:
    @contextmanager
    def unheeded(_: object) -> Iterator:
        yield lambda: False

    monkeypatch.setattr(guard, "guarding", unheeded)
    with pytest.raises(FacertError, match="cannot be kept from"), page_server("take.h5", port=0):
        raise AssertionError


FOREIGN_SITE = """
<iframe src="http://{netloc}/"></iframe><script>
  window.found = [];
  const socket = new WebSocket("ws://{netloc}/", ["{spoken}"]);
  socket.onopen = () => found.push("open");
  socket.onerror = () => found.push("refused");
  socket.onmessage = () => found.push("read");
  fetch("http://{netloc}/").then(() => found.push("fetched"), () => found.push("no answer"));
</script>"""
LED_ASTRAY = """new Promise((resolve) => {
  document.addEventListener("securitypolicyviolation", (event) => resolve(event.blockedURI));
  new WebSocket("ws://127.0.0.1:9");
})"""


@pytest.fixture
def browser_page(_browser):
    context = _browser.new_context(viewport={"width": 320, "height": 240})
    yield context.new_page()
    context.close()


@pytest.mark.slow
def test_a_foreign_site_in_the_same_browser_gets_nothing(served, browser_page) -> None:
    netloc = urlsplit(address(served[0])).netloc
    site = FOREIGN_SITE.format(netloc=netloc, spoken=PROTOCOL)
    answer = {"body": site, "content_type": "text/html"}
    browser_page.route("http://evil.example/", lambda route: route.fulfill(**answer))
    browser_page.goto("http://evil.example/")
    browser_page.wait_for_function("found.length > 1")
    assert sorted(browser_page.evaluate("found")) == ["no answer", "refused"]
    assert browser_page.frames[1].url.startswith("chrome-error:")


@pytest.mark.slow
def test_a_browser_opens_a_page_by_its_token_and_keeps_it(open_page, browser_page) -> None:
    where = address(open_page)
    bare, _, token = where.partition("?token=")
    saved = open_page.gui.add_button("Keep it")
    clicked: list[object] = []
    saved.on_click(lambda event: clicked.append(event.target))

    def saves() -> bool:
        """Whether the page is there, and its button works."""
        before = len(clicked)
        button = browser_page.locator("button", has_text="Keep it").first
        for _ in range(50):
            browser_page.screenshot()  # viser counts a visitor from his first picture on
            button.dispatch_event("click")
            browser_page.wait_for_timeout(100)
            if len(clicked) > before:
                return True
        return False

    for way in (where, bare):
        browser_page.goto(way)
        assert saves()
        assert token not in browser_page.url + browser_page.content()
        assert browser_page.evaluate("document.referrer + document.cookie") == ""
    browser_page.goto(f"{bare}?websocket=ws://127.0.0.1:9")
    assert saves()
    assert browser_page.evaluate(LED_ASTRAY).startswith("ws://127.0.0.1:9")
