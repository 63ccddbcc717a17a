# SPDX-License-Identifier: MIT
"""The C++ examples and the Python class track the same images of the same mesh file: the same statuses and poses.

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


def main(programs: Path, folder: Path) -> None:
    block, ball = st.SDF.box((0.12, 0.06, 0.05), voxels=80), st.SDF.sphere(0.03, voxels=60)
    mesh = st.union(block, ball.transformed(st.geometry.pose([0, 0, 0], [0.05, 0.02, 0.03]))).to_mesh()
    images_in_a_file(programs, folder, mesh)
    if (programs / "track_bop").is_file():  # where OpenCV's C++ library is
        scene_in_a_folder(programs, folder, mesh)


main(Path(sys.argv[1]), Path(sys.argv[2]))
