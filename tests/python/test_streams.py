# SPDX-License-Identifier: MIT
"""Results over a network and into a file: real receivers read back what was sent, and never hold up the program."""

import contextlib
import http.server
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tracking_fakes
from test_docs import code_blocks
from viewer_scene import wait_until

import sdftrack as st
from sdftrack._internal.rotations import rotation
from sdftrack.live.streams import STREAMS, Receiver, Stream, open_stream, register_stream
from sdftrack.live.streams.stream import host_and_port, safe_names
from sdftrack.live.streams.websocket import Admission

pytest.importorskip("websockets")
CAMERA = st.Camera(525.0, 524.0, 319.5, 239.5, 640, 480, (0.1, -0.2, 0.001, 0.002, 0.01))
NAMES = ["box 1", "duck"]
ROUNDING = 1e-9  # of poses through a quaternion and back, m and 1
FLOAT32 = 1e-7  # OSC's numbers have 24 bits
SEND_S = 50e-6  # median time of `send`
DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "howto" / "stream.md"
SCHEMA = DOCS / "reference" / "stream.schema.json"


def frame(i=0, timestamp=None):
    return st.Frame(
        np.full((4, 4), 0.5, np.float32), timestamp=100 + i / 30 if timestamp is None else timestamp, index=i
    )


def result(i=0, status=("ok", "ok"), seed=0):
    """A result with poses and covariances that no permutation of their numbers leaves as they are."""
    random = np.random.default_rng([seed, i])
    poses = [st.geometry.pose(random.normal(size=3), [0.1 * k, -0.2, 0.6 + 0.01 * i]) for k in (0, 1)]
    roots = random.normal(size=(2, 6, 6)) * [1, 2, 3, 4, 5, 6]
    gone = np.array([word in ("lost", "bad_frame") for word in status])
    return replace(
        tracking_fakes.result(poses, status, i),
        reason=["" if word == "ok" else f"it is {word}" for word in status],
        confidence=np.where(gone, 0, [0.9, 0.8]),
        covariances=np.where(gone[:, None, None], np.nan, 1e-6 * roots @ np.swapaxes(roots, 1, 2)),
        twists=np.full((2, 6), np.nan) if i == 0 else random.normal(size=(2, 6)), timestamp=100 + i / 30,
    )  # fmt: skip


def pose_of(position, quaternion):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation(quaternion), position
    return T


def median_of_send(stream, count=400):
    took = []
    for i in range(count):
        this, that = frame(i), result(i)
        start = time.perf_counter()
        stream.send(this, that)
        took.append(time.perf_counter() - start)
        time.sleep(0.001)
    return float(np.median(took))


# -- websocket
@pytest.fixture
def server():
    with open_stream("ws://localhost:0", NAMES, CAMERA) as stream:
        yield stream


@contextlib.contextmanager
def client(stream, **options):
    """A connection that the server knows of."""
    from websockets.sync.client import connect

    before = stream._receiver.clients
    with connect(stream.address, **options) as connection:
        wait_until(lambda: stream._receiver.clients > before)
        yield connection


def stalled(stream):
    """A client that shakes hands and then reads nothing, with the small buffer of a weak device."""
    host, port = "127.0.0.1", int(stream.address.rsplit(":", 1)[1])
    before = stream._receiver.clients
    raw = socket.socket()
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    raw.connect((host, port))
    raw.sendall(
        f"GET / HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    wait_until(lambda: stream._receiver.clients > before)
    return raw


def test_a_websocket_client_receives_every_result(server):
    sent = [result(i) for i in range(5)]
    with client(server) as connection:
        for i, one in enumerate(sent):
            server.send(frame(i), one)
        received = [json.loads(connection.recv(timeout=10)) for _ in sent]
    for i, (message, one) in enumerate(zip(received, sent, strict=True)):
        assert (message["version"], message["index"], message["timestamp"]) == (1, i, 100 + i / 30)
        assert abs(message["sent"] - time.time()) < 60
        assert message["camera"] == {
            "width": 640, "height": 480, "fx": 525.0, "fy": 524.0, "cx": 319.5, "cy": 239.5,
        }  # fmt: skip
        for k, thing in enumerate(message["objects"]):
            assert (thing["name"], thing["status"], thing["reason"]) == (NAMES[k], "ok", "")
            assert thing["confidence"] == one.confidence[k]
            assert np.abs(pose_of(**thing["pose"]) - one.poses[k]).max() < ROUNDING
            assert np.array_equal(thing["covariance"], one.covariances[k])
            assert thing["twist"] == (None if i == 0 else one.twists[k].tolist())
    assert (server.sent, server.dropped, server.error) == (5, 0, "")


@pytest.mark.parametrize("status", [("ok", "weak"), ("lost", "bad_frame")])
def test_messages_follow_the_documented_schema(server, status):
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    with client(server) as connection:
        server.send(st.Frame.unreadable("no cable"), result(0, status))
        text = connection.recv(timeout=10)
    assert "NaN" not in text
    message = json.loads(text)
    jsonschema.validate(message, schema)
    assert message["timestamp"] is None
    assert [thing["status"] for thing in message["objects"]] == list(status)
    assert (message["objects"][0]["covariance"] is None) == (status[0] == "lost")
    del message["objects"][0]["pose"]["quaternion"]
    with pytest.raises(jsonschema.ValidationError, match="quaternion"):
        jsonschema.validate(message, schema)


def test_a_client_that_does_not_read_loses_the_oldest_messages_and_holds_up_nobody(server):
    with client(server, max_queue=None) as good:
        raw = stalled(server)
        median = median_of_send(server)
        assert median < SEND_S
        received = [json.loads(good.recv(timeout=10))["index"] for _ in range(400)]
        assert received == list(range(400))
        assert server.dropped > 100
        raw.settimeout(5)
        data = b""
        while b'"index": 399,' not in data:
            data += raw.recv(1 << 16)
        assert b'"index": 250,' not in data
        raw.close()


def test_a_client_that_vanishes_is_forgotten_with_its_threads(server):
    before = threading.active_count()
    raw = stalled(server)
    reset = b"\1\0\0\0\0\0\0\0"  # as of a killed program
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, reset)
    raw.close()
    wait_until(lambda: server._receiver.clients == 0)
    wait_until(lambda: threading.active_count() == before)
    server.send(frame(), result())  # may reach the next client, if that is faster than the thread
    with client(server) as connection:
        server.send(frame(1), result(1))
        received = [json.loads(connection.recv(timeout=60))["index"]]
        if received == [0]:
            received.append(json.loads(connection.recv(timeout=60))["index"])
        assert received[-1] == 1


def test_closing_delivers_what_waits_ends_the_threads_and_does_not_wait_long_for_a_stalled_client():
    before = threading.active_count()
    stream = open_stream("ws://localhost:0", NAMES, CAMERA)
    raw = stalled(stream)
    with client(stream, max_queue=None) as connection:
        for i in range(300):
            stream.send(frame(i), result(i))
            time.sleep(0.0005)
        start = time.monotonic()
        stream.close()
        assert time.monotonic() - start < 5
        received = [json.loads(text)["index"] for text in connection]
        assert received[-8:] == list(range(292, 300))  # a busy machine may lose earlier ones
    raw.close()
    wait_until(lambda: threading.active_count() == before)
    with pytest.raises(ValueError, match="send: expected an open stream"):
        stream.send(frame(), result())
    stream.close()


def test_a_page_of_an_origin_that_is_admitted_reads_the_stream(server):
    for origin in ("http://localhost:8000", "http://127.0.0.1"):
        with client(server, origin=origin):
            pass
        wait_until(lambda: not server._receiver.clients)  # the next one is counted from 0
    admits = open_stream("ws://localhost:0", NAMES, CAMERA, origins=["null"])
    with admits as stream, client(stream, origin="null") as connection:
        stream.send(frame(), result())
        assert json.loads(connection.recv(timeout=10))["index"] == 0
    assert "got one from https://localhost.evil" in Admission().refusal(
        "/", ["localhost"], ["https://localhost.evil"]
    )


# -- OSC
@pytest.fixture
def osc():
    """An OSC server; what it received as {address: list of arguments}, and its port."""
    pytest.importorskip("pythonosc")
    from pythonosc.dispatcher import Dispatcher
    from pythonosc.osc_server import BlockingOSCUDPServer

    received = {}
    dispatcher = Dispatcher()
    dispatcher.set_default_handler(lambda address, *given: received.setdefault(address, []).append(given))
    with BlockingOSCUDPServer(("127.0.0.1", 0), dispatcher) as listening:
        thread = threading.Thread(target=lambda: listening.serve_forever(0.01))
        thread.start()
        yield received, listening.server_address[1]
        listening.shutdown()
        thread.join()


def test_osc_receives_pose_status_and_confidence(osc):
    received, port = osc
    sent = [result(0), result(1, ("lost", "weak"))]
    with open_stream(f"osc://127.0.0.1:{port}", NAMES, CAMERA) as stream:
        for i, one in enumerate(sent):
            stream.send(frame(i), one)
        wait_until(lambda: len(received.get("/sdftrack/duck/confidence", ())) == 2)
    assert set(received) == {
        f"/sdftrack/{n}/{what}" for n in ("box_1", "duck") for what in ("pose", "status", "confidence")
    }
    for i, one in enumerate(sent):
        for k, name in enumerate(("box_1", "duck")):
            numbers = received[f"/sdftrack/{name}/pose"][i]
            assert np.abs(pose_of(numbers[:3], numbers[3:]) - one.poses[k]).max() < 4 * FLOAT32
            assert received[f"/sdftrack/{name}/status"][i] == (one.status[k].value,)
            assert received[f"/sdftrack/{name}/confidence"][i] == (pytest.approx(one.confidence[k]),)
    assert (stream.sent, stream.dropped) == (2, 0)


def test_a_missing_osc_receiver_costs_messages_only():
    pytest.importorskip("pythonosc")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with open_stream(f"osc://127.0.0.1:{port}", NAMES, CAMERA) as stream:
        assert median_of_send(stream, 50) < SEND_S
    assert stream.dropped > 0
    assert stream.sent + stream.dropped == 50
    assert stream.error.startswith(f"osc://127.0.0.1:{port}: Connection refused")


# -- mcap
def read_mcap(path):
    """Messages as (topic, log time, message), also of a file that was cut off, by the definitions in it."""
    from mcap.exceptions import EndOfFile
    from mcap.records import Channel, Message, Schema
    from mcap.stream_reader import StreamReader
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    out, stores, schemas, channels = [], {}, {}, {}
    with path.open("rb") as file, contextlib.suppress(EndOfFile):
        for record in StreamReader(file).records:
            if isinstance(record, Schema):
                schemas[record.id] = record
                stores[record.id] = get_typestore(Stores.EMPTY)
                stores[record.id].register(get_types_from_msg(record.data.decode(), record.name))
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                channel = channels[record.channel_id]
                schema = schemas[channel.schema_id]
                assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
                message = stores[schema.id].deserialize_cdr(record.data, schema.name)
                out.append((channel.topic, record.log_time, message))
    return out


def numbers_of(pose):
    at, turn = pose
    return pose_of([at.x, at.y, at.z], [turn.x, turn.y, turn.z, turn.w])


@pytest.fixture
def bag(tmp_path):
    pytest.importorskip("mcap")
    pytest.importorskip("rosbags")
    return tmp_path / "poses.mcap"


def test_an_mcap_file_holds_ros_messages_of_tracked_objects(bag):
    from rosbags.highlevel import AnyReader

    sent = [result(0), result(1, ("ok", "lost")), result(2, ("bad_frame", "weak"))]
    sent[1] = replace(sent[1], covariances=np.stack([np.full((6, 6), np.nan), sent[1].covariances[1]]))
    with open_stream(f"mcap:{bag}", NAMES, CAMERA) as stream:
        for i, one in enumerate(sent):
            stream.send(frame(i), one)
        assert not bag.exists()
    assert (stream.sent, stream.dropped, stream.error) == (3, 0, "")
    assert [path.name for path in bag.parent.iterdir()] == ["poses.mcap"]

    rows = read_mcap(bag)
    (info,) = [message for topic, _, message in rows if topic == "/sdftrack/camera_info"]
    assert st.Camera.from_ros(info) == CAMERA
    for k, name in enumerate(("box_1", "duck")):
        expected = [i for i, one in enumerate(sent) if one.status[k] in ("ok", "weak")]
        poses = [row for row in rows if row[0] == f"/sdftrack/{name}/pose"]
        assert [row[1] for row in poses] == [round(1e9 * (100 + i / 30)) for i in expected]
        for i, (_, time_ns, message) in zip(expected, poses, strict=True):
            assert message.header.frame_id == "camera_depth_optical_frame"
            assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == time_ns
            got = numbers_of((message.pose.pose.position, message.pose.pose.orientation))
            assert np.abs(got - sent[i].poses[k]).max() < ROUNDING
            # Row by row, x y z before the rotations: element (1, 4) is that of y and the rotation about y.
            known = sent[i].covariances[k]
            known = 1e6 * np.eye(6) if np.isnan(known).any() else known  # unknown is large, not certain
            assert np.array_equal(message.pose.covariance.reshape(6, 6), known)
            assert message.pose.covariance[6 * 1 + 4] == known[1, 4]
    with AnyReader([bag]) as reader:
        assert len(list(reader.messages())) == len(rows)
    transforms = [message.transforms for topic, _, message in rows if topic == "/tf"]
    assert [[t.child_frame_id for t in ts] for ts in transforms] == [["box_1", "duck"], ["box_1"], ["duck"]]
    for one, ts in zip(sent, transforms, strict=True):
        for t in ts:
            got = numbers_of((t.transform.translation, t.transform.rotation))
            assert np.abs(got - one.poses[["box_1", "duck"].index(t.child_frame_id)]).max() < ROUNDING
            assert t.header.frame_id == "camera_depth_optical_frame"


CRASH = """
import os, sys, time
sys.path.insert(0, sys.argv[2])
from test_streams import CAMERA, NAMES, frame, result
from sdftrack.live.streams import open_stream
stream = open_stream("mcap:" + sys.argv[1], NAMES, CAMERA)
for i in range(300):
    stream.send(frame(i), result(i))
while stream.sent < 300:
    time.sleep(0.01)
os._exit(9)  # no clean-up of any kind
"""


@pytest.mark.slow
def test_a_file_cut_off_by_a_crash_is_readable_up_to_its_last_chunk_as_the_page_says(bag, monkeypatch):
    monkeypatch.chdir(bag.parent)
    here = str(Path(__file__).parent)
    done = subprocess.run([sys.executable, "-c", CRASH, str(bag), here], timeout=60, check=False)
    assert done.returncode == 9
    assert not bag.exists()
    exec(compile(code_blocks(PAGE, "python")[2], "stream.md", "exec"), {})
    for file in ("poses.part.mcap", "recovered.mcap"):
        poses = [m for topic, _, m in read_mcap(Path(file)) if topic == "/sdftrack/duck/pose"]
        assert 250 <= len(poses) <= 300  # a chunk of 16 KiB has some 17 frames of two objects
        for i, message in enumerate(poses):
            assert message.pose.pose.position.z == result(i).poses[1][2, 3]
    with pytest.raises(FileExistsError, match="a part left by a run that was cut off"):
        open_stream(f"mcap:{bag}", NAMES, CAMERA)


@pytest.mark.skipif(os.name != "posix", reason="limits the size of files by setrlimit")
def test_a_full_disk_ends_the_file_but_not_the_tracking(bag):
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, hard))
    try:
        with open_stream(f"mcap:{bag}", NAMES, CAMERA) as stream:
            for i in range(300):
                stream.send(frame(i), result(i))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert stream.error == f"{bag}: File too large; what was written before is in poses.part.mcap"
    assert stream.dropped > 0
    assert stream.sent + stream.dropped == 300
    assert not bag.exists()
    assert len(read_mcap(bag.with_suffix(".part.mcap"))) > 150


def test_an_existing_file_is_kept_unless_told_otherwise_and_a_frame_without_a_time_has_that_of_sending(bag):
    bag.write_text("mine")
    with pytest.raises(FileExistsError, match="expected a new file, got a file that exists; move it or pass"):
        open_stream(f"mcap:{bag}", NAMES, CAMERA)
    assert bag.read_text() == "mine"
    before = time.time_ns()
    with open_stream(f"mcap:{bag}", NAMES, CAMERA, overwrite=True) as stream:
        stream.send(frame().replace(timestamp=None), result())
    rows = read_mcap(bag)
    assert len(rows) == 4
    assert before - 10**6 <= rows[0][1] <= time.time_ns() + 10**6


# -- all of them
def test_a_slow_receiver_loses_the_oldest_frames_and_they_are_counted():
    gate, seen, begun = threading.Event(), [], threading.Event()

    class Slow(Receiver):
        address = "slow:"

        def write(self, packet):
            begun.set()
            assert gate.wait(10)
            seen.append(packet.index)
            self.sent += 1

    stream = Stream(Slow(), waiting=3)
    stream.send(frame(0), result(0))
    assert begun.wait(10)
    assert median_of_send(stream, 20) < SEND_S
    assert stream.dropped == 17
    gate.set()
    stream.close()
    assert seen == [0, 17, 18, 19]
    assert (stream.sent, stream.dropped) == (4, 17)


def test_a_receiver_that_fails_raises_nothing_and_is_tried_again():
    class Failing(Receiver):
        address = "failing:"

        def write(self, packet):
            if packet.index < 2:
                raise RuntimeError("firmware")
            self.sent += 1

    with Stream(Failing()) as stream:
        for i in range(3):
            stream.send(frame(i), result(i))
    assert (stream.sent, stream.dropped, stream.error) == (1, 2, "RuntimeError: firmware")


def test_a_scheme_of_ones_own(monkeypatch):
    monkeypatch.setattr("sdftrack.live.streams.stream.STREAMS", STREAMS)
    monkeypatch.setitem(STREAMS, "print", None)
    lines = []

    @register_stream("print", "print:PREFIX")
    def open_print(rest, names, camera, *, mark="!"):
        class Lines(Receiver):
            address = f"print:{rest}"

            def write(self, packet):
                lines.append(f"{rest}{packet.index}{mark}")

        return Lines()

    with open_stream("print:frame ", NAMES, CAMERA, mark="?") as stream:
        stream.send(frame(3), result(3))
    assert lines == ["frame 3?"]


@pytest.mark.parametrize(
    ("address", "error", "message"),
    [
        ("tcp://localhost:1", ValueError, 'expected one of .*"ws://HOST:PORT", "osc://HOST:PORT", "mcap:FILE.mcap"'),
        ("ws://localhost:http", ValueError, "expected ws://HOST:PORT, got 'ws://localhost:http'"),
        ("ws://203.0.113.7:8765", OSError, "expected a name or address of this computer"),
        ("osc://localhost", ValueError, "without a port"),
        ("osc://localhost:0", ValueError, "from 1 to 65535"),
        ("osc://no.such.host.invalid:9000", OSError, "the host is not known"),
        ("mcap:poses.bag", ValueError, "expected mcap:FILE.mcap"),
        ("mcap:no_such_folder/poses.mcap", FileNotFoundError, "the folder no_such_folder does not exist"),
        (8765, TypeError, "address: expected a text"),
        ("foxglove://203.0.113.7:8765", OSError, "foxglove://203.0.113.7:8765: expected a name or address of this"),
    ],
)  # fmt: skip
def test_wrong_addresses_are_refused(address, error, message, tmp_path, monkeypatch):
    if str(address).startswith("foxglove"):
        pytest.importorskip("foxglove.websocket")
    monkeypatch.chdir(tmp_path)
    before = threading.active_count()
    with pytest.raises(error, match=message):
        open_stream(address, NAMES, CAMERA)
    assert threading.active_count() == before
    assert list(tmp_path.iterdir()) == []


def test_names_and_addresses():
    assert safe_names(["a", "a", "a_2", "é!", "1", ""]) == ["a", "a_2", "a_2_2", "_", "_1", "object_5"]
    assert host_and_port("//[::1]:80", "ws") == ("::1", 80)
    assert host_and_port("//example.org/", "ws", 8765) == ("example.org", 8765)


# -- the page docs/howto/stream.md
@pytest.mark.slow
def test_the_programs_of_the_page_run_and_meet(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    mesh = st.synth.duck_mesh()
    camera = st.Camera(420.0, 420.0, 319.5, 239.5, 640, 480)
    st.save_sequence(
        "recording", st.synth.sequence(mesh, 12, noise=0.001, seed=4, camera=camera), layout="bop"
    )
    st.Mesh(1000 * mesh.vertices, mesh.faces, mesh.colors).save("part.ply")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
    tracks, reads, _ = (code.replace("8765", port) for code in code_blocks(PAGE, "python"))
    tracks = tracks.replace('"replay:recording"', '"replay:recording", fps=4, waiting=12')
    names, failed = {}, []
    tracks, reads = (compile(code, "stream.md", "exec") for code in (tracks, reads))

    def run():
        try:
            exec(tracks, names)
        except BaseException as error:
            failed.append(error)

    def listens():
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", int(port))):
            return True

    thread = threading.Thread(target=run)
    thread.start()
    wait_until(lambda: failed or listens(), 60)
    assert failed == []
    exec(reads, {})
    thread.join(60)
    assert failed == []
    assert len(re.findall(r"^\d+ part \[", capsys.readouterr().out, re.MULTILINE)) > 3
    assert names["stream"].sent > 3


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("chromium"), reason="needs the browser chromium")
def test_the_web_page_shows_the_poses_in_a_browser(server, tmp_path):
    (page,) = code_blocks(PAGE, "html")
    # The picture keeps the browser from printing the page before the first messages.
    page = page.replace("ws://localhost:8765", server.address) + '<img src="/slow">'

    class Pages(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            if self.path == "/slow":
                for _ in range(100):
                    server.send(frame(), result(0, ("ok", "lost")))
                    time.sleep(0.02)
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(page.encode())

        def log_message(self, *of):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Pages) as site:
        thread = threading.Thread(target=site.serve_forever)
        thread.start()
        url = f"http://localhost:{site.server_port}/pose.html"
        try:
            shown = subprocess.run(
                ["chromium", "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}",
                 "--timeout=10000", "--dump-dom", url],
                capture_output=True, text=True, timeout=60, check=True,
            ).stdout  # fmt: skip
        finally:
            site.shutdown()
            thread.join()
    assert "box 1: ok, 0.0 -200.0 600.0 mm\nduck: lost, it is lost" in shown
