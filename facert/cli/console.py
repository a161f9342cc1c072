"""What every command says and how: results on stdout, everything else on stderr."""

from __future__ import annotations

import logging

from rich.console import Console
from rich.logging import RichHandler

# Rich honours NO_COLOR and drops styles when the stream is not a terminal.
out = Console(soft_wrap=True, highlight=False)
err = Console(stderr=True, soft_wrap=True, highlight=False)

log = logging.getLogger("facert")


def configure(quiet: bool, verbose: bool) -> None:
    """Send the package's log to stderr: warnings only, notes (default) or details."""
    level = logging.WARNING if quiet else logging.DEBUG if verbose else logging.INFO
    handler = RichHandler(console=err, show_time=False, show_path=False, show_level=False)
    log.handlers[:] = [handler]
    log.setLevel(level)
