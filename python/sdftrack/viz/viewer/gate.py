# SPDX-License-Identifier: MIT
"""The door of the page's server: refuses connections without the token, and those of other sites' pages."""

from __future__ import annotations

import asyncio
import hmac
from urllib.parse import urlsplit

from sdftrack._internal.hosts import LOCAL

__all__ = ["Gate"]

MAX_HEAD = 1 << 16  # bytes of a request's head
HEAD_S = 10.0  # a connection that sends no request is closed
PIECE = 1 << 16
REFUSED = b"Refused: open the complete address that the program printed.\n"


class Gate:
    """Passes HTTP and WebSocket connections on to a server at 127.0.0.1:`inner_port`.

    The token is the first part of the path (``/TOKEN/``), which browsers send with the page's WebSocket too; a cookie
    would be shared by all ports of a host, and be refused within the frame of a notebook.
    All methods run in one event loop.

    Parameters
    ----------
    inner_port : int
    token : str or None
        None: no token, and only names of this computer as the host, so that a foreign name that resolves to 127.0.0.1
        does not reach the page.
    """

    def __init__(self, inner_port: int, token: str | None) -> None:
        self._inner_port, self._token = inner_port, token
        self._tasks: set[asyncio.Task[None]] = set()
        self._server: asyncio.Server | None = None

    async def open(self, host: str, port: int) -> int:
        """Listen; returns the port (a free one for 0). OSError where that is not possible."""
        self._server = await asyncio.start_server(self._connected, host, port, limit=MAX_HEAD)
        return int(self._server.sockets[0].getsockname()[1])

    async def close(self) -> None:
        """Stop listening and end all connections."""
        if self._server is not None:
            self._server.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        try:
            await self._serve(reader, writer)
        except (OSError, EOFError, TimeoutError, asyncio.LimitOverrunError):
            pass  # the other side went away, or sent no request
        except asyncio.CancelledError:
            writer.transport.abort()  # the viewer is closed: nothing waits for a browser that does not read
        finally:
            self._tasks.discard(task)
            writer.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = (await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), HEAD_S)).decode("latin-1")
        passed = admitted(head, self._token)
        if passed is None:
            writer.write(
                b"HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain\r\nConnection: close\r\n"
                + b"Content-Length: %d\r\n\r\n" % len(REFUSED)
                + REFUSED
            )
            await writer.drain()
            return
        inner_reader, inner_writer = await asyncio.open_connection("127.0.0.1", self._inner_port)
        try:
            inner_writer.write(passed.encode("latin-1"))
            there = asyncio.create_task(_pump(reader, inner_writer))
            back = asyncio.create_task(_pump(inner_reader, writer))
            try:
                await asyncio.wait((there, back), return_when=asyncio.FIRST_COMPLETED)
            finally:
                there.cancel()
                back.cancel()
                await asyncio.gather(there, back, return_exceptions=True)
        finally:
            inner_writer.close()


async def _pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while piece := await reader.read(PIECE):
        writer.write(piece)
        await writer.drain()  # a slow browser slows the server's sending, not this program


def admitted(head: str, token: str | None) -> str | None:
    """The head of an HTTP request as it is passed on, without the token; None: refused.

    >>> admitted("GET /abc/ HTTP/1.1\\r\\nHost: pc:8080\\r\\n\\r\\n", "abc")
    'GET / HTTP/1.1\\r\\nHost: pc:8080\\r\\n\\r\\n'
    >>> admitted("GET /?token=abc HTTP/1.1\\r\\nHost: pc:8080\\r\\n\\r\\n", "abc") is None
    True
    """
    line, _, rest = head.partition("\r\n")
    words = line.split(" ")
    if len(words) != 3 or not words[1].startswith("/"):
        return None
    method, target, version = words
    fields = dict(part.partition(":")[::2] for part in rest.split("\r\n") if ":" in part)
    headers = {name.strip().lower(): value.strip() for name, value in fields.items()}
    host = headers.get("host", "")
    origin = headers.get("origin")
    if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
        return None  # a page of another site, opened in the same browser
    if token is None:
        return head if _hostname(host) in LOCAL else None
    path, mark, query = target.partition("?")
    first, _, remaining = path[1:].partition("/")
    if not hmac.compare_digest(first.encode("latin-1"), token.encode("latin-1")):
        return None
    return f"{method} /{remaining}{mark}{query} {version}\r\n{rest}"


def _hostname(host: str) -> str | None:
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:
        return None
