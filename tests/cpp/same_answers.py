# SPDX-License-Identifier: MIT
"""The C++ examples and the Python classes see the same images: the same statuses, poses and meshes.

``python same_answers.py PROGRAMS FOLDER``, with the folder of the programs made from cpp/examples.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

try:
    import sdftrack as st
except ImportError as error:
    sys.exit(print(f"SKIPPED: {error}"))

STATUS = [st.Status.OK, st.Status.WEAK, st.Status.LOST, st.Status.BAD_FRAME]
VOXELS = 64


def compare(row: str, result: st.TrackResult, i: int) -> None:
    """A printed row has the bits of a Python result."""
    words = row.split(" ", 10)
    T, reason = result.poses[0], words[10]
    assert STATUS[int(words[1])] is result.status[0], (i, row, result.status)
    assert reason == result.reason[0], (i, reason, result.reason)
    assert float(words[2]) == result.confidence[0], (i, row, result.confidence)
    assert [float(w) for w in words[3:6]] == T[:3, 3].tolist(), (i, row, T)
    turned = Rotation.from_quat([float(w) for w in words[6:10]], scalar_first=True).as_matrix()
    assert np.abs(turned - T[:3, :3]).max() < 1e-12, (i, row, T)
    assert i < 2 or result.ok, "the images do not test much"


def rows_of(*call: object) -> list[str]:
    return subprocess.run(
        [str(c) for c in call], check=True, capture_output=True, text=True
    ).stdout.splitlines()


def images_in_a_file(programs: Path, folder: Path, mesh: st.Mesh) -> None:
    """Found in the whole image, in depth alone."""
    mesh.save(folder / "mesh.ply")
    sequence = st.synth.sequence(mesh, 12, noise=0.001, clutter="objects", seed=5)
    camera = sequence.camera.depth
    images = [np.rint(1e3 * frame.depth).astype(np.uint16) for frame in sequence]
    (folder / "images").write_bytes(b"".join(image.tobytes() for image in images))
    numbers = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    rows = rows_of(programs / "track", folder / "mesh.ply", folder / "images", *map(repr, numbers))
    tracker = st.Tracker(st.SDF.from_mesh(folder / "mesh.ply"), camera)
    for i, (image, row) in enumerate(zip(images, rows, strict=True)):
        frame = st.Frame(image, depth_scale=0.001)
        compare(row, tracker.start(frame) if i == 0 else tracker.track(frame), i)
    print(f"{len(rows)} frames of a file: the same in C++ and in Python")


def scene_in_a_folder(programs: Path, folder: Path, mesh: st.Mesh) -> None:
    """A BOP scene, from the object's mask, in depth and colour."""
    scene = folder / "scene"
    st.save_sequence(scene, st.synth.sequence(mesh, 12, noise=0.001, clutter="objects", color=True, seed=6))
    sequence = st.open_sequence(scene)
    rows = rows_of(programs / "track_bop", scene, sequence.objects[0])
    tracker = st.Tracker(st.SDF.from_mesh(sequence.models[sequence.objects[0]]), sequence.camera)
    for i, (frame, row) in enumerate(zip(sequence, rows, strict=True)):
        compare(
            row, tracker.start(frame, masks=[sequence.masks(0)[0]]) if i == 0 else tracker.track(frame), i
        )
    print(f"{len(rows)} frames of a BOP scene: the same in C++ and in Python")


def unknown_object(programs: Path, folder: Path, mesh: st.Mesh) -> None:
    """Reconstructed from its mask in the first image, in depth alone."""
    sequence = st.synth.sequence(mesh, 12, noise=0.001, clutter="objects", seed=5)
    camera, mask = sequence.camera.depth, sequence.masks(0)[0]
    images = [np.rint(1e3 * frame.depth).astype(np.uint16) for frame in sequence]
    (folder / "images").write_bytes(b"".join(image.tobytes() for image in images))
    (folder / "mask").write_bytes(mask.astype(np.uint8).tobytes())
    numbers = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    out = folder / "reconstructed.ply"
    files = (folder / "images", folder / "mask", out)
    rows = rows_of(programs / "reconstruct", *files, *map(repr, numbers), VOXELS)
    star = st.Reconstructor(camera, voxels=VOXELS)
    changes = []
    for i, (image, row) in enumerate(zip(images, rows, strict=True)):
        frame = st.Frame(image, depth_scale=0.001)
        result = star.start(frame, mask=mask) if i == 0 else star.track(frame)
        words = row.split(" ", 15)
        assert [int(words[0]), STATUS[int(words[1])]] == [i, result.status[0]], (i, row, result.status)
        np.testing.assert_equal(float(words[2]), result.shape_change, str((i, row)))
        assert [float(w) for w in words[3:15]] == result.poses[0][:3].ravel().tolist(), (i, row, result.poses)
        assert words[15] == result.reason[0], (i, row, result.reason)
        changes.append(result.shape_change)
    assert np.isfinite(changes).sum() > len(images) / 2, "hardly a frame was fused"
    mesh, ply = star.mesh(), out.read_bytes()
    kind = [("at", "<f8", 3), ("seen", "<f4")] + ([("rgb", "u1", 3)] if mesh.colors is not None else [])
    start = ply.index(b"end_header\n") + len(b"end_header\n")
    vertices = np.frombuffer(ply, np.dtype(kind), len(mesh.vertices), start)
    faces = np.frombuffer(ply, np.dtype([("n", "u1"), ("of", "<i4", 3)]), -1, start + vertices.nbytes)
    np.testing.assert_array_equal(vertices["at"], mesh.vertices)
    np.testing.assert_array_equal(vertices["seen"], mesh.seen)
    np.testing.assert_array_equal(faces["of"], mesh.faces)
    print(f"{len(rows)} frames, {len(faces)} faces: the same in C++ and in Python")


def main(programs: Path, folder: Path) -> None:
    block, ball = st.SDF.box((0.12, 0.06, 0.05), voxels=80), st.SDF.sphere(0.03, voxels=60)
    mesh = st.union(block, ball.transformed(st.geometry.pose([0, 0, 0], [0.05, 0.02, 0.03]))).to_mesh()
    images_in_a_file(programs, folder, mesh)
    unknown_object(programs, folder, mesh)
    if (programs / "track_bop").is_file():  # where OpenCV's C++ library is
        scene_in_a_folder(programs, folder, mesh)


main(Path(sys.argv[1]), Path(sys.argv[2]))
