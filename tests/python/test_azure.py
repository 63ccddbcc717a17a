# SPDX-License-Identifier: MIT
"""Azure Kinect's Matroska files: written by FFmpeg in the recorder's structure, since the data have none."""

import json
import struct
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest

import sdftrack as st
from sdftrack.io.datasets.azure import azure_cameras

DEPTH_SIZE, COLOR_SIZE = (320, 288), (1280, 720)
TURN = st.geometry.exp([-0.032, -0.002, 0.004, 0.09, 0.01, -0.02])
LENS = {"k1": 0.5, "k2": -0.4, "k3": 0.02, "k4": 0.8, "k5": -0.3, "k6": 0.03, "p1": 1e-4, "p2": -2e-4}
DELAY_S = 0.002  # of colour


def entry(location, fx, cx, cy, T, lens):
    return {
        "Intrinsics": {
            "ModelParameterCount": 14,
            "ModelParameters": [
                cx, cy, fx, 1.25 * fx, *(lens[f"k{n}"] for n in range(1, 7)), 0, 0, lens["p2"], lens["p1"],
            ],
            "ModelType": "CALIBRATION_LensDistortionModelBrownConrady",
        },
        "Location": location,
        "Rt": {"Rotation": T[:3, :3].ravel().tolist(), "Translation": T[:3, 3].tolist()},
    }  # fmt: skip


def calibration(depth_turn=np.eye(4), color_turn=TURN):  # noqa: B008  (not changed)
    none = dict.fromkeys(LENS, 0.0)
    return {
        "CalibrationInformation": {
            "Cameras": [
                entry("CALIBRATION_CameraLocationD0", 0.4912, 0.51, 0.495, depth_turn, LENS),
                entry("CALIBRATION_CameraLocationPV0", 0.475, 0.4995, 0.503, color_turn, none),
            ]
        }
    }  # fmt: skip


def images(count):
    noise = np.random.default_rng(0)
    w, h = DEPTH_SIZE
    smooth = [
        cv2.resize(noise.integers(0, 256, (9, 16, 3)).astype(np.uint8), COLOR_SIZE) for _ in range(count)
    ]
    return [noise.integers(300, 5000, (h, w)).astype(np.uint16) for _ in range(count)], smooth


def write(path, count=4, color="mjpeg", attachment=None, names=("COLOR", "DEPTH", "IR"), without_color=()):
    """The tracks of k4arecorder by FFmpeg: MJPEG or raw colour, depth and infrared as big-endian grey."""
    depth, colors = images(count)
    with av.open(
        path, "w", format="matroska", options={"allow_raw_vfw": "1", "cluster_time_limit": "70"}
    ) as out:
        streams = {}
        for name in names:
            codec, pixels, size = (
                (color, {"mjpeg": "yuvj420p", "rawvideo": "bgra"}[color], COLOR_SIZE)
                if name == "COLOR"
                else ("rawvideo", "gray16be", DEPTH_SIZE)
            )
            stream = out.add_stream(codec, rate=30)
            stream.width, stream.height, stream.pix_fmt = *size, pixels
            stream.time_base = stream.codec_context.time_base = Fraction(1, 1000)
            stream.metadata["title"] = name
            streams[name] = stream
        text = json.dumps(calibration()) if attachment is None else attachment
        if text:
            out.add_attachment("calibration.json", "application/octet-stream", text.encode() + b"\0")
        out.metadata["K4A_DEPTH_MODE"] = "NFOV_2X2BINNED"
        out.metadata["K4A_START_OFFSET_NS"] = "5000000000"
        for i in range(count):
            for name, stream in streams.items():
                if name == "COLOR" and i in without_color:
                    continue
                if name == "COLOR":
                    picture = av.VideoFrame.from_ndarray(colors[i], "rgb24").reformat(format=stream.pix_fmt)
                else:
                    picture = av.VideoFrame.from_ndarray(
                        depth[i] if name == "DEPTH" else depth[i] // 2, "gray16be"
                    )
                picture.pts = round(1000 * (i / 30 + (DELAY_S if name == "COLOR" else 0)))
                picture.time_base = Fraction(1, 1000)
                out.mux(stream.encode(picture))
        for stream in streams.values():
            out.mux(stream.encode(None))
    put_fourcc(path, DEPTH_SIZE[0], b"b16g")
    if color == "rawvideo":
        put_fourcc(path, COLOR_SIZE[0], b"BGRA")
    return path


def put_fourcc(path, width, fourcc):
    """The recorder's codes of raw images, where FFmpeg writes 0: in each BITMAPINFOHEADER of that width."""
    content = bytearray(path.read_bytes())
    height = dict((DEPTH_SIZE, COLOR_SIZE))[width]
    for signed in (height, -height):
        header, at = struct.pack("<Ii", width, signed) + b"\1\0", -1
        while (at := content.find(header, at + 1)) >= 0:
            content[at + 12 : at + 16] = fourcc
    path.write_bytes(content)


def test_depth_is_exact_in_any_order_with_the_devices_times(tmp_path):
    write(tmp_path / "kinect.mkv")
    with st.open_sequence(tmp_path / "kinect.mkv") as seq:
        assert (seq.layout, seq.name, len(seq)) == ("azure", "kinect", 4)
        for i in (2, 0, 3, 1):
            wanted = st.Frame(images(4)[0][i], depth_scale=0.001, check_units=False)
            np.testing.assert_array_equal(seq[i].depth, wanted.depth)
            assert seq[i].timestamp == pytest.approx(5 + round(1000 * i / 30) / 1000)


def test_colour_is_what_the_jpegs_hold(tmp_path):
    write(tmp_path / "kinect.mkv")
    with av.open(tmp_path / "kinect.mkv") as file:
        jpegs = [bytes(packet) for packet in file.demux(video=0) if packet.size]
    with st.open_sequence(tmp_path / "kinect.mkv") as seq:
        for i in (3, 0):
            decoded = cv2.imdecode(np.frombuffer(jpegs[i], np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
            np.testing.assert_array_equal(seq[i].color, decoded)
            assert np.abs(seq[i].color.astype(int) - images(4)[1][i]).mean() < 6  # of JPEG's compression


def test_raw_colour_is_exact_and_a_missing_image_is_noticed(tmp_path):
    write(tmp_path / "kinect.mkv", color="rawvideo", without_color=(1,))
    with st.open_sequence(tmp_path / "kinect.mkv") as seq:
        assert seq[1].color is None
        for i in (0, 2, 3):
            np.testing.assert_array_equal(seq[i].color, images(4)[1][i])


def sdk_project(point, entry, full):
    """Pixel of a point on the sensor's full image, whose first pixel's corner is (0, 0): the published formula."""
    cx, cy, fx, fy, k1, k2, k3, k4, k5, k6, _, _, p2, p1 = entry["Intrinsics"]["ModelParameters"]
    x, y = point[:2] / point[2]
    r2 = x * x + y * y
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y * y)
    return np.array([(u * fx + cx) * full[0], (v * fy + cy) * full[1]])


SENSORS = {(640, 576): ((1024, 1024), (192, 180)), (320, 288): ((512, 512), (96, 90))}  # full image, crop


@pytest.mark.parametrize("depth_size", SENSORS)
@pytest.mark.parametrize(
    ("size", "full", "crop"),
    [
        ((1280, 720), (1280, 960), (0, 120)), ((1920, 1080), (1920, 1440), (0, 180)),
        ((2048, 1536), (2048, 1536), (0, 0)), ((3840, 2160), (3840, 2880), (0, 360)),
        ((4096, 3072), (4096, 3072), (0, 0)),
    ],
)  # fmt: skip
def test_the_cameras_are_crops_of_their_sensors_and_where_depth_lies_in_colour(depth_size, size, full, crop):
    values = calibration(depth_turn=st.geometry.exp([0.001, 0.002, 0.003, 0.01, 0.02, -0.01]))
    depth, color = values["CalibrationInformation"]["Cameras"]
    cameras = azure_cameras(values, depth_size, size)
    p_depth = np.array([0.1, 0.05, 0.8])
    sensor, corner = SENSORS[depth_size]
    wanted = sdk_project(p_depth, depth, sensor) - corner - 0.5
    np.testing.assert_allclose(cameras.depth.project(p_depth), wanted, atol=1e-9)
    assert (cameras.depth.width, cameras.depth.height) == depth_size
    T_color, T_depth = np.eye(4), np.eye(4)
    for T, one in ((T_color, color), (T_depth, depth)):
        T[:3, :3], T[:3, 3] = np.reshape(one["Rt"]["Rotation"], (3, 3)), one["Rt"]["Translation"]
    p_ref = np.linalg.solve(T_depth, [*p_depth, 1])
    wanted = sdk_project((T_color @ p_ref)[:3], color, full) - crop - 0.5
    np.testing.assert_allclose(cameras.project_to_color(p_depth), wanted, atol=1e-6)


def changed(**of_depth):
    values = calibration()
    values["CalibrationInformation"]["Cameras"][0]["Intrinsics"].update(of_depth)
    return json.dumps(values)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"attachment": "", "names": ("COLOR", "DEPTH")}, "no attachment calibration.json"),
        ({"attachment": "{}"}, "with calibration.json, .*the field 'CalibrationInformation' is missing"),
        ({"attachment": "{"}, "calibration.json"),
        ({"names": ("COLOR", "IR")}, "no depth track, which the trackers require; its tracks: COLOR, IR"),
        (
            {"attachment": changed(ModelType="CALIBRATION_LensDistortionModelRational6KT")},
            "lens model CALIBRATION_LensDistortionModelRational6KT, expected",
        ),
    ],
)
def test_what_a_recording_lacks_is_named(tmp_path, options, words):
    write(tmp_path / "kinect.mkv", count=1, **options)
    with pytest.raises(ValueError, match=words) as caught:
        st.open_sequence(tmp_path / "kinect.mkv")
    assert "\n" not in str(caught.value)


def test_sizes_of_no_mode_are_refused_with_those_there_are():
    with pytest.raises(ValueError, match="depth of 640 x 480 pixels, expected one of 320 x 288, 640 x 576"):
        azure_cameras(calibration(), (640, 480), None)
    with pytest.raises(ValueError, match="colour of 640 x 480 pixels, expected one of 1280 x 720"):
        azure_cameras(calibration(), (640, 576), (640, 480))


@pytest.mark.parametrize("share", [0.35, 0.6, 0.93])
def test_a_cut_file_without_colour_has_the_frames_before_the_cut(tmp_path, share):
    write(tmp_path / "whole.mkv", count=6, names=("DEPTH",))
    content = (tmp_path / "whole.mkv").read_bytes()
    (tmp_path / "cut.mkv").write_bytes(content[: int(share * len(content))])
    with st.open_sequence(tmp_path / "whole.mkv") as whole, st.open_sequence(tmp_path / "cut.mkv") as cut:
        assert 1 <= len(cut) < len(whole) == 6
        assert (whole.camera.color, whole[0].color) == (None, None)
        for i in range(len(cut)):
            np.testing.assert_array_equal(cut[i].depth, whole[i].depth)


def test_other_videos_are_not_taken_for_a_recording(tmp_path):
    write(tmp_path / "plain.mkv", count=1, names=("COLOR",), attachment="")
    content = (tmp_path / "plain.mkv").read_bytes().replace(b"K4A_", b"X4X_")
    (tmp_path / "plain.mkv").write_bytes(content)
    with pytest.raises(ValueError, match=r"unknown layout; known are: .*azure"):
        st.open_sequence(tmp_path / "plain.mkv")
