# SPDX-License-Identifier: MIT
"""Files of trackers, reconstructors, volumes, memories and models: round trips, damage, versions, memory."""

import json
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import box_scene
import numpy as np
import pytest
import reconstruction_scene
from measured_memory import peak_bytes

import sdftrack as st
from sdftrack._internal import saved_file
from sdftrack._internal.saved_file import FileKind
from sdftrack.tracking.saved_state import content_of as content_of_tracker

KIND = FileKind("sdftrack.Test", 2, "Test.save")
# Bytes between two places at which files are cut or changed.
STEPS = [pytest.param(97, marks=pytest.mark.slow), 4999]


class Saved(NamedTuple):
    """An object with files: how it is made, read, and compared."""

    make: Callable[[], Any]
    load: Callable[[Path], Any]
    writer: str
    same: Callable[[Any, Any], bool] = lambda a, b: bool(a == b)


def tracker() -> st.Tracker:
    shape = box_scene.box_volume(30)
    poses = [box_scene.pose_at(0, 0, 0.55), box_scene.pose_at(0.2, 0, 0.7)]
    out = st.Tracker([shape, shape], box_scene.CAMERA, threads=1, names=["a", "b"], sensor="kinect_v1")
    out.start(st.Frame(box_scene.depth_of(poses, 0), timestamp=0.0), poses=poses)
    out.track(st.Frame(box_scene.depth_of(poses, 1), timestamp=0.1))
    return out


def reconstructor() -> st.Reconstructor:
    camera = st.Camera(150.0, 150.0, 59.5, 44.5, 120, 90)
    turning = reconstruction_scene.turning(4, 6.0)
    seq = st.synth.sequence(reconstruction_scene.body(), 4, turning, 0.001, seed=4, camera=camera, threads=1)
    return reconstruction_scene.begun(3, seq, voxels=32)[0]


def volume() -> st.SDF:
    ball = st.SDF.sphere(0.03, voxels=16)
    colors = np.random.default_rng(0).integers(0, 256, (*ball.values.shape, 4), dtype=np.uint8)
    return st.SDF(ball.values, ball.voxel_size, ball.origin, colors)


def memory() -> Any:
    out = st.contour.ShapeMemory(capacity=8)
    y, x = np.mgrid[:64, :64]
    for k in range(8):
        out.learn(np.hypot(x - 32, (y - 32) * (1 + 0.1 * k)) < 20)
    return out


def model() -> st.LWPR:
    x = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    return st.LWPR(init_D=[30, 20.5], norm_in="auto").update(x, np.sin(3 * x[:, 0]))


def same_frames(a: st.Reconstructor, b: st.Reconstructor) -> bool:
    return all(np.array_equal(p.depth, q.depth) for p, q in zip(a._kept, b._kept, strict=True))


SAVED = {
    "tracker": Saved(tracker, st.Tracker.load, "Tracker.save", lambda a, b: bool(a._last == b._last)),
    "reconstructor": Saved(reconstructor, st.Reconstructor.load, "Reconstructor.save", same_frames),
    "volume": Saved(volume, st.SDF.load, "SDF.save"),
    "memory": Saved(memory, st.contour.ShapeMemory.load, "ShapeMemory.save"),
    "model": Saved(model, st.LWPR.load, "LWPR.save"),
}
MADE: dict[str, bytes] = {}


def content_of(name: str, folder: Path) -> bytes:
    """The bytes of the object's file, made once."""
    if name not in MADE:
        if name == "savez":
            ball = volume()
            with (folder / "made").open("wb") as file:
                np.savez_compressed(file, values=ball.values, voxel_size=ball.voxel_size, origin=ball.origin)
        else:
            SAVED[name].make().save(folder / "made")
        MADE[name] = (folder / "made").read_bytes()
        (folder / "made").unlink()
    return MADE[name]


# -- round trips
@pytest.mark.parametrize("name", SAVED)
def test_an_object_comes_back_and_its_file_has_the_same_bytes_again(name: str, tmp_path: Path) -> None:
    saved = SAVED[name]
    one = saved.make()
    one.save(tmp_path / "one")
    other = saved.load(tmp_path / "one")
    assert saved.same(one, other)
    other.save(tmp_path / "two")
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_copies_of_one_shape_are_one_shape_in_a_loaded_tracker(tmp_path: Path) -> None:
    tracker().save(tmp_path / "file")
    loaded = st.Tracker.load(tmp_path / "file")
    assert loaded.shapes[0] is loaded.shapes[1]


def test_a_file_of_version_1_continues_from_its_poses_and_says_so(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    one = tracker()
    content = content_of_tracker(one.__getstate__())
    for name in ("core", "frame_camera", "modes"):
        del content[name]
    saved_file.write(tmp_path / "file", FileKind("sdftrack.Tracker", 1, "Tracker.save"), content)
    loaded = st.Tracker.load(tmp_path / "file")
    assert "without what it learned" in caplog.text
    poses = [box_scene.pose_at(0, 0, 0.55), box_scene.pose_at(0.2, 0, 0.7)]
    frame = st.Frame(box_scene.depth_of(poses, 2), timestamp=0.2)
    a, b = loaded.track(frame), one.track(frame)
    assert (a.index, a.status) == (b.index, b.status) == (2, ["ok", "ok"])
    np.testing.assert_allclose(a.poses, b.poses, atol=1e-3)


def test_a_loaded_reconstructor_goes_on_with_the_bits_of_a_pickled_one(tmp_path: Path) -> None:
    one = reconstructor()
    one.save(tmp_path / "file")
    loaded, pickled = st.Reconstructor.load(tmp_path / "file"), pickle.loads(pickle.dumps(one))
    assert loaded.shape == pickled.shape
    turning = reconstruction_scene.turning(6, 6.0)
    seq = st.synth.sequence(
        reconstruction_scene.body(), 6, turning, 0.001, seed=4, camera=one._frame_camera, threads=1
    )
    for i in range(3, 6):
        a, b = loaded.track(seq[i]), pickled.track(seq[i])
        assert a.index == b.index == i
        np.testing.assert_array_equal(a.poses, b.poses)
    assert loaded.shape == pickled.shape


def test_cameras_symmetries_and_masks_of_a_tracker_come_back_with_their_bits(tmp_path: Path) -> None:
    turned = st.geometry.pose([0.1, 0.2, 0.3], [0.01, 0.02, 0.03])
    color = st.Camera(500, 510, 320, 240, 640, 480, (0.01, -0.02, 1e-3, -1e-3))
    symmetry = st.Symmetry(turned[None], ((np.array([1.0, 2.0, 3.0]), np.zeros(3)),))
    rig = st.RGBDCamera(box_scene.CAMERA, color, T_color_depth=turned)
    one = st.Tracker(
        box_scene.box_volume(), rig, symmetry=symmetry, collision=None, membership=True, padding_m=0.05
    )
    one.save(tmp_path / "file")
    other = st.Tracker.load(tmp_path / "file")
    other.save(tmp_path / "again")
    assert (tmp_path / "again").read_bytes() == (tmp_path / "file").read_bytes()
    assert other.camera == rig
    assert other.options == one.options
    P = np.array([[0.9, 0.01, 3.0], [0.0, 0.9, 2.0], [0.0, 0.0, 1.0]])
    other.camera = st.RGBDCamera(box_scene.CAMERA, projective=(P, np.array([0.1, 0.2, 0.0])))
    other.save(tmp_path / "file")
    assert st.Tracker.load(tmp_path / "file").camera == other.camera


def test_primitives_come_back_found_and_not_found(tmp_path: Path) -> None:
    can = st.SDF.cylinder(0.033, 0.1, voxels=60)
    camera = st.Camera(260, 260, 159.5, 119.5, 320, 240)
    T = st.geometry.pose([1.2, 0, 0], [0, 0, 0.5])
    frame = st.Frame(can.render(camera, T)[0])
    one = st.Tracker([st.Primitive("cylinder", voxels=40), st.Primitive("box", seed=3)], camera, threads=1)
    box = (300, 200, 10, 10)
    one.start(frame, masks=[frame.depth > 0, np.arange(320 * 240).reshape(240, 320) == 0])
    one.add(st.Primitive(), box=box)
    assert one.sizes[0] is not None
    assert one.sizes[1] is None
    one.save(tmp_path / "file")
    other = st.Tracker.load(tmp_path / "file")
    assert other.sizes == one.sizes
    assert other._free_sizes._missing[2] == box
    one.save(tmp_path / "one"), other.save(tmp_path / "two")
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    a, b = other.track(frame), pickle.loads(pickle.dumps(one)).track(frame)
    np.testing.assert_array_equal(a.poses, b.poses)


def test_numpy_opens_a_file_and_one_of_its_savez_is_read(tmp_path: Path) -> None:
    sdf = volume()
    sdf.save(tmp_path / "ball.npz")
    with np.load(tmp_path / "ball.npz", allow_pickle=False) as data:
        np.testing.assert_array_equal(data["values"], sdf.values)
        assert float(data["voxel_size"]) == sdf.voxel_size
        head = json.loads(data["header.json"])
    assert (head["format"], head["version"], head["sdftrack"]) == ("sdftrack.SDF", 1, st.__version__)
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "v.npz", values=sdf.values, voxel_size=sdf.voxel_size, origin=sdf.origin)
        assert st.SDF.load(tmp_path / "v.npz") == st.SDF(sdf.values, sdf.voxel_size, sdf.origin)


# -- damage
@pytest.mark.parametrize("name", SAVED)
@pytest.mark.parametrize("step", STEPS)
def test_a_file_cut_anywhere_is_refused_by_name(name: str, step: int, tmp_path: Path) -> None:
    content, path = content_of(name, tmp_path), tmp_path / "cut.file"
    for size in [*range(0, len(content), step), *range(len(content) - 100, len(content))]:
        path.write_bytes(content[:size])
        with pytest.raises(ValueError, match=rf"cut\.file: expected a file of {SAVED[name].writer}, got"):
            SAVED[name].load(path)


@pytest.mark.parametrize("name", ["tracker", "volume", "model", "savez"])
@pytest.mark.parametrize("step", STEPS)
def test_a_file_with_a_wrong_bit_is_refused_by_name_or_has_the_same_content(
    name: str, step: int, tmp_path: Path
) -> None:
    """At the beginning, through headers and arrays, and at every byte of the directory at the end."""
    content, path = content_of(name, tmp_path), tmp_path / "bad.file"
    saved = SAVED[name if name in SAVED else "volume"]
    path.write_bytes(content)
    whole = saved.load(path)
    places = [*range(60), *range(60, len(content), step), *range(len(content) - 200, len(content))]
    refusals = []
    for at in places:
        bad = bytearray(content)
        bad[at] ^= 1 << at % 8
        path.write_bytes(bad)
        try:  # the time of a member and the like have no meaning
            assert saved.same(whole, saved.load(path)), at
        except ValueError as error:
            refusals.append(str(error))
    assert len(refusals) > len(places) / 2
    for text in refusals:
        assert text.startswith(f"{path}: expected a file of {saved.writer}, got ")
        assert "\n" not in text


@pytest.mark.parametrize("name", SAVED)
@pytest.mark.parametrize(
    "content", [b"", b"hello", b"PK\x03\x04", b"\x89PNG\r\n", b"\x80\x04N.", b"\x00" * 5000]
)
def test_other_files_are_refused_by_name(name: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "other.file"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=rf"other\.file: expected a file of {SAVED[name].writer}, got"):
        SAVED[name].load(path)
    with pytest.raises(FileNotFoundError, match=rf"none: no such file; expected one of {SAVED[name].writer}"):
        SAVED[name].load(tmp_path / "none")


@pytest.mark.parametrize("name", SAVED)
def test_the_file_of_another_object_is_refused(name: str, tmp_path: Path) -> None:
    for other in set(SAVED) - {name}:
        path = tmp_path / other
        path.write_bytes(content_of(other, tmp_path))
        with pytest.raises(
            ValueError, match=rf"{other}: expected a file of {SAVED[name].writer}, got one of 'sdftrack"
        ):
            SAVED[name].load(path)


# -- versions and contents
def test_a_later_version_says_so_and_earlier_ones_are_read(tmp_path: Path) -> None:
    path = tmp_path / "file"
    saved_file.write(path, FileKind(KIND.name, 3, KIND.writer), {"a": 1})
    with pytest.raises(
        ValueError, match=r"file: expected a file of Test\.save, got version 3 of sdftrack 0\.\d"
    ):
        saved_file.read(path, KIND, dict)
    for version in (1, 2):
        saved_file.write(path, FileKind(KIND.name, version, KIND.writer), {"a": 1})
        assert saved_file.read(path, KIND, dict) == {"a": 1}


def changed(name: str, folder: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    """A file of the right form whose content somebody has changed."""
    path = folder / "changed.file"
    path.write_bytes(content_of(name, folder))
    with zipfile.ZipFile(path) as archive:
        head = json.loads(archive.read("header.json"))
    kind = FileKind(head["format"], head["version"], "")
    content = saved_file.read(path, kind, dict)
    change(content)
    saved_file.write(path, kind, content)
    return path


def setter(value: Any, *places: Any) -> Callable[[dict[str, Any]], None]:
    def change(content: Any) -> None:
        for place in places[:-1]:
            content = content[place]
        content[places[-1]] = value

    return change


INCONSISTENT = [
    ("tracker", setter([0, 7], "shapes")), ("tracker", setter(None, "camera")),
    ("tracker", setter(2 * np.tile(np.eye(4), (2, 1, 1)), "best")),
    ("tracker", setter(["x", "ok"], "last", "status")), ("tracker", setter("fast", "arguments", "mode")),
    ("tracker", setter(1.0, "arguments", "options", "no_such_option")),
    ("tracker", setter(10**12, "index")),
    ("tracker", lambda content: content.update(core=content["core"][:-1])),
    ("tracker", setter(["depth"], "modes")), ("tracker", setter([[5, None]], "sizes", "missing")),
    ("tracker", setter(np.zeros((4, 4, 4)), "volumes", 0, "values")),
    ("reconstructor", setter([0, 0, 5000, 50], "keyframes", 1, "region")),
    ("reconstructor", setter(np.zeros((2, 2), np.float32), "keyframes", 1, "depth")),
    ("reconstructor", setter(np.zeros((4, 4)), "keyframes", 1, "T_cam_obj")),
    ("reconstructor", setter([10**6, 10**6, 10**6], "lattice", "voxels")),
    ("reconstructor", setter(float("nan"), "lattice", "voxel_m")),
    ("reconstructor", setter([], "beginnings")),
    ("reconstructor", setter(np.zeros((1, 1), bool), "beginnings", 0, "on_object")),
    ("reconstructor", setter(np.full((3, 2), 9), "selection", "nearest")),
    ("volume", setter(0.0, "voxel_size")), ("volume", setter(np.zeros((2, 2, 2, 4), np.uint8), "colors")),
    ("memory", setter({"none": 1}, "options")), ("memory", setter(None, "kept")),
    ("model", setter(b"core", "core")),
]  # fmt: skip


@pytest.mark.parametrize(("name", "change"), INCONSISTENT)
def test_contents_that_do_not_fit_are_refused_by_name(name: str, change: Any, tmp_path: Path) -> None:
    path = changed(name, tmp_path, change)
    with pytest.raises(
        ValueError, match=rf"changed\.file: expected a file of {SAVED[name].writer}, got incons"
    ) as told:
        SAVED[name].load(path)
    assert "\n" not in str(told.value)


def written(path: Path, head: bytes, arrays: dict[str, bytes], method: int = zipfile.ZIP_STORED) -> None:
    """A file of any header and members."""
    with zipfile.ZipFile(path, "w", method) as archive:
        archive.writestr("header.json", head)
        for name, data in arrays.items():
            archive.writestr(name, data)


def npy(shape: str, dtype: str = "<f4", data: bytes = b"") -> bytes:
    head = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}}}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode() + data


def with_content(content: str) -> bytes:
    return f'{{"format": "sdftrack.Test", "version": 1, "content": {content}}}'.encode()


CRAFTED = {
    "declares more than it has": (with_content('{"$array": "a"}'), {"a.npy": npy("(100000, 100000)")}),
    "overflows": (with_content('{"$array": "a"}'), {"a.npy": npy("(4294967296, 4294967296)")}),
    "holds objects": (with_content('{"$array": "a"}'), {"a.npy": npy("(1,)", "|O", b"x" * 8)}),
    "has a shape of calls": (with_content('{"$array": "a"}'), {"a.npy": npy("(exit(),)")}),
    "is no array": (with_content('{"$array": "a"}'), {"a.npy": b"hello"}),
    "lacks an array": (with_content('{"$array": "a"}'), {}),
    "refers twice": (
        with_content('[{"$array": "a"}, {"$array": "a"}]'),
        {"a.npy": npy("(1,)", data=b"1234")},
    ),
    "is nested too deeply": (with_content("[" * 100_000 + "]" * 100_000), {}),
    "has no JSON": (b"{", {}),
    "has a version that is none": (b'{"format": "sdftrack.Test", "version": "1", "content": 1}', {}),
    "has another compression than deflate": (with_content("1"), {}, zipfile.ZIP_LZMA),
    "has a huge header": (b" " * 5_000_000 + b"{}", {}),
}


@pytest.mark.parametrize("crafted", CRAFTED)
def test_a_crafted_file_is_refused_in_one_line(crafted: str, tmp_path: Path) -> None:
    path = tmp_path / "crafted.file"
    written(path, *CRAFTED[crafted])
    with pytest.raises(ValueError, match=r"crafted\.file: expected a file of Test\.save, got") as told:
        saved_file.read(path, KIND, dict)
    assert "\n" not in str(told.value)


# -- memory
WARM = "import sys, sdftrack as st; st.SDF.sphere(0.03, voxels=16)"
REFUSED = """
try:
    st.SDF.load({path!r})
except ValueError:
    pass
else:
    sys.exit("loaded")
"""


@pytest.mark.slow
@pytest.mark.parametrize("has_header", [False, True])
def test_a_small_file_cannot_take_all_memory(has_header: bool, tmp_path: Path) -> None:
    """2 GB of zeros are 2 MB in a zip file."""
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        if has_header:
            head = {"format": "sdftrack.SDF", "version": 1, "content": {"values": {"$array": "values"}}}
            archive.writestr("header.json", json.dumps(head))
        with archive.open("values.npy", "w", force_zip64=True) as file:
            file.write(npy("(800, 800, 800)"))
            for _ in range(800):
                file.write(bytes(4 * 800 * 800))
    assert peak_bytes(REFUSED.format(path=str(path)), WARM) < 50e6
    with pytest.raises(ValueError, match=r"bomb\.npz: .*got 20\d\d MB declared by a file of"):
        st.SDF.load(path)


@pytest.mark.slow
def test_a_large_volume_takes_little_more_memory_than_it_has(tmp_path: Path) -> None:
    path = tmp_path / "large.npz"
    st.SDF(np.random.default_rng(0).random((256, 256, 256), np.float32), 0.001, (0, 0, 0)).save(path)
    assert peak_bytes(f"st.SDF.load({str(path)!r})", WARM) < 250e6  # 64 MB, and its checked copy


@pytest.mark.slow
def test_a_volume_that_is_compressed_too_well_is_written_so_that_it_is_read(tmp_path: Path) -> None:
    sdf = st.SDF(np.full((400, 400, 400), 0.05, np.float32), 0.001, (0, 0, 0))
    sdf.save(tmp_path / "flat.npz")
    assert st.SDF.load(tmp_path / "flat.npz") == sdf
