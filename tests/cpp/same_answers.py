# SPDX-License-Identifier: MIT
"""The C++ example and the Python class track the same images of the same mesh file: the same statuses and poses.

``python same_answers.py TRACK FOLDER``, with the program made from cpp/examples/track.cpp.
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


def main(track: str, folder: Path) -> None:
    block, ball = st.SDF.box((0.12, 0.06, 0.05), voxels=80), st.SDF.sphere(0.03, voxels=60)
    mesh = st.union(block, ball.transformed(st.geometry.pose([0, 0, 0], [0.05, 0.02, 0.03]))).to_mesh()
    mesh.save(folder / "mesh.ply")
    sequence = st.synth.sequence(mesh, 12, noise=0.001, clutter="objects", seed=5)
    camera = sequence.camera.depth
    images = [np.rint(1e3 * frame.depth).astype(np.uint16) for frame in sequence]
    (folder / "images").write_bytes(b"".join(image.tobytes() for image in images))
    numbers = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    call = [track, folder / "mesh.ply", folder / "images", *map(repr, numbers)]
    rows = subprocess.run(call, check=True, capture_output=True, text=True).stdout.splitlines()

    tracker = st.Tracker(st.SDF.from_mesh(folder / "mesh.ply"), camera)
    for i, (image, row) in enumerate(zip(images, rows, strict=True)):
        depth = image.astype(np.float32) * np.float32(0.001)
        result = tracker.start(st.Frame(depth)) if i == 0 else tracker.track(st.Frame(depth))
        words = row.split(" ", 10)
        T, reason = result.poses[0], words[10]
        assert STATUS[int(words[1])] is result.status[0], (i, row, result.status)
        assert reason == result.reason[0], (i, reason, result.reason)
        assert float(words[2]) == result.confidence[0], (i, row, result.confidence)
        assert [float(w) for w in words[3:6]] == T[:3, 3].tolist(), (i, row, T)
        turned = Rotation.from_quat([float(w) for w in words[6:10]], scalar_first=True).as_matrix()
        assert np.abs(turned - T[:3, :3]).max() < 1e-12, (i, row, T)
        assert i < 2 or result.ok, "the images do not test much"
    print(f"{len(rows)} frames: the same in C++ and in Python")


main(sys.argv[1], Path(sys.argv[2]))
