"""A page's server: on this machine only unless asked for more, and quiet."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from importlib.util import find_spec
from io import StringIO
from typing import TYPE_CHECKING

from facert.errors import FacertError, InputError

if TYPE_CHECKING:
    from viser import ViserServer

LOOPBACK = "127.0.0.1"
BRAND = (31, 111, 139)
_HIGHEST_PORT = 65535


def require_viser() -> None:
    """Check that viser is installed, before anything else is imported; FacertError if not."""
    if find_spec("viser") is None:
        raise FacertError("pages need viser: pip install 'facert[view]'")


@contextmanager
def page_server(title: str, host: str = LOOPBACK, port: int = 8080) -> Iterator[ViserServer]:
    """A server that is up while the block runs.

    Parameters
    ----------
    title : str
        Stands above the page's elements.
    host : str
    port : int
        Or the next free one; 0 for any.

    Raises
    ------
    InputError
        For a host that is not one of this machine's addresses.
    """
    import viser

    _require_address(host, port)
    with redirect_stdout(StringIO()):  # viser introduces itself there
        server = viser.ViserServer(host=host, port=port, label=title, verbose=False)
    server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=BRAND)
    try:
        yield server
    finally:
        with redirect_stdout(StringIO()):
            server.stop()


def address(server: ViserServer) -> str:
    """The address to open in a browser."""
    host = server.get_host()
    shown = "localhost" if host in ("0.0.0.0", "::") else f"[{host}]" if ":" in host else host
    return f"http://{shown}:{server.get_port()}"


def show_errors(server: ViserServer) -> Callable[[str], None]:
    """A function that shows a line about an error to every visitor."""

    def show(text: str) -> None:
        for client in server.get_clients().values():
            client.add_notification("This did not work", text, color="red")

    return show


def _require_address(host: str, port: int) -> None:
    """Check host and port: the server would try wrong ones again and again."""
    if not 0 <= port <= _HIGHEST_PORT:
        raise InputError("--port", f"0 to {_HIGHEST_PORT}", f"{port}", "Choose another.")
    try:
        family, kind, protocol, _, where = socket.getaddrinfo(
            host, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        with socket.socket(family, kind, protocol) as trial:
            trial.bind(where)
    except OSError as error:
        expected, found = "an address of this machine", f"{host!r} ({error.strerror})"
        raise InputError("--host", expected, found, f"Give {LOOPBACK}, say.") from None
