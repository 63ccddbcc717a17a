# SPDX-License-Identifier: MIT
"""Data sets of LeRobot v3 with depth: written here as its documentation says, read, and given back with poses."""

import json

import numpy as np
import pytest

import sdftrack as st
from sdftrack.io.datasets.lerobot import write_poses

av, arrow, parquet = (pytest.importorskip(n) for n in ("av", "pyarrow", "pyarrow.parquet"))

CAMERA = st.Camera(60.0, 61.0, 63.5, 47.5, 128, 96)
DEPTH, COLOR = "observation.images.top_depth", "observation.images.top"
FPS, EPISODES = 10, (7, 9)  # frames of the episodes, which share their files
LOW, HIGH, SHIFT = 0.1, 5.0, 3.5


def depth_m(n):
    """Of image n of the files: a ramp, with pixels that were not measured."""
    z = 0.5 + 0.05 * n + np.linspace(0, 2, 128)[None, :] * np.ones((96, 1))
    z[:8] = 0
    return z


def codes(z, log):
    """LeRobot's quantisation: logarithmic, or linear."""
    value = (
        np.log((z + SHIFT) / (LOW + SHIFT)) / np.log((HIGH + SHIFT) / (LOW + SHIFT))
        if log
        else (z - LOW) / (HIGH - LOW)
    )
    return np.rint(4095 * value).clip(0, 4095).astype(np.uint16)


def video(path, images, codec, form, **options):
    path.parent.mkdir(parents=True)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=FPS, options=options)
        stream.width, stream.height, stream.pix_fmt = 128, 96, form
        stream.codec_context.gop_size = 2
        for image in images:
            given = "gray12le" if image.dtype == np.uint16 else "rgb24"
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format=given)))
        container.mux(stream.encode())


@pytest.fixture(params=["log", "linear", "tiff mm", "tiff m"])
def dataset(request, tmp_path):
    kind, root, total = request.param, tmp_path / "set", sum(EPISODES)
    stored = kind.startswith("tiff")
    info = {} if stored else {
        "video.depth_min": LOW, "video.depth_max": HIGH, "video.shift": SHIFT, "video.use_log": kind == "log",
    }  # fmt: skip
    features = {
        DEPTH: {
            "dtype": "image" if stored else "video",
            "shape": [96, 128, 1],
            "info": {"is_depth_map": True, **info},
        },
        COLOR: {"dtype": "video", "shape": [96, 128, 3], "info": {"is_depth_map": False}},
        "timestamp": {"dtype": "float32", "shape": [1]},
    }
    (root / "meta").mkdir(parents=True)
    numbers = "chunk-{chunk_index:03d}/file-{file_index:03d}"
    paths = {"data_path": f"data/{numbers}.parquet", "video_path": "videos/{video_key}/" + f"{numbers}.mp4"}
    text = json.dumps({"codebase_version": "v3.0", "fps": FPS, "features": features, **paths})
    (root / "meta/info.json").write_text(text)
    frames = [(e, i) for e, count in enumerate(EPISODES) for i in range(count)]
    columns = {
        "timestamp": arrow.array([i / FPS for _, i in frames], arrow.float32()),
        "frame_index": [i for _, i in frames], "episode_index": [e for e, _ in frames], "index": range(total),
    }  # fmt: skip
    if stored:
        import cv2

        scaled = [depth_m(n) for n in range(total)]
        images = [
            z.astype(np.float32) if kind == "tiff m" else np.rint(1000 * z).astype(np.uint16) for z in scaled
        ]
        columns[DEPTH] = [{"bytes": cv2.imencode(".tiff", i)[1].tobytes(), "path": None} for i in images]
    else:
        images = [codes(depth_m(n), kind == "log") for n in range(total)]
        lossless = {"x265-params": "lossless=1:log-level=none"}
        video(root / f"videos/{DEPTH}/chunk-000/file-000.mp4", images, "libx265", "gray12le", **lossless)
    pictures = [np.full((96, 128, 3), 10 * n, np.uint8) for n in range(total)]
    video(root / f"videos/{COLOR}/chunk-000/file-000.mp4", pictures, "libx264", "yuv420p", crf="1")
    (root / "data/chunk-000").mkdir(parents=True)
    parquet.write_table(arrow.table(columns), root / "data/chunk-000/file-000.parquet")
    rows = [
        {"episode_index": e, "length": count, "data/chunk_index": 0, "data/file_index": 0}
        | {f"videos/{k}/{n}": 0 for k in (DEPTH, COLOR) for n in ("chunk_index", "file_index")}
        | {f"videos/{k}/from_timestamp": sum(EPISODES[:e]) / FPS for k in (DEPTH, COLOR)}
        for e, count in enumerate(EPISODES)
    ]
    (root / "meta/episodes/chunk-000").mkdir(parents=True)
    parquet.write_table(arrow.Table.from_pylist(rows), root / "meta/episodes/chunk-000/file-000.parquet")
    CAMERA.save(root / "camera.json")
    return root, kind


@pytest.mark.parametrize("episode", [0, 1])
def test_frames_of_an_episode_come_in_any_order(dataset, episode):
    root, kind = dataset
    step = {
        "log": np.log((HIGH + SHIFT) / (LOW + SHIFT)) * (3.4 + SHIFT) / 4095,
        "linear": (HIGH - LOW) / 4095,
    }
    with st.open_sequence(root, episode=episode) as seq:
        assert (seq.layout, len(seq), seq.camera.depth) == ("lerobot", EPISODES[episode], CAMERA)
        assert (seq.quantization is not None) == (kind in step)
        for i in (0, 1, 2, 6, 5, 0, 3):
            frame, n = seq[i], i + sum(EPISODES[:episode])
            assert not frame.error
            assert (frame.depth[:8] == 0).all()
            assert np.abs(frame.depth - depth_m(n))[8:].max() <= 0.501 * step.get(kind, 0.001) + 1e-6
            assert abs(float(frame.color.mean()) - 10 * n) < 3
            assert frame.timestamp == pytest.approx(i / FPS, abs=1e-6)
        if seq.quantization is not None:
            sensor = st.SensorModel(noise_m=0.001).quantized(*seq.quantization)
            least = np.hypot(
                0.001,
                step[kind] / np.sqrt(12) * (2 + SHIFT) / (3.4 + SHIFT)
                if kind == "log"
                else step[kind] / np.sqrt(12),
            )
            assert least <= sensor.noise(2.0) < 1.3 * least


@pytest.mark.parametrize("episode", [0, 1])
def test_the_commands_take_an_episode(dataset, tmp_path, episode, capsys):
    from sdftrack.cli.app import run

    to = ["--to", "tum", "--out", str(tmp_path / "tum")]
    assert run(["convert", str(dataset[0]), "--episode", str(episode), *to, "--quiet"]) == 0
    assert len(st.open_sequence(tmp_path / "tum")) == EPISODES[episode]
    assert (
        run(["convert", str(tmp_path / "tum"), "--episode", "0", "--to", "bop", "--out", str(tmp_path / "b")])
        == 1
    )
    assert "episode: not an option of layout tum" in capsys.readouterr().err


def test_what_is_missing_is_said_in_one_line(dataset):
    root, _ = dataset
    with pytest.raises(ValueError, match=r"expected one of the 2 episodes of .*, 0..1, got 5"):
        st.open_sequence(root, episode=5)
    with pytest.raises(ValueError, match="depth_key: expected one of the depth features"):
        st.open_sequence(root, depth_key=COLOR)
    (root / "camera.json").unlink()
    with pytest.raises(ValueError, match=r"LeRobot stores no intrinsics; put a camera\.json"):
        st.open_sequence(root)
    text = (root / "meta/info.json").read_text()
    (root / "meta/info.json").write_text(text.replace("v3.0", "v2.1"))
    with pytest.raises(ValueError, match=r"expected codebase_version v3, got 'v2\.1'"):
        st.open_sequence(root)


def test_poses_are_features_of_a_copy(dataset, tmp_path):
    root, _ = dataset
    poses = np.tile(np.eye(4), (EPISODES[1], 1, 1))
    poses[:, :3, 3] = (
        np.arange(3 * EPISODES[1]).reshape(-1, 3) + 1e-9
    )  # whole numbers of metres and a nanometre
    poses[2] = np.nan
    before = (root / "data/chunk-000/file-000.parquet").read_bytes()
    names = write_poses(root, tmp_path / "out", {1: {"cup": (poses, np.ones(EPISODES[1]))}})
    assert names == ["observation.pose.cup"]
    assert (root / "data/chunk-000/file-000.parquet").read_bytes() == before
    column = parquet.read_table(tmp_path / "out/data/chunk-000/file-000.parquet")[names[0]].to_pylist()
    assert np.isnan(column[: EPISODES[0]]).all()
    assert np.isnan(column[EPISODES[0] + 2]).all()
    assert column[EPISODES[0] + 1] == pytest.approx(
        [*(np.array([3, 4, 5]) + 1e-9), 0, 0, 0, 1, 1], rel=0, abs=1e-12
    )
    info = json.loads((tmp_path / "out/meta/info.json").read_text())
    assert info["features"][names[0]]["shape"] == [8]
    assert json.loads((tmp_path / "out/meta/stats.json").read_text())[names[0]]["count"] == [EPISODES[1] - 1]
    assert len(st.open_sequence(tmp_path / "out", episode=1)) == EPISODES[1]
    with pytest.raises(ValueError, match="out: expected a new folder"):
        write_poses(root, tmp_path / "out", {})
    with pytest.raises(ValueError, match=r"cup: expected poses \(9, 4, 4\)"):
        write_poses(root, tmp_path / "new", {1: {"cup": (poses[:3], np.ones(3))}})
    assert not (tmp_path / "new").exists()
