# SPDX-License-Identifier: MIT
"""The page's server: viser, reached only through the gate."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import re
import secrets
import threading
from collections.abc import Iterator
from typing import Any

from sdftrack._internal.extras import need
from sdftrack._internal.hosts import bound_address, is_local, shown_name
from sdftrack._internal.validation import whole
from sdftrack.viz.viewer.gate import Gate

__all__ = ["PageServer"]

TRIED_PORTS = 100
_quiet = threading.Lock()


class PageServer:
    """A viser server at `host`, with a token unless only this computer can reach it.

    Parameters
    ----------
    host : str
    port : int
        The first port that is tried; 0: any free one.
    token : str or None
        Letters, digits, ``-`` and ``_``; None: a random one if `host` is not this computer alone.

    Attributes
    ----------
    viser : viser.ViserServer
    url : str
        Address of the page, with the token.
    note : str
        "" or a sentence about another port than asked for.

    Raises
    ------
    ImportError
        viser is not installed.
    ValueError
        A token with other characters.
    OSError
        `host` is no address of this computer, or no port is free.
    """

    def __init__(self, host: str, port: int, token: str | None) -> None:
        whole(port, "port", 0, 65535)
        if token is not None and not re.fullmatch(r"[A-Za-z0-9_-]+", token):
            raise ValueError(f"token: expected letters, digits, - and _, got {token!r}")
        if token is None and not is_local(host):
            token = secrets.token_urlsafe(16)
        viser = need("viser", "viewer")
        self.note = ""
        with _silent():
            # Its port is known to this process alone; what reaches it has passed the gate.
            self.viser: Any = viser.ViserServer("127.0.0.1", 0, label="sdftrack", verbose=False)
        self._loop: asyncio.AbstractEventLoop = self.viser.get_event_loop()
        self._gate = Gate(self.viser.get_port(), token)
        self._closed = False
        try:
            self.port = self._open(host, port)
        except BaseException:
            self.close()
            raise
        if port not in (0, self.port):
            self.note = f"port {port} is in use, the viewer is at port {self.port}"
        self.url = f"http://{shown_name(host)}:{self.port}/" + (f"{token}/" if token else "")

    def pages(self) -> int:
        """Number of open pages."""
        return len(self.viser.get_clients())

    def close(self) -> None:
        """End all connections and threads; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        self._call(self._gate.close())
        with _silent():
            self.viser.stop()

    def _open(self, host: str, port: int) -> int:
        address = bound_address(host)
        for tried in range(port, min(port + TRIED_PORTS, 65536)):
            try:
                return int(self._call(self._gate.open(address, tried)))
            except OSError as error:
                if error.errno != errno.EADDRINUSE:
                    raise OSError(
                        f"host: cannot listen at {host}:{tried}: {error.strerror or error}"
                    ) from None
        raise OSError(f"port: expected a free port from {port} on, got {TRIED_PORTS} that are in use")

    def _call(self, work: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(timeout=10)


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """viser prints its addresses, which are not those of the page, and its end; a library does not print."""
    import rich

    with _quiet:
        console = rich.get_console()
        before, console.quiet = console.quiet, True
        try:
            yield
        finally:
            console.quiet = before
