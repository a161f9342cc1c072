"""A page's server: on this machine only unless asked for more, guarded, and quiet."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from importlib.util import find_spec
from io import StringIO
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from facert.errors import FacertError, InputError, escaped

if TYPE_CHECKING:
    from viser import ViserServer

    from facert.pages.guard import Guard

LOOPBACK = "127.0.0.1"
BRAND = (31, 111, 139)
_HIGHEST_PORT = 65535
_TOKENS: WeakKeyDictionary[ViserServer, str] = WeakKeyDictionary()


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
    FacertError
        For a version of viser that cannot be guarded.
    """
    from facert.pages.guard import Guard

    guard = Guard(host, _require_address(host, port))
    with redirect_stdout(StringIO()):  # viser introduces itself there
        server = _guarded_server(guard, title, host, port)
    server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=BRAND)
    try:
        yield server
    finally:
        with redirect_stdout(StringIO()):
            server.stop()


def _guarded_server(guard: Guard, title: str, host: str, port: int) -> ViserServer:
    """A server that asks the guard; FacertError for a viser that cannot be made to."""
    import viser

    from facert.pages.guard import guarding
    from facert.pages.messages import accepting

    with guarding(guard) as is_used:
        server = viser.ViserServer(host=host, port=port, label=escaped(title), verbose=False)
    try:
        if not is_used():
            raise AttributeError
        guard.accepts = accepting(server)
    except AttributeError:
        server.stop()
        text = "this version of viser cannot be kept from answering other web sites"
        raise FacertError(f"{text} ({viser.__version__}): pip install viser==1.1.1") from None
    _TOKENS[server] = guard.token
    return server


def address(server: ViserServer) -> str:
    """The address to open in a browser, with its token where it has one."""
    host, token = server.get_host(), _TOKENS.get(server, "")
    shown = "localhost" if host in ("0.0.0.0", "::") else f"[{host}]" if ":" in host else host
    return f"http://{shown}:{server.get_port()}" + (f"/?token={token}" if token else "")


def show_errors(server: ViserServer) -> Callable[[str], None]:
    """A function that shows a line about an error to every visitor."""

    def show(text: str) -> None:
        for client in server.get_clients().values():
            client.add_notification("This did not work", escaped(text), color="red")

    return show


def _require_address(host: str, port: int) -> str:
    """Check host and port, as the server would try wrong ones again and again; return numbers."""
    if not 0 <= port <= _HIGHEST_PORT:
        raise InputError("--port", f"0 to {_HIGHEST_PORT}", f"{port}", "Choose another.")
    try:
        family, kind, protocol, _, where = socket.getaddrinfo(
            host, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        with socket.socket(family, kind, protocol) as trial:
            trial.bind(where)
            return str(where[0])
    except OSError as error:
        expected, found = "an address of this machine", f"{host!r} ({error.strerror})"
        raise InputError("--host", expected, found, f"Give {LOOPBACK}, say.") from None
