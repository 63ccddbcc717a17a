# SPDX-License-Identifier: MIT
"""The page's server: viser behind a check of every request, the token, and no pages of other sites."""

from __future__ import annotations

import contextlib
import hmac
import logging
import re
import secrets
import socket
import threading
import weakref
from collections.abc import Callable, Iterator
from http import HTTPStatus
from typing import Any

from sdftrack._internal.closing import closed_on_error
from sdftrack._internal.extras import need
from sdftrack._internal.hosts import LOCAL, host_of, is_local, listen, origin_host, shown_name
from sdftrack._internal.validation import whole

_quiet = threading.Lock()


class PageServer:
    """A viser server at `host`, with a token unless only this computer can reach it. It has no other port."""

    # `port` is the first that is tried, 0: any free one. `url` is the address of the page with the token, `note` "" or
    # a sentence about another port than asked for. ImportError if viser is not installed, or is a version that cannot
    # be put behind the gate; OSError if `host` is no address of this computer, or no port is free.

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
        with closed_on_error(listening), _silent(), self._gate.in_front_of(inner):
            self.viser: Any = viser.ViserServer(inner, self.port, label="sdftrack", verbose=False)
        if not self._gate.serving:  # a version with a server of its own; it has not shown anything yet
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


REFUSED = "Refused: open the complete address that the program printed.\n"
LOG = logging.getLogger("sdftrack.viewer")
LOG.addHandler(logging.NullHandler())  # a port scan is no reason to print a traceback
_replacing = threading.Lock()


class Gate:
    """Has viser serve at a socket of ours, and answers each request before viser sees it."""

    # viser's server has neither an argument for a socket nor one for a check of requests, and a second server in front
    # of it would leave its port open to every program and page of this computer. websockets, on which it is built, has
    # both. The token is the first part of the path (``/TOKEN/``), which browsers send with the page's WebSocket too; a
    # cookie would be shared by all ports of a host, and be refused within the frame of a notebook. Without a token only
    # names of this computer are the host, so that a foreign name that resolves to 127.0.0.1 does not reach the page.

    def __init__(self, listening: socket.socket, token: str | None) -> None:
        self._listening, self._token = listening, token
        self._connections: weakref.WeakSet[Any] = weakref.WeakSet()
        self.serving = False

    @contextlib.contextmanager
    def in_front_of(self, host: str) -> Iterator[None]:
        """While this lasts, the server that is opened for this very string `host` is behind this gate."""
        from websockets.asyncio import server as websockets

        plain: Any = websockets.serve

        def serve(handler: Any, *place: Any, **options: Any) -> Any:
            if (place[0] if place else options.get("host")) is not host:  # a server of another thread
                return plain(handler, *place, **options)
            self.serving = True
            options = {name: value for name, value in options.items() if name not in ("host", "port")}
            options |= {
                "process_request": self._before(options.get("process_request")),
                "create_connection": self._connected,
                "logger": LOG,
            }
            return plain(handler, sock=self._listening, **options)

        with _replacing:
            websockets.serve = serve  # type: ignore[assignment, misc]
            try:
                yield
            finally:
                websockets.serve = plain  # type: ignore[misc]

    def abort(self) -> None:
        """End all connections: a viewer that is closed does not wait for a browser that does not read."""
        for connection in list(self._connections):
            connection.transport.abort()

    def _connected(self, *arguments: Any, **options: Any) -> Any:
        from websockets.asyncio.server import ServerConnection

        connection = ServerConnection(*arguments, **options)
        self._connections.add(connection)
        return connection

    def _before(self, answer: Callable[[Any, Any], Any] | None) -> Callable[[Any, Any], Any]:
        def checked(connection: Any, request: Any) -> Any:
            path = admitted(request.path, request.headers, self._token)
            if path is None:
                return connection.respond(HTTPStatus.FORBIDDEN, REFUSED)
            request.path = path
            return None if answer is None else answer(connection, request)

        return checked


def admitted(path: str, headers: Any, token: str | None) -> str | None:
    """The path of a request without the token; None: refused."""
    # `headers`: those of websockets, of which one name may have several values.
    hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
    if len(hosts) != 1 or len(origins) > 1 or not path.startswith("/"):
        return None
    if origins and origin_host(origins[0]) != hosts[0].lower():
        return None  # a page of another site, opened in the same browser
    if token is None:
        return path if host_of(hosts[0]) in LOCAL else None
    place, mark, query = path.partition("?")
    first, _, remaining = place[1:].partition("/")
    if not hmac.compare_digest(first.encode(errors="surrogateescape"), token.encode()):
        return None
    return f"/{remaining}{mark}{query}"
