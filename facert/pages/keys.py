"""Keys of a page: viser's commands, which its palette (Ctrl-K) lists as well."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viser import ViserServer
    from viser._messages import HotkeyKey, KeyModifier

    from facert.pages.worker import PlayedPage

FAR = 10  # frames, with Shift

# The element that was clicked last would keep the keys: a slider takes arrows, a button the space
# bar. So it lets go of them, but for a field that is typed in, until Enter. An element that was
# reached by Tab keeps its keys. viser turns the camera with arrows by a listener on the document,
# behind that of its commands: they end before it.
_SCRIPT = """
(() => {
  if (window.facertKeys) return;
  window.facertKeys = true;
  const typed = (e) => e.matches('input, textarea');
  const page = document.documentElement;
  document.addEventListener('pointerup', (event) => {
    const chosen = event.target.closest('[role=option]');  // its list takes the focus once more
    const release = () => {
      const e = document.activeElement;
      if (e && (chosen || !typed(e))) e.blur();
    };
    setTimeout(release);
    if (chosen) setTimeout(release, 300);
  });
  document.body.addEventListener('keydown', (event) => {
    if (event.key === 'Enter' && typed(event.target)) setTimeout(() => event.target.blur());
    const focused = event.target.closest('button, [role=slider], [role=tab]');
    if (focused && (event.key === ' ' || event.key.startsWith('Arrow'))) event.stopPropagation();
  });
  page.addEventListener('keydown', (event) => {
    if (event.key.startsWith('Arrow')) event.stopPropagation();
  });
})()
"""
_PIXEL = "data:image/gif;base64,R0lGODlhAQABAAAAACH5BAEKAAEALAAAAAABAAEAAAICTAEAOw=="


def add_key(
    server: ViserServer,
    label: str,
    key: HotkeyKey,
    pressed: Callable[[], None],
    modifier: KeyModifier | None = None,
) -> None:
    """Let a key do something, and list it in the palette."""
    command = server.gui.add_command(label, hotkey=key, modifier=modifier)
    command.on_trigger(lambda _: pressed())


def add_play_keys(server: ViserServer, page: PlayedPage) -> None:
    """Arrows for frames, with Shift for ten, and the space bar to play; once a page."""
    server.gui.add_html(f'<img alt="" hidden src="{_PIXEL}" onload="{escape(_SCRIPT)}">')
    add_key(server, "Play or pause", "space", page.toggle)
    steps: tuple[tuple[str, HotkeyKey, int, KeyModifier | None], ...] = (
        ("Next frame", "arrowright", 1, None),
        ("Frame before", "arrowleft", -1, None),
        (f"{FAR} frames on", "arrowright", FAR, "shift"),
        (f"{FAR} frames back", "arrowleft", -FAR, "shift"),
    )
    for label, key, frames, modifier in steps:
        add_key(server, label, key, partial(page.step, frames), modifier)
