# SPDX-License-Identifier: MIT
"""Every port that the program opens is knocked at, also those that it does not mention: strangers are refused."""

import contextlib
import os
import re
import socket
import struct
import subprocess
import sys
from dataclasses import dataclass, field
from urllib.parse import urlsplit

import pytest
from viewer_scene import CAMERA, scene, wait_until, watched

import sdftrack as st
from sdftrack.live.streams import open_stream
from sdftrack.viz.viewer import Record, Viewer

psutil = pytest.importorskip("psutil")
pytest.importorskip("viser", reason="viser is not installed: pip install 'sdftrack[viewer]'")

ADMITTED = {101, 200}
MOST = 400  # bytes of a refusal; a page or an image has thousands
EVIL = "http://evil.example.com"
KEY = "dGhlIHNhbXBsZSBub25jZQ=="


def ports_of(pid: int) -> set[tuple[str, int]]:
    """(address, port) of each listening TCP socket of a process, of both versions of IP."""
    sockets = psutil.Process(pid).net_connections(kind="tcp")
    return {tuple(one.laddr) for one in sockets if one.status == psutil.CONN_LISTEN}


@dataclass
class Knock:
    """One request: its method, path, and headers; None leaves a header out."""

    path: str = "/"
    method: str = "GET"
    upgrade: bool = True
    headers: list[tuple[str, str | None]] = field(default_factory=list)
    body: bytes = b""

    def at(self, address: str, port: int) -> tuple[int, bytes]:
        """Status, 0 where the connection was closed without one, and everything that came back."""
        given = {"Host": f"localhost:{port}"}
        if self.upgrade:
            given |= {"Upgrade": "websocket", "Connection": "Upgrade"}
            given |= {"Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": KEY}
            given |= {"Sec-WebSocket-Protocol": _protocol()}
        replaced = {name for name, _ in self.headers}
        lines = [(n, v) for n, v in given.items() if n not in replaced] + self.headers
        head = [f"{self.method} {self.path} HTTP/1.1", *(f"{n}: {v}" for n, v in lines if v is not None)]
        answer = b""
        near = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(address, address)
        with socket.create_connection((near, port), timeout=10) as connection:
            connection.sendall(("\r\n".join(head) + "\r\n\r\n").encode() + self.body)
            connection.settimeout(2)
            with contextlib.suppress(TimeoutError, ConnectionResetError):
                while len(answer) < 1_000_000 and (piece := connection.recv(1 << 16)):
                    answer += piece
        return int(answer.split()[1]) if answer.startswith(b"HTTP/1.1 ") else 0, answer


def _protocol() -> str:
    import viser

    return f"viser-v{viser.__version__}"


def masked(payload: bytes) -> bytes:
    """A binary frame of a WebSocket client, with a mask of zeros."""
    assert len(payload) < 65536
    return b"\x82\xfe" + struct.pack(">H", len(payload)) + bytes(4) + payload


def press(uuid: str) -> bytes:
    """What viser's page sends when it opens, and to switch a checkbox on."""
    import msgspec

    view = {"wxyz": (1, 0, 0, 0), "position": (0, 0, -1), "look_at": (0, 0, 1), "up_direction": (0, -1, 0)}
    opened = {"type": "ViewerCameraMessage", **view, "fov": 1.0, "near": 0.01, "far": 100.0}
    opened |= {"image_height": 600, "image_width": 800}
    switched = {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": True}}
    return b"".join(masked(msgspec.msgpack.encode(message)) for message in (opened, switched))


# What a page of another site, a name that was bound to this computer afterwards, and a scan would send.
STRANGERS = {
    "foreign origin": Knock(headers=[("Origin", EVIL)]),
    "no origin's own": Knock(headers=[("Origin", "null")]),
    "malformed origin": Knock(headers=[("Origin", "http://[::1")]),
    "foreign host": Knock(headers=[("Host", "evil.example.com")]),
    "foreign host and its page": Knock(headers=[("Host", "evil.example.com"), ("Origin", EVIL)]),
    "malformed host": Knock(headers=[("Host", "[::1")]),
    "no host": Knock(headers=[("Host", None)]),
    "two hosts": Knock(headers=[("Host", "localhost"), ("Host", "evil.example.com")]),
    "two origins": Knock(headers=[("Origin", EVIL), ("Origin", "http://localhost")]),
    "page of a foreign origin": Knock(upgrade=False, headers=[("Origin", EVIL)]),
    "page of a foreign host": Knock(upgrade=False, headers=[("Host", "evil.example.com")]),
    "file of a foreign host": Knock("/index.html", upgrade=False, headers=[("Host", "evil.example.com")]),
    "POST": Knock(method="POST", upgrade=False, headers=[("Origin", EVIL)]),
    "POST of this computer": Knock(method="POST", upgrade=False),
    "address of another server": Knock("http://evil.example.com/", upgrade=False),
}
# Where a token is needed, this computer's own names are refused too.
WITHOUT_TOKEN = {
    "no token": Knock(),
    "no token, the page": Knock(upgrade=False),
    "wrong token": Knock("/" + "x" * 22 + "/"),
    "odd token": Knock("/\xff\ud800/".encode(errors="surrogatepass").decode("latin-1")),
    "token in the query": Knock("/?token=" + "x" * 22),
}


def refused(ports: set[tuple[str, int]], knocks: dict[str, Knock], body: bytes = b"") -> None:
    assert ports
    for address, port in sorted(ports):
        for name, knock in knocks.items():
            knock.body = body
            status, answer = knock.at(address, port)
            assert status not in ADMITTED | {500}, f"{name} at {address}:{port}: {status}"
            assert len(answer) < MOST, f"{name} at {address}:{port}: {len(answer)} bytes"


@contextlib.contextmanager
def new_ports():
    """A function that returns the ports that were opened within this context."""
    before = ports_of(os.getpid())
    yield lambda: ports_of(os.getpid()) - before


HOSTS = ("localhost", "127.0.0.5", "0.0.0.0", "::1")


@pytest.mark.parametrize(("host", "token"), [*((host, None) for host in HOSTS), ("localhost", "open-sesame")])
def test_a_viewer_has_one_port_and_strangers_see_and_switch_nothing(host, token, monkeypatch):
    sequence, sdf, results = scene()
    if host == "::1" and not socket.has_ipv6:
        pytest.skip("this computer has no IPv6")
    with new_ports() as ports, Viewer(sdf, CAMERA, ["duck"], host=host, port=0, token=token) as viewer:
        with watched(viewer, monkeypatch):
            viewer.show(sequence[0], results[0])
            wait_until(lambda: viewer.picture is not None)  # there is a picture to be seen
        switch = press(viewer._panel._record._impl.uuid)
        refused(ports(), STRANGERS | (WITHOUT_TOKEN if token or host == "0.0.0.0" else {}), switch)
        assert viewer.requests() == []
        assert viewer._server.viser._websock_server._client_state_from_id == {}
        (place,) = ports()
        assert place[1] == viewer._server.port
        # The same message switches recording on for whoever is admitted, who sees the picture.
        own = urlsplit(viewer.url).path
        local = f"localhost:{place[1]}"
        if token is not None:
            assert own == f"/{token}/"
            assert Knock("/", upgrade=False, headers=[("Host", local)]).at(*place)[0] == 403
        known = Knock(own, headers=[("Host", local), ("Origin", f"http://{local}")], body=switch)
        status, answer = known.at(*place)
        assert status == 101
        assert len(answer) > 10_000
        wait_until(lambda: viewer.requests() == [Record(True)])
        printed = Knock(own, upgrade=False, headers=[("Host", urlsplit(viewer.url).netloc)])
        assert printed.at(*place)[0] == 200
    assert ports_of(os.getpid()).isdisjoint({place})


def test_a_viewer_that_viser_would_serve_elsewhere_is_not_opened(monkeypatch):
    """A version that opens its server in another way must not be left open."""
    from websockets.asyncio import server

    from sdftrack.viz.viewer.server import Gate

    plain = server.serve
    monkeypatch.setattr(Gate, "in_front_of", lambda self, host: contextlib.nullcontext())
    with new_ports() as ports:
        with pytest.raises(ImportError, match=r"viser: .* pip install 'viser"):
            Viewer(st.SDF.sphere(0.1, voxels=24), CAMERA, port=0)
        assert ports() == set()
    assert server.serve is plain


@pytest.mark.parametrize("host", ["localhost", "0.0.0.0"])
def test_a_websocket_stream_has_one_port_that_strangers_do_not_read(host):
    pytest.importorskip("websockets")
    sequence, _, results = scene()
    with new_ports() as ports, open_stream(f"ws://{host}:0", ["duck"], CAMERA) as stream:
        # A given token is enough for programs elsewhere, whatever they call this computer.
        knocks = STRANGERS | (WITHOUT_TOKEN if host == "0.0.0.0" else {})
        assert len(ports()) == 1
        refused(ports(), knocks)
        assert stream._receiver.clients == 0
        (place,) = ports()
        status, _ = Knock("/?" + urlsplit(stream.address).query).at(*place)
        assert status == 101
        stream.send(sequence[0], results[0])


def test_foxglove_opens_the_port_that_it_tells_and_no_other():
    pytest.importorskip("foxglove.websocket")
    with new_ports() as ports, open_stream("foxglove://127.0.0.1:0", ["duck"], CAMERA) as stream:
        assert ports() == {("127.0.0.1", int(stream.address.rpartition(":")[2]))}
    with new_ports() as ports, open_stream("osc://localhost:9000", ["duck"], CAMERA):
        assert ports() == set()


def test_a_token_is_long_and_another_for_each_server():
    tokens = set()
    for _ in range(2):
        with Viewer(scene()[1], CAMERA, host="0.0.0.0", port=0) as viewer:
            tokens.add(urlsplit(viewer.url).path.strip("/"))
        with open_stream("ws://0.0.0.0:0", ["duck"], CAMERA) as stream:
            tokens.add(urlsplit(stream.address).query.removeprefix("token="))
            assert urlsplit(stream.address).query in stream.note
    assert len(tokens) == 4
    assert min(map(len, tokens)) >= 16


SERVERS = {
    "viewer": lambda port: Viewer(scene()[1], CAMERA, port=port),
    "ws": lambda port: open_stream(f"ws://localhost:{port}", ["duck"], CAMERA),
    "foxglove": lambda port: open_stream(f"foxglove://localhost:{port}", ["duck"], CAMERA),
}


@pytest.mark.parametrize("kind", SERVERS)
def test_a_port_in_use_is_told_and_the_next_one_taken(kind):
    if kind == "foxglove":
        pytest.importorskip("foxglove.websocket")
    with socket.create_server(("127.0.0.1", 0)) as taken, new_ports() as ports:
        port = taken.getsockname()[1]
        with SERVERS[kind](port) as server:
            ((_, used),) = ports()
            assert port < used < port + 20
            assert f"port {port} is in use" in server.note
            assert str(used) in server.note.partition("use")[2]


def test_workers_of_a_batch_and_their_page_are_not_reached_from_the_network():
    pytest.importorskip("distributed")
    from sdftrack.batch.cluster import cluster

    with new_ports() as ports, cluster(None, 1):
        assert {address for address, _ in ports()} == {"127.0.0.1"}


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ports")
    sequence, _, _ = scene()
    st.save_sequence(folder / "seq", sequence)
    st.synth.duck_mesh().save(folder / "duck.ply")
    return folder


@pytest.mark.parametrize("command", ["live", "view"])
def test_ports_of_a_running_command(recording, tmp_path, command):
    box = ["--init", "box:100,60,120,120"]
    model = ["--model", str(recording / "duck.ply"), "--voxels", "40", "--no-video"]
    more = {
        "live": ["--camera", f"replay:{recording / 'seq'}", "--fps", "0.5", *model, *box,
                 "--stream", "ws://0.0.0.0:0", "--out", str(tmp_path / "out")],
        "view": [str(recording / "seq"), "--seconds", "60"],
    }[command]  # fmt: skip
    arguments = [sys.executable, "-u", "-m", "sdftrack", command, *more, "--host", "0.0.0.0", "--port", "0"]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as running:
        try:
            said, expected = "", 1 if command == "view" else 2
            while len(set(re.findall(r"(?:http|ws)://\S+", said))) < expected:
                line = running.stdout.readline()
                assert line, said
                said += line
            ports = ports_of(running.pid)
            assert len(ports) == expected
            refused(ports, STRANGERS | WITHOUT_TOKEN)
            page = urlsplit(re.search(r"http://\S+", said)[0])
            assert Knock(page.path, upgrade=False).at("127.0.0.1", page.port)[0] == 200
        finally:
            running.kill()
    assert not list(tmp_path.glob("out/recording_*"))
