# SPDX-License-Identifier: MIT
"""The self-test of a GPU: everything that can run on it, compared with the CPU."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdftrack import _core
from sdftrack.device import CPU, remember

# Sums of floats in another order, and a x + y in one rounding.
SUM_RTOL, POSE_ATOL, CELL_ATOL, LWPR_RTOL = 1e-4, 1e-5, 1e-4, 1e-9
MOVED_VOXELS = 0.02


@dataclass(frozen=True)
class Check:
    """One comparison; `detail`: the largest difference and what is allowed, or the error."""

    name: str
    agrees: bool
    detail: str


def run_self_test(number: int) -> list[Check]:
    """Compare GPU `number` with the CPU; whether all agree is remembered for ``device="auto"``."""
    checks = [_checked(name, compare, number) for name, compare in COMPARISONS.items()]
    remember(number, all(check.agrees for check in checks))
    return checks


def _checked(name: str, compare: Callable[[int], tuple[float, float]], number: int) -> Check:
    try:
        difference, allowed = compare(number)
    except (RuntimeError, ValueError, MemoryError) as error:
        return Check(name, False, " ".join(str(error).split()))
    agrees = bool(difference <= allowed)  # not where it is NaN
    return Check(name, agrees, f"largest difference {difference:.2g}, allowed {allowed:.2g}")


def _arithmetic(number: int) -> tuple[float, float]:
    x, y = np.random.default_rng(0).normal(size=(2, 1000)).astype(np.float32)
    gpu = _core.scale_and_add(1.5, x, y, device=number)
    return float(np.abs(gpu - _core.scale_and_add(1.5, x, y)).max()), 2e-6


def _scene() -> tuple[Any, Any, Any, Any]:
    """Volume, camera, frame and pose of a box before a wall, with noise of 1 mm."""
    import sdftrack as st

    camera = st.Camera(fx=260, fy=260, cx=159.5, cy=119.5, width=320, height=240)
    box = st.SDF.box((0.12, 0.09, 0.06), voxels=60)
    pose = st.geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.5])
    clean = box.render(camera, pose)[0]
    noisy = clean + np.random.default_rng(0).normal(0, 0.001, clean.shape)
    depth = np.where(clean > 0, noisy, 1.2).astype(np.float32)
    color = np.where((clean > 0)[..., None], (200, 60, 40), (90, 100, 110)).astype(np.uint8)
    return box, camera, st.Frame(depth, color), pose


def _sums(number: int) -> tuple[float, float]:
    """Cost, gradient and Hessian of each set of unknowns, of colours, and of two to four objects that touch."""
    import sdftrack as st
    from sdftrack.energy.energy import MAX_JOINED

    box, camera, frame, pose = _scene()
    beside = np.tile(pose, (MAX_JOINED, 1, 1))
    beside[:, 0, 3] += 0.004 * np.arange(MAX_JOINED)  # each has its share of the pixels
    cases: list[tuple[Any, Any, dict[str, Any]]] = [
        (box, pose, {"unknowns": unknowns})
        for unknowns in (("pose",), ("pose", "scale"), ("pose", "intrinsics"))
    ]
    cases += [([box] * n, beside[:n], {}) for n in range(2, MAX_JOINED + 1)]
    cases += [(box, pose, {"penalty": "rgbd"})]
    worst = []
    for shapes, poses, more in cases:
        cpu, gpu = (
            st.Energy(shapes, camera, frame, poses, device=d, **more) for d in ("cpu", f"cuda:{number}")
        )
        a, b = cpu.linearize(cpu.start), gpu.linearize(gpu.start)
        curvature = np.diag(a.hessian)
        size = np.sqrt(np.outer(curvature, curvature))
        worst += [
            abs(b.cost / a.cost - 1),
            abs(gpu.cost(gpu.start) / cpu.cost(cpu.start) - 1),
            np.abs((b.hessian - a.hessian) / size).max(),
            # A gradient may be 0: beside what one standard deviation of each unknown would make of it.
            (np.abs(b.gradient - a.gradient) / np.sqrt(curvature * a.cost)).max(),
        ]
    return float(np.max(worst)), SUM_RTOL  # NaN if one of them is


def _poses(number: int) -> tuple[float, float]:
    import sdftrack as st

    box, camera, frame, pose = _scene()
    found = []
    for device in ("cpu", f"cuda:{number}"):
        for mode in ("depth", "rgbd"):
            tracker = st.Tracker(box, camera, mode=mode, device=device, threads=1)
            tracker.start(frame, poses=[pose])
            found.append(tracker.track(frame).pose)
    half = len(found) // 2
    errors = [st.metrics.pose_error(a, b) for a, b in zip(found[:half], found[half:], strict=True)]
    return float(np.max(errors)), POSE_ATOL


def _fits(number: int) -> tuple[float, float]:
    import sdftrack as st

    box, camera, frame, pose = _scene()
    starts = [pose @ st.geometry.pose([0, 0.01 * k, 0], [0.002, 0, 0.001 * k]) for k in range(4)]
    cpu, gpu = (
        st.fit_poses(box, camera, frame, starts, device=d, threads=1, max_pixels=3000)
        for d in ("cpu", f"cuda:{number}")
    )
    if any(a.pixels != b.pixels for a, b in zip(cpu, gpu, strict=True)):
        return float("nan"), POSE_ATOL
    errors = [st.metrics.pose_error(a.pose, b.pose) for a, b in zip(cpu, gpu, strict=True)]
    return float(np.max(errors)), POSE_ATOL


def _touching(number: int) -> tuple[float, float]:
    """Two to four boxes side by side, in one tracker; each is seen well enough for its own pose."""
    import sdftrack as st

    box, camera, _, _ = _scene()
    random = np.random.default_rng(0)

    def frame_of(poses: list[Any]) -> Any:
        images = [box.render(camera, pose)[0] for pose in poses]
        clean = np.min([np.where(image > 0, image, 1.2) for image in images], axis=0)
        return st.Frame((clean + random.normal(0, 0.001, clean.shape)).astype(np.float32))

    move = st.geometry.pose([0.01, 0, 0.01], [0.002, 0.001, 0.001])
    worst = []
    for count in (2, 3, 4):
        first = st.geometry.pose(
            [0.5, -0.6, 0.2], [-0.05 * (count - 1), -0.02 * (count - 1), 0.65 - 0.02 * count]
        )
        beside = [st.geometry.pose([0, 0, 0], [0.1205 * k, 0.02 * (k % 2), 0]) for k in range(count)]
        poses = [first @ place for place in beside]
        frames = frame_of(poses), frame_of([move @ pose for pose in poses])
        found = []
        for device in ("cpu", f"cuda:{number}"):
            tracker = st.Tracker([box] * count, camera, mode="depth", device=device, threads=1)
            tracker.start(frames[0], poses=poses)
            found.append(tracker.track(frames[1]).poses)
        worst += [st.metrics.pose_error(a, b) for a, b in zip(*found, strict=True)]
    return float(np.max(worst)), POSE_ATOL


def _painted(number: int) -> tuple[float, float]:
    """A tracker that also reads the brightness of a coloured surface, and its outline."""
    import sdftrack as st

    box, camera, frame, pose = _scene()
    mesh = box.to_mesh()
    waves = (128 + 100 * np.sin(150 * mesh.vertices)).astype(np.uint8)
    mesh = st.Mesh(mesh.vertices, mesh.faces, waves)
    painted = st.SDF.from_mesh(mesh, voxels=60, color=True)
    seen = st.Frame(frame.depth, mesh.raycast(camera, pose)[2])
    found = []
    for device in ("cpu", f"cuda:{number}"):
        tracker = st.Tracker(painted, camera, device=device, threads=1, outline=True, outline_from_m=0.0)
        tracker.start(seen, poses=[pose])
        found.append(tracker.track(seen).pose)
    return float(np.max(st.metrics.pose_error(*found))), POSE_ATOL


def _labels(number: int) -> tuple[float, float]:
    import sdftrack as st

    y, x = np.mgrid[:90, :130]
    image = np.stack([2 * y, x, (x * y) % 97], axis=-1).astype(np.uint8)
    image += np.random.default_rng(0).integers(0, 20, image.shape, dtype=np.uint8)
    mask = (x + 2 * y) % 19 > 0
    different = 0
    ways: tuple[dict[str, Any], ...] = (
        {},
        {"mask": mask},
        {"distance": "thesis"},
        {"enforce_connectivity": False},
    )
    for way in ways:
        cpu, gpu = (
            st.superpixels.slic(image, n_segments=80, device=d, **way) for d in ("cpu", f"cuda:{number}")
        )
        different += int((cpu != gpu).sum())
    return float(different), 0.0


def _predictions(number: int) -> tuple[float, float]:
    import sdftrack as st

    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (1000, 2))
    model = st.LWPR(2, 1)
    model.update(x, (np.sin(3 * x[:, 0]) + x[:, 1] ** 2)[:, None])
    ask = rng.uniform(-1, 1, (5000, 2))
    cpu, gpu = model.predict(ask), model.predict(ask, device=f"cuda:{number}")
    return float(np.abs(gpu - cpu).max() / np.abs(cpu).max()), LWPR_RTOL


def _learning(number: int) -> tuple[float, float]:
    import sdftrack as st

    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (600, 2))
    y = np.stack([np.sin(3 * x[:, 0]) + x[:, 1] ** 2, x[:, 0] * x[:, 1]], axis=-1)
    models = [st.LWPR(2, 2, init_D=40.0, norm_in=1.0) for _ in range(2)]
    for part in np.split(np.arange(600), 3):
        models[0].update(x[part], y[part])
        models[1].update(x[part], y[part], device=f"cuda:{number}")
    cpu, gpu = (model.predict(x) for model in models)
    return float(np.abs(gpu - cpu).max() / np.abs(cpu).max()), LWPR_RTOL


def _contour(number: int) -> tuple[float, float]:
    y, x = np.mgrid[:90, :120]
    phi = (np.hypot(x - 60, y - 45) - 25).astype(np.float32)
    foreground = np.random.default_rng(0).uniform(0.02, 0.98, phi.shape).astype(np.float32)
    cpu, gpu = (_core.contour_steps(phi, foreground, 5, {}, device=d) for d in (-1, number))
    return float(np.abs(gpu - cpu).max()), 0.0


def _evolution(number: int) -> tuple[float, float]:
    import sdftrack as st

    ball = st.SDF.sphere(0.05, voxels=40)
    ratio = -ball.values / ball.voxel_size + np.random.default_rng(0).normal(0, 1, ball.values.shape)
    cpu, gpu = (
        st.levelset.evolve(
            ball.values, ratio.astype(np.float32), 10, ball.voxel_size, redistance_every=0, device=d
        )
        for d in ("cpu", f"cuda:{number}")
    )
    return float(np.abs(gpu - cpu).max() / ball.voxel_size), CELL_ATOL


def _reconstruction(number: int) -> tuple[float, float]:
    """Mean log ratios; and distances beside the surface, which may follow a move of 0.02 voxels a frame later."""
    import sdftrack as st

    _, camera, frame, pose = _scene()
    depth, voxel_m = frame.depth, 0.005
    mask = (depth < 1).astype(np.uint8)
    options = _core.ReconstructionOptions()
    height, width = depth.shape
    means, distances = [], []
    for device in (CPU, number):
        core = _core.Reconstruction([43, 40, 41], voxel_m, [-0.1] * 3, None, options, 1, None, None, device)
        for turn in (0.0, 0.01, 0.02):
            turned = pose @ st.geometry.pose([0, turn, 0], [0, 0, 0])
            of_object = mask if turn < 0.02 else None  # the last frame's readings by how they hang together
            core.fuse(depth, camera._core, turned, (0, 0, width, height), of_object)
        means.append(core.log_ratio / np.maximum(core.weight, 1e-6))
        distances.append(np.array(core.phi))
    near = np.abs(distances[0]) < 3 * voxel_m
    moved = np.abs(distances[1] - distances[0])[near].max() / voxel_m
    worst = [np.abs(means[1] - means[0]).max() / CELL_ATOL, moved / MOVED_VOXELS]
    return float(np.max(worst)), 1.0  # NaN if one of them is


def _image(number: int) -> tuple[float, float]:
    box, camera, _, pose = _scene()
    cpu, gpu = (np.dstack(box.render(camera, pose, device=d)) for d in ("cpu", f"cuda:{number}"))
    return float(np.abs(gpu - cpu).max()), 0.0


def _search(number: int) -> tuple[float, float]:
    import sdftrack as st

    box, camera, frame, pose = _scene()
    mask = box.silhouette(camera, pose)
    found = []
    for device in ("cpu", f"cuda:{number}"):
        tracker = st.Tracker(box, camera, mode="depth", device=device, threads=1)
        found.append(tracker.start(frame, masks=[mask]).pose)
    return float(np.max(st.metrics.pose_error(*found))), POSE_ATOL


def _mesh_image(number: int) -> tuple[float, float]:
    box, camera, _, pose = _scene()
    mesh = box.to_mesh()
    cpu, gpu = (np.dstack(mesh.raycast(camera, pose, device=d)[:2]) for d in ("cpu", f"cuda:{number}"))
    return float(np.abs(gpu - cpu).max()), 0.0


def _mesh(number: int) -> tuple[float, float]:
    import sdftrack as st

    ball = st.SDF.sphere(0.05, voxels=30)
    cpu, gpu = (ball.to_mesh(device=d) for d in ("cpu", f"cuda:{number}"))
    if not np.array_equal(gpu.faces, cpu.faces):
        return float("nan"), 0.0
    return float(np.abs(gpu.vertices - cpu.vertices).max() / ball.voxel_size), 0.0


def _redistanced(number: int) -> tuple[float, float]:
    import sdftrack as st

    box = st.SDF.box((0.12, 0.09, 0.06), voxels=30)
    bent = st.SDF(
        (box.values * (1.5 + np.cos(80 * box.values))).astype(np.float32), box.voxel_size, box.origin
    )
    cpu, gpu = (bent.redistanced(1, device=d).values for d in ("cpu", f"cuda:{number}"))
    return float(np.abs(gpu - cpu).max() / box.voxel_size), CELL_ATOL


COMPARISONS: dict[str, Callable[[int], tuple[float, float]]] = {
    "arithmetic": _arithmetic,
    "sums over pixels": _sums,
    "poses of a frame": _poses,
    "fits at once": _fits,
    "objects that touch": _touching,
    "brightness and outline": _painted,
    "pose search": _search,
    "superpixels": _labels,
    "LWPR": _predictions,
    "LWPR, learning": _learning,
    "contour": _contour,
    "level set": _evolution,
    "reconstruction": _reconstruction,
    "ray casting": _image,
    "ray casting of a mesh": _mesh_image,
    "marching cubes": _mesh,
    "distances of a field": _redistanced,
}
