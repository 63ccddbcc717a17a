# SPDX-License-Identifier: MIT
"""The self-test of a GPU: everything that can run on it, compared with the CPU."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import sdftrack as st
from sdftrack import _core
from sdftrack.device import device_number, remember
from sdftrack.energy.energy import MAX_JOINED

# Sums of floats in another order, and a x + y in one rounding.
ARITHMETIC_ATOL, SUM_RTOL, POSE_ATOL, CELL_ATOL, LWPR_RTOL = 2e-6, 1e-4, 1e-5, 1e-4, 1e-9
MOVED_VOXELS = 0.02


@dataclass(frozen=True)
class Check:
    name: str
    agrees: bool
    detail: str


def run_self_test(number: int) -> list[Check]:
    """Compare GPU `number` with the CPU; whether all agree is remembered for ``device="auto"``."""
    checks = [_checked(name, number) for name in COMPARISONS]
    remember(number, all(check.agrees for check in checks))
    return checks


def _checked(name: str, number: int) -> Check:
    compute, differ, allowed = COMPARISONS[name]
    try:
        difference = float(differ(compute("cpu"), compute(f"cuda:{number}")))
    except (RuntimeError, ValueError, MemoryError) as error:
        return Check(name, False, " ".join(str(error).split()))
    agrees = bool(difference <= allowed)  # not where it is NaN
    return Check(name, agrees, f"largest difference {difference:.2g}, allowed {allowed:.2g}")


# -- How far the result of a GPU is from that of the CPU


def _largest(cpu: Any, gpu: Any) -> Any:
    return np.abs(gpu - cpu).max()


def _relative(cpu: Any, gpu: Any) -> Any:
    return np.abs(gpu - cpu).max() / np.abs(cpu).max()


def _of_poses(cpu: list[Any], gpu: list[Any]) -> Any:
    return np.max([st.metrics.pose_error(a, b) for a, b in zip(cpu, gpu, strict=True)])


def _of_fits(cpu: list[Any], gpu: list[Any]) -> Any:
    if any(a.pixels != b.pixels for a, b in zip(cpu, gpu, strict=True)):
        return np.nan
    return _of_poses([fit.pose for fit in cpu], [fit.pose for fit in gpu])


def _of_meshes(cpu: Any, gpu: Any) -> Any:
    return _largest(cpu.vertices, gpu.vertices) if np.array_equal(gpu.faces, cpu.faces) else np.nan


def _of_sums(cpu: list[Any], gpu: list[Any]) -> Any:
    worst = []
    for (a, cost), (b, gpu_cost) in zip(cpu, gpu, strict=True):
        curvature = np.diag(a.hessian)
        # A gradient may be 0: beside what one standard deviation of each unknown would make of it.
        steps = np.abs(b.gradient - a.gradient) / np.sqrt(curvature * a.cost)
        curved = np.abs(b.hessian - a.hessian) / np.sqrt(np.outer(curvature, curvature))
        worst += [abs(b.cost / a.cost - 1), abs(gpu_cost / cost - 1), curved.max(), steps.max()]
    return np.max(worst)  # NaN if one of them is


def _of_volumes(cpu: Any, gpu: Any) -> Any:
    """Of log ratios, and of distances near the surface, which may follow a move of 0.02 voxels a frame later."""
    near = np.abs(cpu[1]) < 3
    moved = np.abs(gpu[1] - cpu[1])[near].max()
    return np.max([_largest(cpu[0], gpu[0]) / CELL_ATOL, moved / MOVED_VOXELS])


# -- What is computed, on a device


def _scene() -> tuple[Any, Any, Any, Any]:
    camera = st.Camera(fx=260, fy=260, cx=159.5, cy=119.5, width=320, height=240)
    box = st.SDF.box((0.12, 0.09, 0.06), voxels=60)
    pose = st.geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.5])
    clean = box.render(camera, pose)[0]
    noisy = clean + np.random.default_rng(0).normal(0, 0.001, clean.shape)
    depth = np.where(clean > 0, noisy, 1.2).astype(np.float32)
    color = np.where((clean > 0)[..., None], (200, 60, 40), (90, 100, 110)).astype(np.uint8)
    return box, camera, st.Frame(depth, color), pose


def _sums(device: str) -> list[Any]:
    """Cost, gradient and Hessian of each set of unknowns, of colours, and of two to four objects that touch."""
    box, camera, frame, pose = _scene()
    beside = np.tile(pose, (MAX_JOINED, 1, 1))
    beside[:, 0, 3] += 0.004 * np.arange(MAX_JOINED)  # each has its share of the pixels
    cases: list[tuple[Any, Any, dict[str, Any]]] = [
        (box, pose, {"unknowns": unknowns})
        for unknowns in (("pose",), ("pose", "scale"), ("pose", "intrinsics"))
    ]
    cases += [([box] * n, beside[:n], {}) for n in range(2, MAX_JOINED + 1)]
    cases += [(box, pose, {"penalty": "rgbd"})]
    energies = [st.Energy(shapes, camera, frame, T, device=device, **more) for shapes, T, more in cases]
    return [(energy.linearize(energy.start), energy.cost(energy.start)) for energy in energies]


def _poses(device: str) -> list[Any]:
    box, camera, frame, pose = _scene()
    trackers = [st.Tracker(box, camera, mode=mode, device=device, threads=1) for mode in ("depth", "rgbd")]
    for tracker in trackers:
        tracker.start(frame, poses=[pose])
    return [tracker.track(frame).pose for tracker in trackers]


def _fits(device: str) -> Any:
    box, camera, frame, pose = _scene()
    starts = [pose @ st.geometry.pose([0, 0.01 * k, 0], [0.002, 0, 0.001 * k]) for k in range(4)]
    return st.fit_poses(box, camera, frame, starts, device=device, threads=1, max_pixels=3000)


def _touching(device: str) -> list[Any]:
    """Two to four boxes side by side, in one tracker; each is seen well enough for its own pose."""
    box, camera, _, _ = _scene()
    random, pose = np.random.default_rng(0), st.geometry.pose

    def frame_of(poses: list[Any]) -> Any:
        images = [box.render(camera, T)[0] for T in poses]
        clean = np.min([np.where(image > 0, image, 1.2) for image in images], axis=0)
        return st.Frame((clean + random.normal(0, 0.001, clean.shape)).astype(np.float32))

    move = pose([0.01, 0, 0.01], [0.002, 0.001, 0.001])
    found: list[Any] = []
    for count in (2, 3, 4):
        at = [-0.05 * (count - 1), -0.02 * (count - 1), 0.65 - 0.02 * count]
        beside = [pose([0, 0, 0], [0.1205 * k, 0.02 * (k % 2), 0]) for k in range(count)]
        poses = [pose([0.5, -0.6, 0.2], at) @ place for place in beside]
        frames = frame_of(poses), frame_of([move @ T for T in poses])
        tracker = st.Tracker([box] * count, camera, mode="depth", device=device, threads=1)
        tracker.start(frames[0], poses=poses)
        found += [*tracker.track(frames[1]).poses]
    return found


def _painted(device: str) -> list[Any]:
    """A tracker that also reads the brightness of a coloured surface, and its outline."""
    box, camera, frame, pose = _scene()
    mesh = box.to_mesh()
    waves = (128 + 100 * np.sin(150 * mesh.vertices)).astype(np.uint8)
    mesh = st.Mesh(mesh.vertices, mesh.faces, waves)
    painted = st.SDF.from_mesh(mesh, voxels=60, color=True)
    seen = st.Frame(frame.depth, mesh.raycast(camera, pose)[2])
    tracker = st.Tracker(painted, camera, device=device, threads=1, outline=True, outline_from_m=0.0)
    tracker.start(seen, poses=[pose])
    return [tracker.track(seen).pose]


def _search(device: str) -> list[Any]:
    box, camera, frame, pose = _scene()
    mask = box.silhouette(camera, pose)
    tracker = st.Tracker(box, camera, mode="depth", device=device, threads=1)
    return [tracker.start(frame, masks=[mask]).pose]


def _labels(device: str) -> Any:
    y, x = np.mgrid[:90, :130]
    image = np.stack([2 * y, x, (x * y) % 97], axis=-1).astype(np.uint8)
    image += np.random.default_rng(0).integers(0, 20, image.shape, dtype=np.uint8)
    ways: list[dict[str, Any]] = [{}, {"mask": (x + 2 * y) % 19 > 0}]
    ways += [{"distance": "thesis"}, {"enforce_connectivity": False}]
    return np.array([st.superpixels.slic(image, n_segments=80, device=device, **way) for way in ways])


def _predictions(device: str) -> Any:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (1000, 2))
    model = st.LWPR(2, 1)
    model.update(x, (np.sin(3 * x[:, 0]) + x[:, 1] ** 2)[:, None])
    return model.predict(rng.uniform(-1, 1, (5000, 2)), device=device)


def _learning(device: str) -> Any:
    x = np.random.default_rng(0).uniform(-1, 1, (600, 2))
    y = np.stack([np.sin(3 * x[:, 0]) + x[:, 1] ** 2, x[:, 0] * x[:, 1]], axis=-1)
    model = st.LWPR(2, 2, init_D=40.0, norm_in=1.0)
    for part in np.split(np.arange(600), 3):
        model.update(x[part], y[part], device=device)
    return model.predict(x)


def _contour(device: str) -> Any:
    y, x = np.mgrid[:90, :120]
    phi = (np.hypot(x - 60, y - 45) - 25).astype(np.float32)
    foreground = np.random.default_rng(0).uniform(0.02, 0.98, phi.shape).astype(np.float32)
    return _core.contour_steps(phi, foreground, 5, _core.ContourOptions(), device=device_number(device))


def _evolution(device: str) -> Any:
    ball = st.SDF.sphere(0.05, voxels=40)
    ratio = -ball.values / ball.voxel_size + np.random.default_rng(0).normal(0, 1, ball.values.shape)
    evolved = st.levelset.evolve(
        ball.values, ratio.astype(np.float32), 10, ball.voxel_size, redistance_every=0, device=device
    )
    return evolved / ball.voxel_size


def _reconstruction(device: str) -> tuple[Any, Any]:
    """Mean log ratios, and distances in voxels."""
    _, camera, frame, pose = _scene()
    depth, voxel_m = frame.depth, 0.005
    mask = (depth < 1).astype(np.uint8)
    height, width = depth.shape
    core = _core.Reconstruction(
        [43, 40, 41], voxel_m, [-0.1] * 3, None, _core.ReconstructionOptions(), 1, None, device_number(device)
    )  # fmt: skip
    for turn in (0.0, 0.01, 0.02):
        turned = pose @ st.geometry.pose([0, turn, 0], [0, 0, 0])
        of_object = mask if turn < 0.02 else None  # the last frame's readings by how they hang together
        core.fuse(depth, camera._core, turned, (0, 0, width, height), of_object)
    return core.log_ratio / np.maximum(core.weight, 1e-6), np.array(core.phi) / voxel_m


def _redistanced(device: str) -> Any:
    box = st.SDF.box((0.12, 0.09, 0.06), voxels=30)
    values = (box.values * (1.5 + np.cos(80 * box.values))).astype(np.float32)
    bent = st.SDF(values, box.voxel_size, box.origin)
    return bent.redistanced(1, device=device).values / box.voxel_size


def _arithmetic(device: str) -> Any:
    x, y = np.random.default_rng(0).normal(size=(2, 1000)).astype(np.float32)
    return _core.scale_and_add(1.5, x, y, device=device_number(device))


def _image(device: str, of_mesh: bool = False) -> Any:
    box, camera, _, pose = _scene()
    cast = box.to_mesh().raycast if of_mesh else box.render
    return np.dstack(cast(camera, pose, device=device)[:2])


# Name: what is computed, how two results differ, and by how much they may.
COMPARISONS: dict[str, tuple[Callable[[str], Any], Callable[[Any, Any], Any], float]] = {
    "arithmetic": (_arithmetic, _largest, ARITHMETIC_ATOL),
    "sums over pixels": (_sums, _of_sums, SUM_RTOL),
    "poses of a frame": (_poses, _of_poses, POSE_ATOL),
    "fits at once": (_fits, _of_fits, POSE_ATOL),
    "objects that touch": (_touching, _of_poses, POSE_ATOL),
    "brightness and outline": (_painted, _of_poses, POSE_ATOL),
    "pose search": (_search, _of_poses, POSE_ATOL),
    "superpixels": (_labels, _largest, 0.0),
    "LWPR": (_predictions, _relative, LWPR_RTOL),
    "LWPR, learning": (_learning, _relative, LWPR_RTOL),
    "contour": (_contour, _largest, 0.0),
    "level set": (_evolution, _largest, CELL_ATOL),
    "reconstruction": (_reconstruction, _of_volumes, 1.0),
    "ray casting": (_image, _largest, 0.0),
    "ray casting of a mesh": (lambda device: _image(device, of_mesh=True), _largest, 0.0),
    "marching cubes": (lambda device: st.SDF.sphere(0.05, voxels=30).to_mesh(device=device), _of_meshes, 0.0),
    "distances of a field": (_redistanced, _largest, CELL_ATOL),
}
