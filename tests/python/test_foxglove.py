# SPDX-License-Identifier: MIT
"""The server for Foxglove's app, asked by a plain websocket client."""

import contextlib
import json
import socket
import struct
import threading
import time

import numpy as np
import pytest
from test_streams import CAMERA, NAMES, ROUNDING, SEND_S, frame, median_of_send, numbers_of, result
from viewer_scene import wait_until

import sdftrack as st
from sdftrack.live.streams import open_stream

pytest.importorskip("foxglove.websocket")
pytest.importorskip("rosbags")
connect = pytest.importorskip("websockets.sync.client").connect
HEAD = struct.Struct("<BIQ")  # of a binary message: 1, the subscription, the time in ns
TOPICS = {
    "/sdftrack/box_1/pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/sdftrack/duck/pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/sdftrack/camera_info": "sensor_msgs/msg/CameraInfo",
    "/tf": "tf2_msgs/msg/TFMessage",
}


@pytest.fixture
def server():
    with open_stream("foxglove://127.0.0.1:0", NAMES, CAMERA) as stream:
        yield stream


class Client:
    """Subscribes to all topics; messages are decoded with the definitions that the server sends."""

    def __init__(self, connection):
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.connection, self.channels = connection, {}
        self.info = json.loads(connection.recv(timeout=10))
        while len(self.channels) < len(TOPICS):
            told = json.loads(connection.recv(timeout=10))
            self.channels |= {channel["id"]: channel for channel in told["channels"]}
        self._stores = {}
        for channel in self.channels.values():
            self._stores[channel["id"]] = store = get_typestore(Stores.EMPTY)
            store.register(get_types_from_msg(channel["schema"], channel["schemaName"]))
        subscriptions = [{"id": i, "channelId": i} for i in self.channels]
        connection.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))

    def receive(self):
        """(topic, time in ns, message)"""
        data = self.connection.recv(timeout=10)
        kind, i, time_ns = HEAD.unpack_from(data)
        assert kind == 1
        channel = self.channels[i]
        message = self._stores[i].deserialize_cdr(data[HEAD.size :], channel["schemaName"])
        return channel["topic"], time_ns, message


@contextlib.contextmanager
def client(stream, **options):
    url = f"ws://127.0.0.1:{stream.address.rsplit(':', 1)[1]}"
    with connect(url, subprotocols=["foxglove.sdk.v1"], **options) as connection:
        made = Client(connection)
        channels = stream._receiver._channels.values()
        wait_until(lambda: all(channel.has_sinks() for channel in channels))
        yield made


def test_poses_and_transforms_arrive_as_they_were_sent(server):
    sent = [result(0), result(1, ("lost", "weak"))]
    with client(server) as made:
        for i, one in enumerate(sent):
            server.send(frame(i), one)
        rows = [made.receive() for _ in range(6)]
    topics = [topic for topic, _, _ in rows]
    assert topics == [
        "/sdftrack/camera_info", "/sdftrack/box_1/pose", "/sdftrack/duck/pose", "/tf",
        "/sdftrack/duck/pose", "/tf",
    ]  # fmt: skip
    assert [time_ns for _, time_ns, _ in rows] == [round(1e9 * (100 + i / 30)) for i in (0, 0, 0, 0, 1, 1)]
    assert st.Camera.from_ros(rows[0][2]) == CAMERA
    at = rows[4][2].pose.pose  # the contents of all of them are tested by the file of the same messages
    assert np.abs(numbers_of((at.position, at.orientation)) - sent[1].poses[1]).max() < ROUNDING
    assert [[t.child_frame_id for t in rows[n][2].transforms] for n in (3, 5)] == [
        ["box_1", "duck"],
        ["duck"],
    ]
    assert (server.sent, server.dropped, server.error) == (2, 0, "")


def test_who_comes_later_learns_the_camera_within_a_second(server, monkeypatch):
    monkeypatch.setattr("sdftrack.live.streams.foxglove_server.CAMERA_EVERY_S", 0.05)
    for _ in range(2):
        with client(server) as made:
            server.send(frame(), result())
            assert made.receive()[0] == "/sdftrack/camera_info"
        wait_until(lambda: not server._receiver.subscribed)
        time.sleep(0.06)


def test_an_object_added_later_gets_a_topic(server):
    one = result()
    more = {"poses": np.concatenate([one.poses, one.poses[:1]]), "status": [*one.status, st.Status.OK]}
    for name in ("covariances", "confidence", "twists", "inliers", "runner_up"):
        value = getattr(one, name)
        more[name] = np.concatenate([value, value[:1]])
    with client(server) as made:
        server.send(frame(), st.TrackResult(**{**vars(one), **more, "reason": ["", "", ""]}))
        texts = (m for m in made.connection if isinstance(m, str))  # it comes before or between the poses
        told = json.loads(next(texts))
    assert told["channels"][0]["topic"] == "/sdftrack/object_2/pose"


def test_a_client_that_does_not_read_holds_up_nobody(server):
    stalls = {"max_queue": 1, "ping_interval": None, "close_timeout": 0.1}
    with client(server, max_queue=None) as good, client(server, **stalls):
        assert median_of_send(server) < SEND_S
        seen, newest = [], round(1e9 * (100 + 399 / 30))
        while newest not in seen:  # a busy machine may cost the reader some of the others
            topic, time_ns, _ = good.receive()
            if topic == "/tf":
                seen.append(time_ns)
        assert seen == sorted(seen)
    # None on an idle machine; a thread that gets no processor for a quarter of a second loses a few of 400.
    assert server.dropped <= 20


def test_closing_delivers_what_waits_ends_the_connection_and_frees_the_port(capfd):
    stream = open_stream("foxglove://127.0.0.1:0", NAMES, CAMERA)
    port = int(stream.address.rsplit(":", 1)[1])
    before = threading.active_count()
    with client(stream) as made:
        for i in range(5):
            stream.send(frame(i), result(i))
        stream.close()
        assert sum(made.receive()[0] == "/tf" for _ in range(16)) == 5
        with pytest.raises(Exception, match=r"received 1005|no close frame"):
            made.receive()
    wait_until(lambda: threading.active_count() < before)
    with socket.create_server(("127.0.0.1", port)):
        pass
    assert capfd.readouterr() == ("", "")


def test_only_this_computer_reaches_it_unless_a_host_is_given():
    for address in ("foxglove:", "foxglove://"):
        with open_stream(address, NAMES, CAMERA) as stream:
            assert stream.address.startswith("foxglove://127.0.0.1:87")
    with open_stream("foxglove://0.0.0.0:0", NAMES, CAMERA) as stream:
        assert stream.note.endswith("everyone in the network can read the poses")
        with client(stream):
            pass
