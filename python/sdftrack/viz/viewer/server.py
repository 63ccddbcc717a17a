# SPDX-License-Identifier: MIT
"""The page's server: viser behind the gate."""

from __future__ import annotations

import contextlib
import re
import secrets
import threading
from collections.abc import Iterator
from typing import Any

from sdftrack._internal.extras import need
from sdftrack._internal.hosts import is_local, listen, shown_name
from sdftrack._internal.validation import whole
from sdftrack.viz.viewer.gate import Gate

__all__ = ["PageServer"]

_quiet = threading.Lock()


class PageServer:
    """A viser server at `host`, with a token unless only this computer can reach it. It has no other port.

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
        viser is not installed, or is a version that cannot be put behind the gate.
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
        listening = listen(host, port, f"host and port: http://{shown_name(host)}:{port}")
        self.port = int(listening.getsockname()[1])
        self._gate = Gate(listening, token)
        self._closed = False
        inner = "".join(["127.0.0.", "1"])  # a string of our own: the gate knows viser's call by it
        try:
            with _silent(), self._gate.in_front_of(inner):
                self.viser: Any = viser.ViserServer(inner, self.port, label="sdftrack", verbose=False)
        except BaseException:
            listening.close()
            raise
        if (
            not self._gate.serving
        ):  # another version has opened a server of its own; it has not shown anything yet
            self.close()
            listening.close()
            raise ImportError(
                f"viser: {viser.__version__} does not work with sdftrack; pip install 'viser==1.1.1'"
            )
        self.note = (
            "" if port in (0, self.port) else f"port {port} is in use, the viewer is at port {self.port}"
        )
        self.url = f"http://{shown_name(host)}:{self.port}/" + (f"{token}/" if token else "")

    def pages(self) -> int:
        """Number of open pages."""
        return len(self.viser.get_clients())

    def close(self) -> None:
        """End all connections and threads; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        with contextlib.suppress(RuntimeError):  # its loop has ended
            self.viser.get_event_loop().call_soon_threadsafe(self._gate.abort)
        with _silent():
            self.viser.stop()


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
