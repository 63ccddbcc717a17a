# SPDX-License-Identifier: MIT
import itertools
import json
import struct
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
from measured_memory import peak_bytes

import sdftrack as st
from sdftrack.io import datasets
from sdftrack.io import frames as image_io
from sdftrack.io.datasets import tum
from sdftrack.testing import assert_pose_close

CAMERA = st.Camera(60.0, 61.0, 31.0, 23.5, 64, 48)
# Half a unit of each layout's depth images: 0.1 mm, 0.2 mm, 1 mm.
HALF_UNIT_M = {"bop": 0.00005, "tum": 0.0001, "open3d": 0.0005}
POSE_TOLERANCE = 1e-7  # text files with nine digits
CUBE = st.Mesh(
    0.05 * np.array([[x, y, z] for x in (-1.0, 1) for y in (-1, 1) for z in (-1, 1)]),
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]],
)  # fmt: skip


def _pose(i: int, k: int = 0) -> np.ndarray:
    return st.geometry.pose([0.1 * i, 0.2, -0.3 * k], [0.01 * i, -0.02 * k, 0.8])


def _frame(i: int, **kwargs) -> st.Frame:
    rng = np.random.default_rng(i)
    depth = rng.uniform(0.7, 0.9, CAMERA.shape).astype(np.float32)
    depth[:, :3] = 0
    color = rng.integers(0, 256, (*CAMERA.shape, 3), np.uint8)
    return st.Frame(depth, color, timestamp=10 + i / 30, **kwargs)


def _sequence(n: int = 4, objects: int = 1) -> st.Sequence:
    truth = {i: {k: _pose(i, k) for k in range(objects)} for i in range(n)}
    return st.Sequence([_frame(i) for i in range(n)], CAMERA, truth, {5: CUBE})


def test_bop_holds_several_objects_masks_and_cameras(tmp_path):
    masks = {k: np.arange(64)[None, :] // 32 == np.full((48, 1), k) for k in range(2)}
    half = st.Camera(50.0, 50.0, 30.0, 20.0, 64, 48)
    frames = [_frame(0), _frame(1, camera=half)]
    truth = {0: {0: _pose(0), 1: _pose(0, 1)}, 1: {1: _pose(1, 1)}}
    whole = st.Sequence(
        frames, CAMERA, truth, {7: CUBE}, objects=[7, 7], ids=[4, 9],
        masks=lambda i: masks if i == 0 else {1: masks[1]},
    )  # fmt: skip
    st.save_sequence(tmp_path / "s", whole)
    seq = st.open_sequence(tmp_path / "s")
    assert seq.objects == [7, 7]
    assert seq.ids == [4, 9]
    assert seq[0].camera is None
    assert seq[1].camera == half
    assert seq.ground_truth.keys() == {0, 1}
    assert seq.ground_truth[1].keys() == {1}  # the second instance keeps its number where the first is absent
    assert_pose_close(seq.ground_truth[1][1], _pose(1, 1), POSE_TOLERANCE, POSE_TOLERANCE)
    for k in range(2):
        np.testing.assert_array_equal(seq.masks(0)[k], masks[k])
    assert seq.masks(1).keys() == {1}


def test_the_unit_of_a_bop_scene_is_millimetres_and_a_wrong_one_shows_when_it_is_opened(tmp_path):
    st.save_sequence(tmp_path, _sequence())
    path = tmp_path / "scene_camera.json"
    cameras = json.loads(path.read_text())
    units = image_io.read_depth_units(tmp_path / "depth/000000.png")
    scale_m = cameras["0"]["depth_scale"] / 1000
    np.testing.assert_allclose(st.open_sequence(tmp_path)[0].depth, units * scale_m, rtol=1e-6)
    np.testing.assert_allclose(units * scale_m, _sequence()[0].depth, atol=HALF_UNIT_M["bop"])
    cameras["0"]["depth_scale"] *= 1000
    path.write_text(json.dumps(cameras))
    with pytest.raises(ValueError, match=r"depth/000000\.png.*median"):
        st.open_sequence(tmp_path)


def test_poses_of_a_bop_scene_in_metres_are_recognised_and_told_once(tmp_path):
    st.save_sequence(tmp_path, _sequence())
    truth = st.open_sequence(tmp_path).ground_truth
    path = tmp_path / "scene_gt.json"
    listed = json.loads(path.read_text())
    for entry in itertools.chain(*listed.values()):
        entry["cam_t_m2c"] = [x / 1000 for x in entry["cam_t_m2c"]]
    path.write_text(json.dumps(listed))
    with pytest.warns(UserWarning, match=r"scene_gt\.json: read as metres") as told:
        found = st.open_sequence(tmp_path).ground_truth
    assert len(told) == 1
    for i, poses in truth.items():
        for k, T in poses.items():
            np.testing.assert_allclose(found[i][k], T, atol=1e-9)


def _with_a_huge_header(data: bytes) -> bytes:
    header = b"IHDR" + struct.pack(">II", 2**31 - 1, 2**31 - 1) + data[24:29]
    return data[:12] + header + struct.pack(">I", zlib.crc32(header)) + data[33:]


DAMAGE = {
    "cut": lambda path, data: path.write_bytes(data[: len(data) // 2]),
    "empty": lambda path, data: path.write_bytes(b""),
    "remove": lambda path, data: path.unlink(),
    "small": lambda path, data: image_io.write_depth_units(path, np.full((24, 32), 8000, np.uint16)),
    "eight bit": lambda path, data: image_io.write_mask(path, np.ones(CAMERA.shape, bool)),
    "huge header": lambda path, data: path.write_bytes(_with_a_huge_header(data)),
    "small color": lambda path, data: image_io.write_color(path, np.zeros((24, 32, 3), np.uint8)),
}


@pytest.mark.parametrize(
    ("file", "damage", "reason"),
    [
        ("depth/000001.png", "cut", "truncated"),
        ("depth/000001.png", "empty", "empty"),
        ("depth/000001.png", "remove", "missing"),
        ("depth/000001.png", "small", "64 x 48"),
        ("depth/000001.png", "eight bit", "16-bit"),
        ("depth/000001.png", "huge header", "2147483647 x 2147483647 pixels, but the camera has 64 x 48"),
        ("rgb/000001.png", "huge header", "2147483647 x 2147483647 pixels, but the sequence has 64 x 48"),
        ("rgb/000001.png", "small color", "64 x 48"),
    ],
)
def test_a_bad_image_in_the_middle_is_one_bad_frame(tmp_path, file, damage, reason, capfd):
    st.save_sequence(tmp_path / "s", _sequence())
    path = tmp_path / "s" / file
    DAMAGE[damage](path, path.read_bytes())
    seq = st.open_sequence(tmp_path / "s")
    frame = seq[1]
    assert (frame.depth, frame.color, frame.index) == (None, None, 1)
    assert reason in frame.error
    assert frame.error.startswith(file)
    assert [f.error == "" for f in seq] == [True, False, True, True]
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize("layout", ["bop", "tum", "open3d"])
@pytest.mark.parametrize(
    ("spoil", "words"),
    [(Path.unlink, "depth"), (lambda file: file.write_bytes(b"x"), "not a readable image")],
)
def test_a_sequence_without_depth_that_can_be_read_is_refused(tmp_path, layout, spoil, words):
    st.save_sequence(tmp_path / "s", _sequence(), layout=layout)
    for file in (tmp_path / "s" / "depth").iterdir():
        spoil(file)
    with pytest.raises(ValueError, match=words):
        st.open_sequence(tmp_path / "s", layout=layout)


def test_unknown_folders_get_the_list_of_layouts(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such folder"):
        st.open_sequence(tmp_path / "absent")
    with pytest.raises(ValueError, match=r"unknown layout.*bop.*k1.*tum.*folders.*open3d"):
        st.open_sequence(tmp_path)
    with pytest.raises(ValueError, match="one of bop"):
        st.open_sequence(tmp_path, layout="kitti")
    (tmp_path / "notes.txt").write_bytes(b"")
    with pytest.raises(ValueError, match="unknown layout"):
        st.open_sequence(tmp_path / "notes.txt")
    st.save_sequence(tmp_path / "000007", _sequence())
    with pytest.raises(ValueError, match="000007 is one"):
        st.open_sequence(tmp_path)


def test_a_reader_of_files_is_registered_with_its_options(tmp_path, monkeypatch):
    layouts = datasets.LAYOUTS.copy()
    monkeypatch.setattr(datasets, "LAYOUTS", layouts)
    monkeypatch.setattr(sys.modules["sdftrack.io.datasets.sequence"], "LAYOUTS", layouts)
    closed = []

    @datasets.register("tape", ".tape", lambda path: path.suffix == ".tape", options=("topic",))
    def open_tape(path, topic="depth"):
        seq = _sequence()
        return st.Sequence(list(seq), seq.camera, name=topic, close=lambda: closed.append(path))

    tape, other = tmp_path / "a.tape", tmp_path / "a.txt"
    tape.touch()
    other.touch()
    with st.open_sequence(tape, topic="far") as seq:
        assert seq.name == "far"
        seq[1:].close()
    assert closed == [tape]  # once
    assert st.open_sequence(tape, layout="tape", topic=None).name == "depth"
    with pytest.raises(ValueError, match="speed: not an option of layout tape, whose options are: topic"):
        st.open_sequence(tape, speed=2)
    with pytest.raises(ValueError, match=r"expected a recording of layout tape \(\.tape\), got another file"):
        st.open_sequence(other, layout="tape")
    with pytest.raises(ValueError, match=r"a\.tape is one"):
        st.open_sequence(tmp_path)


@pytest.mark.parametrize("layout", ["bop", "tum", "open3d", "k1", "folders"])
def test_a_layout_by_name_says_what_is_missing(tmp_path, layout):
    with pytest.raises((FileNotFoundError, ValueError), match=r"needs|no depth"):
        st.open_sequence(tmp_path, layout=layout)


def test_slices_are_lazy_sequences():
    whole = _sequence(6, objects=2)
    part = whole[1:6:2]
    assert isinstance(part, st.Sequence)
    assert len(part) == 3
    assert part.ids == [1, 3, 5]
    assert [f.index for f in part] == [1, 3, 5]
    assert part[-1] == whole[5]
    np.testing.assert_array_equal(part.ground_truth[2][1], whole.ground_truth[5][1])
    assert part[1:][0].index == 3
    assert part.objects == whole.objects
    with pytest.raises(IndexError):
        part[3]
    with pytest.raises(ValueError, match="at least one"):
        whole[4:2]


def test_opening_reads_no_more_images_than_it_must(tmp_path, monkeypatch):
    st.save_sequence(tmp_path / "s", _sequence(8))
    read = []
    content = image_io._content
    monkeypatch.setattr(
        image_io, "_content", lambda path, name: (read.append(path.name), content(path, name))[1]
    )
    seq = st.open_sequence(tmp_path / "s")[4:]
    assert set(read) == {"000000.png"}
    read.clear()
    assert seq[1].index == 5
    assert set(read) == {"000005.png"}


def test_a_sequence_in_memory_is_checked():
    frame = _frame(0)
    with pytest.raises(ValueError, match="at least one"):
        st.Sequence([], CAMERA)
    with pytest.raises(TypeError, match=r"frames\[1\]"):
        st.Sequence([frame, frame.depth], CAMERA)
    with pytest.raises(TypeError, match="camera"):
        st.Sequence([frame], CAMERA.K)
    with pytest.raises(ValueError, match=r"\(1, 4, 4\)"):
        st.Sequence([frame], CAMERA, np.eye(4))
    with pytest.raises(ValueError, match=r"ground_truth\[0\]\[0\]"):
        st.Sequence([frame], CAMERA, {0: {0: 2 * np.eye(4)}})
    with pytest.raises(ValueError, match="frame numbers"):
        st.Sequence([frame], CAMERA, {1: {0: np.eye(4)}})
    with pytest.raises(ValueError, match="objects"):
        st.Sequence([frame], CAMERA, {0: {1: np.eye(4)}}, objects=[1])
    assert st.Sequence(iter([frame]), CAMERA, np.eye(4)[None]).ground_truth[0].keys() == {0}


def test_saving_is_whole_or_not_at_all(tmp_path):
    far = st.Frame(np.full(CAMERA.shape, 14.0, np.float32))
    seq = st.Sequence([_frame(0), far], CAMERA)
    with pytest.raises(ValueError, match="16 bits"):
        st.save_sequence(tmp_path / "s", seq, layout="tum")
    assert not list(tmp_path.iterdir())
    (tmp_path / "s").mkdir()
    st.save_sequence(tmp_path / "s", seq)  # an empty folder is as good as none
    assert st.open_sequence(tmp_path / "s")[1].depth.max() == pytest.approx(14, abs=0.001)
    with pytest.raises(FileExistsError, match="empty folder"):
        st.save_sequence(tmp_path / "s", seq)


def test_what_a_layout_cannot_hold_is_refused(tmp_path):
    for layout in ("tum", "open3d"):
        with pytest.raises(ValueError, match="one object"):
            st.save_sequence(tmp_path / "s", _sequence(objects=2), layout=layout)
    lens = st.Camera(60, 61, 31, 23.5, 64, 48, (0.1, 0, 0, 0))
    for layout in ("bop", "open3d"):
        with pytest.raises(ValueError, match="lens"):
            st.save_sequence(tmp_path / "s", st.Sequence([_frame(0)], lens), layout=layout)
    st.save_sequence(tmp_path / "s", st.Sequence([_frame(0)], lens), layout="tum")
    assert st.open_sequence(tmp_path / "s").camera.depth == lens
    with pytest.raises(ValueError, match="layout"):
        st.save_sequence(tmp_path / "t", _sequence(), layout="k1")


def test_colour_that_is_not_aligned_is_left_out_of_other_layouts(tmp_path):
    rig = st.RGBDCamera(CAMERA, CAMERA, T_color_depth=st.geometry.pose(t_m=[0.02, 0, 0]))
    with pytest.warns(UserWarning, match="aligned"):
        st.save_sequence(tmp_path / "s", st.Sequence([_frame(0)], rig))
    assert st.open_sequence(tmp_path / "s")[0].color is None


def test_a_bad_frame_survives_being_saved(tmp_path):
    seq = st.Sequence([_frame(0), st.Frame.unreadable("broken"), _frame(2)], CAMERA, {2: {0: _pose(2)}})
    first = st.Sequence([seq[1], seq[0]], CAMERA)
    st.save_sequence(tmp_path / "first", first)
    assert [f.error == "" for f in st.open_sequence(tmp_path / "first")] == [False, True]
    st.save_sequence(tmp_path / "bop", seq)
    back = st.open_sequence(tmp_path / "bop")
    assert [f.error == "" for f in back] == [True, False, True]
    for layout in ("tum", "open3d"):
        st.save_sequence(tmp_path / layout, seq, layout=layout)
        back = st.open_sequence(tmp_path / layout)  # which omits it, as documented
        assert len(back) == 2
        for frame, own in zip(back, (seq[0], seq[2]), strict=True):
            np.testing.assert_allclose(frame.depth, own.depth, atol=1.01 * HALF_UNIT_M[layout])
        assert_pose_close(back.ground_truth[1][0], _pose(2), POSE_TOLERANCE, POSE_TOLERANCE)


def test_tum_images_are_joined_by_time(tmp_path):
    st.save_sequence(tmp_path / "s", _sequence(), layout="tum")
    (tmp_path / "s" / "camera.json").unlink()
    lines = (tmp_path / "s" / "rgb.txt").read_text().splitlines()
    moved = [lines[0]] + [
        f"{float(s.split()[0]) + (0.015 if i else 0.5):.6f} {s.split()[1]}" for i, s in enumerate(lines[1:])
    ]
    (tmp_path / "s" / "rgb.txt").write_text("\n".join(moved))
    with pytest.raises(ValueError, match=r"camera\.json"):  # not the data set's 640 x 480
        st.open_sequence(tmp_path / "s")
    CAMERA.save(tmp_path / "s" / "camera.json")
    seq = st.open_sequence(tmp_path / "s")
    assert seq[0].color is None  # half a second off
    np.testing.assert_array_equal(seq[1].color, _sequence()[1].color)


def write_k1(root: Path, color_size: tuple[int, int], mapping: bool) -> None:
    for name in ("depth", "rgb", "mask"):
        (root / name).mkdir(parents=True)
    K = {"fx": 60.0, "fy": 61.0, "cx": 31.0, "cy": 23.5}
    camera = {"image_size": [64, 48], "depth_scale_m": 0.001, "K_depth": K}
    if mapping:
        camera["depth_to_color_Pq"] = {"P": np.eye(3).tolist(), "q": [1.0, 0, 0]}
    (root / "camera.json").write_text(json.dumps(camera))
    mask = np.zeros(CAMERA.shape, bool)
    mask[:40, 36:62] = mask[:44, 2:26] = True
    mask[45:, 60:] = True
    for i in range(2):
        image_io.write_depth_units(root / "depth" / f"{i:06d}.png", np.full(CAMERA.shape, 800, np.uint16))
        image_io.write_color(root / "rgb" / f"{i:06d}.png", np.full((*color_size[::-1], 3), 7, np.uint8))
    image_io.write_mask(root / "mask" / "000001.png", mask)
    poses = {"frames": {"1": {str(k + 1): {"T_cam_obj": _pose(1, k).tolist()} for k in range(2)}}}
    (root / "poses_init.json").write_text(json.dumps(poses))
    CUBE.save(root / "cube.ply")


def _nearest_of_all(times, wanted):
    gap = np.abs(times[None, :] - wanted[:, None])
    return [int(j) if gap[i, j] <= 0.02 else None for i, j in enumerate(gap.argmin(axis=1))]


@pytest.mark.parametrize("seed", range(20))
def test_the_nearest_time_is_that_of_a_comparison_with_all(seed):
    """Times that repeat, do not ascend, and lie at equal distances."""
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, 40, 2)
    times = rng.integers(0, 60, n) / 128.0 + (1.3e9 if seed % 2 else 0.0)
    wanted = rng.integers(-5, 130, m) / 256.0 + (1.3e9 if seed % 2 else 0.0)
    found = tum._nearest(times, wanted)
    assert found == _nearest_of_all(times, wanted)


def test_times_of_long_recordings_are_joined_in_little_memory():
    """Compared with each other, they would take 80 GB."""
    before = "import numpy as np; from sdftrack.io.datasets import tum; times = np.arange(100_000) / 30"
    assert peak_bytes("tum._nearest(times, times + 0.01)", before) < 50e6


@pytest.mark.parametrize("start", ["nan depth", "inf depth", "1e999 depth", f"9 {'9' * 300}"])
def test_a_line_without_a_time_or_with_what_is_no_name_is_refused(tmp_path, start):
    st.save_sequence(tmp_path / "s", _sequence(), layout="tum")
    path = tmp_path / "s" / "depth.txt"
    path.write_text(path.read_text() + f"{start}/a.png\n")
    with pytest.raises(
        ValueError, match=rf"depth\.txt, line \d+: expected 'timestamp file', got '{start[:9]}"
    ):
        st.open_sequence(tmp_path / "s")


def test_k1_has_its_mapping_masks_and_two_objects_of_one_mesh(tmp_path):
    write_k1(tmp_path / "s", (80, 60), mapping=True)
    seq = st.open_sequence(tmp_path / "s")
    assert seq.layout == "k1"
    assert seq.camera.projective[1].tolist() == [1, 0, 0]
    assert seq[0].color.shape == (60, 80, 3)
    assert seq[0].depth[0, 0] == pytest.approx(0.8)
    assert seq.objects == [1, 1]
    assert list(seq.models) == [1]
    np.testing.assert_allclose(seq.models[1].vertices, CUBE.vertices, atol=1e-6)
    assert seq.ground_truth.keys() == {1}
    assert_pose_close(seq.ground_truth[1][1], _pose(1, 1), 1e-9, 1e-9)
    assert seq.masks(0) == {}
    masks = seq.masks(1)
    assert masks.keys() == {0, 1}  # the small patch is no object
    assert masks[0][0, 2]
    assert masks[1][0, 40]


def test_k1_colour_of_another_size_needs_a_mapping(tmp_path):
    write_k1(tmp_path / "a", (80, 60), mapping=False)
    with pytest.warns(UserWarning, match="80 x 60"):
        seq = st.open_sequence(tmp_path / "a")
    assert seq[0].color is None
    write_k1(tmp_path / "b", (64, 48), mapping=False)
    seq = st.open_sequence(tmp_path / "b")
    assert seq.camera.aligned
    assert seq[0].color is not None


def test_plain_folders_are_read(tmp_path):
    for name in ("depth", "rgb", "masks", "annotated_poses", "mesh"):
        (tmp_path / name).mkdir()
    np.savetxt(tmp_path / "cam_K.txt", CAMERA.K)
    for i in (3, 4, 10):
        image_io.write_depth_units(tmp_path / "depth" / f"{i}.png", np.full(CAMERA.shape, 700 + i, np.uint16))
        image_io.write_color(tmp_path / "rgb" / f"{i}.png", np.zeros((*CAMERA.shape, 3), np.uint8))
    image_io.write_mask(tmp_path / "masks" / "3.png", np.eye(48, 64, dtype=bool))
    np.savetxt(tmp_path / "annotated_poses" / "4.txt", _pose(4))
    CUBE.save(tmp_path / "mesh" / "cube.obj")
    seq = st.open_sequence(tmp_path)
    assert seq.layout == "folders"
    assert seq.ids == [3, 4, 10]  # by number, not by letters
    assert seq[2].depth[0, 0] == pytest.approx(0.710)
    assert seq[0].color.shape == (48, 64, 3)
    assert seq.masks(0)[0].sum() == 48
    assert seq.masks(1) == {}
    assert_pose_close(seq.ground_truth[1][0], _pose(4), 1e-12, 1e-12)
    assert seq.objects == [1]
    assert len(seq.models[1].faces) == 12


def test_a_digit_that_is_no_number_is_a_name_like_any_other(tmp_path):
    for name in ("2.png", "10.png", "\u00b2.png"):
        (tmp_path / name).touch()
    assert [p.name for p in datasets.images.image_files(tmp_path)] == ["2.png", "10.png", "\u00b2.png"]


def test_redwood_files_are_paired_in_order(tmp_path):
    for name in ("depth", "rgb"):
        (tmp_path / name).mkdir()
    for i in range(2):
        units = np.full((480, 640), 900 + i, np.uint16)
        image_io.write_depth_units(tmp_path / "depth" / f"{i + 1:07d}-{33333 * i:012d}.png", units)
        image_io.write_color(
            tmp_path / "rgb" / f"{i + 1:07d}-{33333 * i + 12000:012d}.jpg",
            np.full((480, 640, 3), i, np.uint8),
        )
    with pytest.warns(UserWarning, match="PrimeSense"):
        seq = st.open_sequence(tmp_path)
    assert seq.layout == "open3d"
    assert seq[1].timestamp == pytest.approx(0.033333)
    assert seq[1].depth[0, 0] == pytest.approx(0.901)
    assert seq[1].color.max() == 1
    assert seq.camera.depth == st.Camera(525, 525, 319.5, 239.5, 640, 480)


# Frames that a layout cannot tell apart
@pytest.mark.parametrize("ids", [[4, 4, 5], [4, 6, 5], [-1, 0, 1]], ids=str)
def test_numbers_that_name_one_file_twice_are_refused(tmp_path, ids):
    seq = st.Sequence([_frame(i) for i in range(3)], CAMERA, ids=ids)
    with pytest.raises(ValueError, match="im_id: expected numbers from 0 on that increase"):
        st.save_sequence(tmp_path / "s", seq)
    assert not list(tmp_path.iterdir())
    st.save_sequence(tmp_path / "s", seq, layout="open3d")  # has no use for them
    assert len(st.open_sequence(tmp_path / "s")) == 3


@pytest.mark.filterwarnings("ignore:.*the time goes back")
@pytest.mark.parametrize("times", [[1.0, 2.0, 1.5], [1.0, 2.0, 1.0], [1.0, 1.0 + 4e-7, 2.0]], ids=str)
def test_times_that_name_one_file_twice_are_refused(tmp_path, times):
    frames = [st.Frame(_frame(i).depth, timestamp=t) for i, t in enumerate(times)]
    with pytest.raises(ValueError, match="timestamp: expected times that increase"):
        st.save_sequence(tmp_path / "s", st.Sequence(frames, CAMERA), layout="tum")
    st.save_sequence(tmp_path / "s", st.Sequence(frames, CAMERA), layout="bop")
    assert [f.timestamp for f in st.open_sequence(tmp_path / "s")] == times
    between = [frames[0], st.Frame.unreadable("lost", timestamp=1.5), frames[0]]  # a time is known over it
    with pytest.raises(ValueError, match="timestamp: expected times that increase"):
        st.save_sequence(tmp_path / "t", st.Sequence(between, CAMERA), layout="tum")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("cam_t_m2c", [700.0]), ("cam_t_m2c", 700.0), ("obj_id", 7.9), ("obj_id", True),
        ("obj_id", float("nan")), ("instance", 0.5),
    ],
)  # fmt: skip
def test_numbers_of_a_pose_are_neither_spread_nor_rounded(tmp_path, key, value):
    st.save_sequence(tmp_path / "s", _sequence(1))
    path = tmp_path / "s" / "scene_gt.json"
    listed = json.loads(path.read_text())
    listed["0"][0][key] = value
    path.write_text(json.dumps(listed))
    with pytest.raises(
        ValueError, match=r"scene_gt.json, image 0, entry 0: expected obj_id \(a whole number\)"
    ):
        st.open_sequence(tmp_path / "s")


def test_an_instance_that_is_there_twice_is_refused(tmp_path):
    st.save_sequence(tmp_path / "s", _sequence(1))
    path = tmp_path / "s" / "scene_gt.json"
    entry = json.loads(path.read_text())["0"][0] | {"instance": 0}
    path.write_text(json.dumps({"0": [entry, entry]}))
    with pytest.raises(ValueError, match="instance 0 is there twice"):
        st.open_sequence(tmp_path / "s")
