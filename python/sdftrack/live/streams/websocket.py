# SPDX-License-Identifier: MIT
"""``ws://HOST:PORT``: a websocket server that sends one JSON message per frame to every client."""

from __future__ import annotations

import asyncio
import json
import logging
import secrets
import socket
import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs

from sdftrack._internal.closing import closed_on_error
from sdftrack._internal.extras import need
from sdftrack._internal.hosts import LOCAL, host_of, is_local, listen, origin_host, shown_name
from sdftrack.camera import Camera
from sdftrack.live.streams.messages import frame_message
from sdftrack.live.streams.stream import PORT, Packet, Receiver, host_and_port, register_stream

# Bytes that the operating system keeps for a client that does not read: seconds of stale poses with its default.
SEND_BUFFER = 1 << 16
CLIENT_WAITING = 8  # messages for one client; the newest are kept
CLOSE_S = 1.0  # for the last messages, and again for the farewell
LARGEST_REQUEST = 4096  # bytes; what clients say is read, so that pings are answered, and ignored
LOG = logging.getLogger("sdftrack.live.streams")
LOG.addHandler(logging.NullHandler())  # a port scan is no reason to print a traceback


@dataclass(frozen=True)
class Admission:
    """Who may connect: local programs and pages, and from elsewhere those that know the token (``?token=...``).
    `origins` are those of web pages that a local server admits beside those of this computer. A browser lets any page
    connect to localhost, so the server has to look where a page is from."""

    token: str = ""
    origins: tuple[str, ...] = ()

    def address(self, host: str, port: int) -> str:
        return f"ws://{shown_name(host)}:{port}" + (f"/?token={self.token}" if self.token else "")

    def refusal(self, path: str, hosts: Sequence[str], origins: Sequence[str]) -> str:
        """ "" for a client that is admitted, else what it should change. `hosts`, `origins`: values of these headers,
        one of the former and at most one of the latter."""
        if self.token:
            given = parse_qs(path.partition("?")[2]).get("token", [""])[0]
            right = secrets.compare_digest(given.encode(errors="surrogateescape"), self.token.encode())
            told = "expected ?token=... in the URL, as the program that streams has shown it\n"
            return "" if right else told
        if len(hosts) != 1 or host_of(hosts[0]) not in LOCAL:
            return "expected localhost as the host of the URL\n"  # a foreign name may resolve to 127.0.0.1
        if all(o in self.origins or host_of(origin_host(o) or "") in LOCAL for o in origins):
            return ""
        return f"expected a page from this computer (http://localhost), got one from {', '.join(origins)}\n"

    def answer(self, connection: Any, request: Any) -> Any:
        """`process_request` of websockets: None admits, a response refuses."""
        headers, status = request.headers, HTTPStatus.UNAUTHORIZED if self.token else HTTPStatus.FORBIDDEN
        refusal = self.refusal(request.path, headers.get_all("Host"), headers.get_all("Origin"))
        return connection.respond(status, refusal) if refusal else None


class _Client:
    def __init__(self, connection: Any) -> None:
        self.connection = connection
        self.messages: deque[str] = deque()  # that wait for it
        self.changed = asyncio.Event()


class WebsocketServer(Receiver):
    """A server on a thread of its own. A client that does not read loses its oldest messages; others lose none."""

    def __init__(
        self, listening: socket.socket, admission: Admission, names: Sequence[str], camera: Camera
    ) -> None:
        self._listening, self._admission = listening, admission
        self._names, self._camera = names, camera
        self._clients: set[_Client] = set()
        self._ready = threading.Event()
        self._failed: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="websocket server", daemon=True)
        self._thread.start()
        self._ready.wait()
        if self._failed is not None:
            raise self._failed

    @property
    def clients(self) -> int:
        return len(self._clients)

    def write(self, packet: Packet) -> None:
        if self._clients:
            text = json.dumps(frame_message(packet, self._names, self._camera), allow_nan=False)
            self._loop.call_soon_threadsafe(self._offer, text)

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join()

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except BaseException as error:  # raised again where the server is made
            self._failed = error
        self._ready.set()

    async def _serve(self) -> None:
        from websockets.asyncio.server import serve

        self._loop, self._stop = asyncio.get_running_loop(), asyncio.Event()
        # Without compression: small messages, and a processor that has better to do.
        async with serve(
            self._serve_client, sock=self._listening, process_request=self._admission.answer, compression=None,
            max_size=LARGEST_REQUEST, close_timeout=CLOSE_S, logger=LOG,
        ):  # fmt: skip
            self._ready.set()
            await self._stop.wait()
            for _ in range(round(CLOSE_S / 0.01)):
                if not any(client.messages for client in self._clients):
                    break
                await asyncio.sleep(0.01)
            for client in self._clients:
                if client.messages:  # it would not answer a farewell either
                    client.connection.transport.abort()

    async def _serve_client(self, connection: Any) -> None:
        from websockets.exceptions import ConnectionClosed

        client = _Client(connection)
        self._clients.add(client)
        sending = asyncio.create_task(self._send_all(client))
        try:
            async for _ in connection:
                pass
        except ConnectionClosed:
            pass
        finally:
            self._clients.discard(client)
            sending.cancel()
            self.dropped += len(client.messages)

    async def _send_all(self, client: _Client) -> None:
        from websockets.exceptions import ConnectionClosed

        while True:
            await client.changed.wait()
            client.changed.clear()
            while client.messages:
                try:
                    await client.connection.send(client.messages[0])
                except ConnectionClosed:
                    return  # what waits is counted where the client is removed
                client.messages.popleft()
                self.sent += 1

    def _offer(self, text: str) -> None:
        for client in self._clients:
            if len(client.messages) > CLIENT_WAITING:  # the first one is being sent
                del client.messages[1]
                self.dropped += 1
            client.messages.append(text)
            client.changed.set()


@register_stream("ws", "ws://HOST:PORT")
def open_websocket(
    rest: str, names: Sequence[str], camera: Camera, *, origins: Sequence[str] = ()
) -> WebsocketServer:
    """Listen on HOST:PORT, or the next port that is free; `origins`: web pages admitted beside local ones."""
    host, port = host_and_port(rest if rest.strip("/") else "//localhost", "ws", PORT)
    need("websockets", "stream")
    admission = Admission("" if is_local(host) else secrets.token_urlsafe(16), tuple(origins))
    listening = listen(host, port, f"ws://{host}:{port}")
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)  # connections inherit it
    with closed_on_error(listening):
        server = WebsocketServer(listening, admission, names, camera)
    used = listening.getsockname()[1]
    server.address = admission.address(host, used)
    notes = [] if port in (0, used) else [f"port {port} is in use, the stream is on port {used}"]
    server.note = "; ".join(notes + ([f"clients connect to {server.address}"] if admission.token else []))
    return server
