"""Who may use a page, and what a visitor may ask for: no other web site, and nothing else.

viser serves whoever asks. Any web site that a person has open can ask a server on his machine, so
each request is checked before viser sees it: by the address that it was made to (a site whose name
points to this machine makes another), by the page that made it, and, where the page is open to
other machines, by a token that only its printed address holds. What arrives over the socket is
checked message by message.
"""

from __future__ import annotations

import hmac
import http
import ipaddress
import logging
import secrets
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import SplitResult, parse_qs, urlsplit

import websockets.asyncio.server as sockets
from websockets.datastructures import Headers
from websockets.http11 import Request, Response
from websockets.protocol import State

from facert.pages.messages import Accepts, is_wanted

MOST_BYTES = 2**16
"""Of a message: the largest that a page sends, where its camera stands, has 300."""
MOST_CLIENTS = 16
"""Pages that are open at a time."""
_PLAIN = 80  # the port that an address leaves out
_PROTOCOL = "viser-v"
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:; worker-src blob:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; "
    "connect-src 'self' {socket} data: blob:; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
_HEADERS = {
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}

log = logging.getLogger("facert")

Answer = Callable[[sockets.ServerConnection, Request], Response | None]


class Guard:
    """Decides on every request to a page, and on every message.

    Parameters
    ----------
    host : str
        Where the page listens: its name, as it was given.
    address : str
        The same in numbers.
    """

    def __init__(self, host: str, address: str) -> None:
        self.local = ipaddress.ip_address(address.partition("%")[0]).is_loopback
        self._names = {host.lower(), *(("localhost",) if self.local else _own_names())}
        self.token = "" if self.local else secrets.token_urlsafe(16)
        """What the address holds beside host and port; empty where only this machine can ask."""
        self.accepts: Accepts = lambda _uuid, _value: False
        """Whether a part of the page takes a value; none does before there is a page."""

    def refusal(self, connection: sockets.ServerConnection, request: Request) -> Response | None:
        """The answer to a request that viser is not to see; None for one that it may."""
        port = int(connection.local_address[1])
        asked = urlsplit(request.path)
        if not self._is_own(request.headers, port):
            return _refused(http.HTTPStatus.FORBIDDEN, "Open the address that facert printed.")
        if not self._knows_token(request.headers, asked, port):
            return _refused(http.HTTPStatus.FORBIDDEN, "Open the whole address, with its token.")
        if _is_socket(request):
            return _refused_socket(connection, request)
        # A page that is told by its address to talk to another server would run what that sends.
        return self._without_query(asked, port) if asked.query else None

    def _is_own(self, headers: Headers, port: int) -> bool:
        """Whether a request is made to the page's address, and by no other page."""
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            return False
        asked = _split(f"http://{hosts[0]}")
        if asked is None or (asked.port or _PLAIN) != port or not self._is_name(asked.hostname):
            return False
        if not origins:  # only programs open a socket without, and the page is for a browser
            return "Upgrade" not in headers
        return origins[0].lower() == f"http://{hosts[0]}".lower()

    def _is_name(self, name: str | None) -> bool:
        """Whether a name is this page's: no web site can have numbers for its name."""
        if not name:
            return False
        try:
            address = ipaddress.ip_address(name)
        except ValueError:
            return name.lower() in self._names
        return address.is_loopback if self.local else True

    def _knows_token(self, headers: Headers, asked: SplitResult, port: int) -> bool:
        given = [*_cookies(headers, port), *parse_qs(asked.query).get("token", [])]
        known = [hmac.compare_digest(one.encode(), self.token.encode()) for one in given]
        return not self.token or any(known)

    def _without_query(self, asked: SplitResult, port: int) -> Response:
        """Go to the page without what follows its address; a cookie holds the token from now on."""
        headers = Headers(Location="/", **{"Content-Length": "0"})
        if self.token and "token" in parse_qs(asked.query):
            kept = f"{_cookie(port)}={self.token}; Path=/; HttpOnly; SameSite=Lax"
            headers["Set-Cookie"] = kept
        return Response(303, "See Other", headers)


class CheckedConnection(sockets.ServerConnection):
    """A socket on which only such messages arrive as a page sends; subclasses name the page."""

    page: Guard

    async def recv(self, decode: bool | None = None) -> Any:
        """The next message that is wanted; others are dropped."""
        while True:
            message = await super().recv(decode)
            if isinstance(message, bytes) and is_wanted(message, self.page.accepts):
                return message
            log.debug("a page's visitor sent what no page sends")


@contextmanager
def guarding(guard: Guard) -> Iterator[Callable[[], bool]]:
    """Have every server of sockets that is started inside ask the guard.

    viser has no hook of its own, so its way to start a server is replaced for a moment. Yields
    whether that was used: a viser that starts its server otherwise is not guarded.
    """
    used: list[bool] = []
    original = sockets.serve

    def serve(handler: Any, *where: Any, process_request: Answer, **options: Any) -> sockets.serve:
        used.append(True)
        options |= {"max_size": MOST_BYTES, "logger": _logger(), "process_response": _secure}

        class Connection(CheckedConnection):
            """A connection of this guard's page."""

            page = guard

        def answer(asked: sockets.ServerConnection, request: Request) -> Response | None:
            return guard.refusal(asked, request) or process_request(asked, request)

        return original(
            handler, *where, process_request=answer, create_connection=Connection, **options
        )

    sockets.serve = serve  # type: ignore[assignment, misc]
    try:
        yield lambda: bool(used)
    finally:
        sockets.serve = original  # type: ignore[misc]


def _secure(_: sockets.ServerConnection, request: Request, response: Response) -> None:
    """Add what a browser should keep to: no frame around the page, no word of it to others."""
    hosts = request.headers.get_all("Host")
    host = hosts[0] if response.status_code == http.HTTPStatus.OK else ""
    policy = _POLICY.format(socket=f"ws://{host}" if host else "")
    for name, value in (*_HEADERS.items(), ("Content-Security-Policy", policy)):
        if name in response.headers:
            del response.headers[name]
        response.headers[name] = value


def _refused(status: http.HTTPStatus, text: str) -> Response:
    body = f"{text}\n".encode()
    headers = Headers(
        **{"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body))}
    )
    return Response(status.value, status.phrase, headers, body)


def _refused_socket(connection: sockets.ServerConnection, request: Request) -> Response | None:
    """Refuse one client too many, and what viser would print as it came."""
    spoken = ",".join(request.headers.get_all("Sec-WebSocket-Protocol"))
    version = spoken.strip().removeprefix(_PROTOCOL)
    if version == spoken.strip() or not version.replace(".", "").isalnum():
        return _refused(http.HTTPStatus.BAD_REQUEST, "Open the page in a browser.")
    there = list(connection.server.handlers)
    if sum(one.protocol.state is State.OPEN for one in there) >= MOST_CLIENTS:
        return _refused(http.HTTPStatus.SERVICE_UNAVAILABLE, "The page is open too often.")
    return None


def _is_socket(request: Request) -> bool:
    return "Upgrade" in request.headers


def _split(address: str) -> SplitResult | None:
    """The parts of an address; None for one that is none, or has more than host and port."""
    try:
        parts = urlsplit(address)
        plain = parts.port is None or parts.port > 0
    except ValueError:
        return None
    return parts if plain and parts.netloc == address[7:] and "@" not in address else None


def _cookie(port: int) -> str:
    """The name of the cookie that holds the token: of several pages each has its own."""
    return f"facert-{port}"


def _cookies(headers: Headers, port: int) -> list[str]:
    """The values of the page's cookie in a request."""
    pairs = ";".join(headers.get_all("Cookie")).split(";")
    return [pair.partition("=")[2] for pair in map(str.strip, pairs) if _names(pair, port)]


def _names(pair: str, port: int) -> bool:
    return pair.partition("=")[0] == _cookie(port)


def _own_names() -> set[str]:
    """The names of this machine."""
    name = socket.gethostname().lower()
    return {"localhost", name, f"{name}.local", socket.getfqdn().lower()}


def _logger() -> logging.Logger:
    """Where the sockets log: what fails, as a detail; never a request, which may hold a token."""
    logger = logging.getLogger("facert.sockets")
    if not logger.handlers:
        logger.setLevel(logging.ERROR)
        logger.propagate = False
        logger.addHandler(_AsDetail())
    return logger


class _AsDetail(logging.Handler):
    """Shows records in a line, among the details."""

    def emit(self, record: logging.LogRecord) -> None:
        error = record.exc_info[1] if record.exc_info else None
        log.debug("a page's socket: %s%s", record.getMessage(), f": {error}" if error else "")
