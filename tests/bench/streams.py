# SPDX-License-Identifier: MIT
"""How long a program is held up by a stream: ``python tests/bench/streams.py [--busy 2]``.

Median and 99th percentile of `Stream.send` in microseconds for every scheme, with receivers that read, that stall and
that are not there. Between two calls the program computes for 2 ms without the interpreter's lock, as a tracker does.
`--busy N` starts N processes that do nothing but compute.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import socket
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from harness import machine

import sdftrack as st
from sdftrack.live.streams import Stream, open_stream

CAMERA = st.Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
# Changing these numbers breaks comparisons.
FRAMES, WARM_UP, STEP_S, OBJECTS = 2000, 50, 0.002, 2
NAMES = [f"object_{k}" for k in range(OBJECTS)]


def compute() -> None:
    while True:
        sum(range(100_000))


def some_result(i: int) -> st.TrackResult:
    many = np.ones(OBJECTS)
    return st.TrackResult(
        poses=np.stack([st.geometry.pose([0.1, 0.2, 0.001 * i], [0.1, 0.2, 0.6])] * OBJECTS),
        status=[st.Status.OK] * OBJECTS, reason=[""] * OBJECTS, confidence=many,
        covariances=np.stack([1e-6 * np.eye(6)] * OBJECTS), twists=np.zeros((OBJECTS, 6)), inliers=many,
        runner_up=many, energy=0.1, timestamp=i / 30, index=i,
    )  # fmt: skip


@contextlib.contextmanager
def reading(stream: Stream) -> Iterator[None]:
    """A websocket client that reads everything, in a process of its own."""
    process = multiprocessing.get_context("spawn").Process(target=read, args=(stream.address,), daemon=True)
    process.start()
    time.sleep(2)
    yield
    process.kill()


@contextlib.contextmanager
def subscribed(stream: Stream, reads: bool) -> Iterator[None]:
    """A client of Foxglove's server in a process of its own, that reads everything or nothing."""
    port = int(stream.address.rsplit(":", 1)[1])
    process = multiprocessing.get_context("spawn").Process(target=subscribe, args=(port, reads), daemon=True)
    process.start()
    time.sleep(2)
    yield
    process.kill()


def subscribe(port: int, reads: bool) -> None:
    from websockets.sync.client import connect

    url = f"ws://127.0.0.1:{port}"
    with connect(url, subprotocols=["foxglove.sdk.v1"], max_queue=1, ping_interval=None) as connection:
        connection.recv()
        ids = [channel["id"] for channel in json.loads(connection.recv())["channels"]]
        connection.send(
            json.dumps({"op": "subscribe", "subscriptions": [{"id": i, "channelId": i} for i in ids]})
        )
        while reads:
            connection.recv()
        time.sleep(3600)


def read(address: str) -> None:
    from websockets.sync.client import connect

    with connect(address) as connection:
        for _ in connection:
            pass


@contextlib.contextmanager
def stalled(stream: Stream) -> Iterator[None]:
    """A websocket client that reads nothing after its handshake."""
    port = int(stream.address.rsplit(":", 1)[1])
    with socket.socket() as raw:
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        raw.connect(("127.0.0.1", port))
        raw.sendall(
            b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
        )
        time.sleep(0.5)
        yield


def timed(stream: Stream) -> list[float]:
    frame = st.Frame(np.full((4, 4), 0.5, np.float32))
    results = [some_result(i) for i in range(FRAMES + WARM_UP)]
    took = []
    for result in results:
        start = time.perf_counter()
        stream.send(frame, result)
        took.append(1e6 * (time.perf_counter() - start))
        time.sleep(STEP_S)
    return took[WARM_UP:]


def show(name: str, stream: Stream) -> None:
    took = timed(stream)
    median, high = np.percentile(took, [50, 99])
    print(
        f"{name:36} {median:8.1f} {high:8.1f} {max(took):8.0f} {stream.sent:8} {stream.dropped:8}", flush=True
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--busy", type=int, default=0)
    busy = [multiprocessing.Process(target=compute, daemon=True) for _ in range(parser.parse_args().busy)]
    for process in busy:
        process.start()
    print(machine())
    print(f"{'':36} {'median':>8} {'99 %':>8} {'largest':>8} {'sent':>8} {'dropped':>8}   (times in us)")
    with open_stream("ws://localhost:0", NAMES, CAMERA) as stream:
        show("ws, nobody", stream)
        with reading(stream):
            show("ws, a client", stream)
            with stalled(stream):
                show("ws, a client and a stalled one", stream)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        port = receiver.getsockname()[1]
        threading.Thread(target=lambda: [receiver.recv(65536) for _ in range(FRAMES)], daemon=True).start()
        with open_stream(f"osc://127.0.0.1:{port}", NAMES, CAMERA) as stream:
            show("osc, a receiver", stream)
        with open_stream(f"osc://127.0.0.1:{port}", NAMES, CAMERA) as stream:
            show("osc, a receiver that stalls", stream)
    with open_stream(f"osc://127.0.0.1:{port}", NAMES, CAMERA) as stream:
        show("osc, nobody", stream)
    with (
        tempfile.TemporaryDirectory() as folder,
        open_stream(f"mcap:{Path(folder) / 'poses.mcap'}", NAMES, CAMERA) as stream,
    ):
        show("mcap", stream)
    with open_stream("foxglove://127.0.0.1:0", NAMES, CAMERA) as stream:
        show("foxglove, nobody", stream)
        with subscribed(stream, reads=True):
            show("foxglove, a client", stream)
            with subscribed(stream, reads=False):
                show("foxglove, a client and a stalled one", stream)
    for process in busy:
        process.kill()


if __name__ == "__main__":
    main()
