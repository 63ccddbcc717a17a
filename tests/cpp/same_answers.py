# SPDX-License-Identifier: MIT
"""The C++ examples and the Python classes see the same images: the same statuses, poses and meshes.

``python same_answers.py PROGRAMS FOLDER``, with the folder of the programs made from cpp/examples.
"""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

try:
    import sdftrack as st
except ImportError as error:
    sys.exit(print(f"SKIPPED: {error}"))

STATUS = [st.Status.OK, st.Status.WEAK, st.Status.LOST, st.Status.BAD_FRAME]
VOXELS = 64
FINE = 5  # of a millimetre, as TUM's depth images are stored
STANDING = "found among the objects on a plane"


def solid(scale: float) -> st.SDF:
    """A block with a ball at one of its corners: no two of its views are alike."""
    block, ball = st.SDF.box((0.12, 0.06, 0.05), voxels=80), st.SDF.sphere(0.03, voxels=60)
    both = st.union(block, ball.transformed(st.geometry.pose([0, 0, 0], [0.05, 0.02, 0.03])))
    return st.SDF(both.values * np.float32(scale), both.voxel_size * scale, both.origin * scale)


class Compared:
    """Runs of the program and of Python on the same files."""

    def __init__(self, track: Path, folder: Path, mesh: st.Mesh, camera: st.Camera) -> None:
        self.mesh_file, self.images_file, self.mask_file = (
            folder / n for n in ("mesh.ply", "images", "mask")
        )
        self.camera = camera
        mesh.save(self.mesh_file)
        numbers = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
        self.call = [track, self.mesh_file, self.images_file, *map(repr, numbers)]

    def check(
        self, images: list[np.ndarray], how: list[Any], start: dict[str, Any], **setup: Any
    ) -> list[st.TrackResult]:
        self.images_file.write_bytes(b"".join(image.tobytes() for image in images))
        call = [*self.call, *map(str, how)]
        rows = rows_of(*call)
        tracker, results = st.Tracker(st.SDF.from_mesh(self.mesh_file), self.camera, **setup), []
        for i, (image, row) in enumerate(zip(images, rows, strict=True)):
            frame = st.Frame(image, depth_scale=0.001)
            results.append(tracker.track(frame) if i else tracker.start(frame, **start))
            self.compare(row, results[-1])
        return results

    @staticmethod
    def compare(row: str, result: st.TrackResult) -> None:
        words, T = row.split(" ", 10), result.poses[0]
        assert STATUS[int(words[1])] is result.status[0], (row, result.status)
        assert words[10] == result.reason[0], (row, result.reason)
        assert float(words[2]) == result.confidence[0], (row, result.confidence)
        np.testing.assert_array_equal([float(w) for w in words[3:6]], T[:3, 3], row)
        if np.isfinite(T).all():
            turned = Rotation.from_quat([float(w) for w in words[6:10]], scalar_first=True).as_matrix()
            assert np.abs(turned - T[:3, :3]).max() < 1e-12, (row, T)


def cluttered_table(shape: st.SDF, camera: st.Camera) -> np.ndarray:
    """The shape stands among boxes on a table before a wall, so that a search of the whole image is lost."""
    rng = np.random.default_rng(26)
    tilt = st.geometry.pose([0.6, 0, 0], [0, 0, 0.75])  # the camera looks down on the table

    def standing(x: float, along: float, above: float, turn: float = 0.0) -> np.ndarray:
        return tilt @ st.geometry.pose([0, turn, 0], [x, -above, along])

    layers = [
        (st.SDF.box((1.2, 0.02, 0.9), voxels=100), standing(0, 0, -0.01)),
        (st.SDF.box((2.0, 1.2, 0.02), voxels=80), standing(0, 0.5, 0.4)),
        (shape, standing(rng.uniform(-0.15, 0.15), rng.uniform(-0.05, 0.15), 0.015, rng.uniform(0, 6))),
    ]
    for _ in range(8):
        size = rng.uniform(0.03, 0.15, 3)
        place = standing(rng.uniform(-0.3, 0.3), rng.uniform(-0.1, 0.3), 0.5 * size[1], rng.uniform(0, 6))
        layers.append((st.SDF.box(size, voxels=40), place))
    depth = np.full(camera.shape, np.inf)
    for one, T in layers:
        z = one.render(camera, T)[0]
        depth = np.where((z > 0) & (z < depth), z, depth)
    noisy = 1e3 * (depth + rng.normal(0, 0.001, depth.shape))
    return np.where(np.isfinite(depth), np.rint(noisy), 0).astype(np.uint16)


def rows_of(*call: object) -> list[str]:
    return subprocess.run(
        [str(c) for c in call], check=True, capture_output=True, text=True
    ).stdout.splitlines()


def images_in_a_file(programs: Path, folder: Path, mesh: st.Mesh) -> None:
    """In depth alone: searched in the whole image, clicked on, in a mask of a wrong unit, and among what stands."""
    sequence = st.synth.sequence(mesh, 12, noise=0.001, clutter="objects", seed=5)
    compared = Compared(programs / "track", folder, mesh, sequence.camera.depth)
    images = [np.rint(1e3 * frame.depth).astype(np.uint16) for frame in sequence]
    results = compared.check(images, [], {})
    assert all(r.ok for r in results[2:]), "the images do not test much"

    mask = sequence.masks(0)[0]
    y, x = (int(np.median(at)) for at in np.nonzero(mask))
    assert compared.check(images[:2], ["click", x, y], {"clicks": (x, y)})[1].ok
    compared.mask_file.write_bytes(mask.astype(np.uint8).tobytes())
    told = compared.check([FINE * images[0]], ["mask", compared.mask_file], {"masks": mask})
    assert "is the depth in 1/5000 m" in told[0].reason[0], told[0].reason

    larger = Compared(programs / "track", folder, st.Mesh(1.2 * mesh.vertices, mesh.faces), compared.camera)
    scaled = larger.check(images, ["scaled", compared.mask_file], {"masks": mask}, scale="free")
    assert scaled[-1].ok, scaled[-1].reason

    camera = st.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
    small = solid(0.5)
    table = Compared(programs / "track", folder, small.to_mesh(), camera)
    found = table.check([cluttered_table(small, camera)], [], {})[0]
    assert found.reason[0].startswith(STANDING), found.reason
    print(f"{2 * len(images) + 4} frames of files: the same in C++ and in Python")


def scene_in_a_folder(programs: Path, folder: Path, mesh: st.Mesh) -> None:
    """A BOP scene, from the object's mask, in depth and colour."""
    scene = folder / "scene"
    st.save_sequence(scene, st.synth.sequence(mesh, 12, noise=0.001, clutter="objects", color=True, seed=6))
    sequence = st.open_sequence(scene)
    rows = rows_of(programs / "track_bop", scene, sequence.objects[0])
    tracker = st.Tracker(st.SDF.from_mesh(sequence.models[sequence.objects[0]]), sequence.camera)
    for i, (frame, row) in enumerate(zip(sequence, rows, strict=True)):
        result = tracker.track(frame) if i else tracker.start(frame, masks=[sequence.masks(0)[0]])
        Compared.compare(row, result)
        assert i < 2 or result.ok, "the images do not test much"
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
    mesh = solid(1).to_mesh()
    images_in_a_file(programs, folder, mesh)
    unknown_object(programs, folder, mesh)
    if (programs / "track_bop").is_file():  # where OpenCV's C++ library is
        scene_in_a_folder(programs, folder, mesh)


main(Path(sys.argv[1]), Path(sys.argv[2]))
