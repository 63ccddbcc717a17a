# SPDX-License-Identifier: MIT
"""Tasks of the GPU path and their times on the device that is here, beside the CPU's."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import sdftrack as st
from sdftrack import _core
from sdftrack.device import CPU, device_number

Call = Callable[[], Any]
SLOW = (
    "100",
    "LWPR",
    "level",
    "mesh of a volume",
    "distances of a field",
)  # parts of names: a second on a CPU


def time_ms(call: Call, runs: int) -> dict[str, float]:
    """Median and quartiles after one run to warm up, ms."""
    call()
    times = []
    for _ in range(runs):
        began = time.perf_counter()
        call()
        times.append(1e3 * (time.perf_counter() - began))
    quarters = statistics.quantiles(times, n=4) if len(times) > 1 else [times[0]] * 3
    return {"median": quarters[1], "lower": quarters[0], "upper": quarters[2]}


def camera_of(size: int) -> st.Camera:
    """A camera of `size` pixels across, at 4:3."""
    return st.Camera(fx=size, fy=size, cx=size / 2, cy=0.375 * size, width=size, height=3 * size // 4)


def before_wall(box: st.SDF, camera: st.Camera, pose: Any) -> st.Frame:
    """The depth image of an object before a wall at 1.2 m."""
    depth = box.render(camera, pose)[0]
    return st.Frame(np.where(depth > 0, depth, 1.2).astype(np.float32))


def tracker_call(device: str, objects: int, size: int) -> Call:
    """A frame of an object that fills many pixels; several: one tracker after another."""
    camera = camera_of(size)
    box = st.SDF.box((0.12, 0.09, 0.06), voxels=100)
    pose = st.geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.35])
    frame = before_wall(box, camera, pose)
    trackers = [
        st.Tracker(box, camera, mode="depth", device=device, max_pixels=10_000) for _ in range(objects)
    ]
    for tracker in trackers:
        tracker.start(frame, poses=[pose])
    return lambda: [tracker.track(frame) for tracker in trackers]


def painted_call(device: str, size: int) -> Call:
    """A frame of a tracker that also reads the brightness of a coloured surface, and its outline."""
    camera = camera_of(size)
    box = st.SDF.box((0.12, 0.09, 0.06), voxels=100)
    mesh = box.to_mesh()
    waves = (128 + 100 * np.sin(150 * mesh.vertices)).astype(np.uint8)
    mesh = st.Mesh(mesh.vertices, mesh.faces, waves)
    painted = st.SDF.from_mesh(mesh, voxels=100, color=True)
    pose = st.geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.35])
    depth, _, color = mesh.raycast(camera, pose)
    frame = st.Frame(np.where(depth > 0, depth, 1.2).astype(np.float32), color)
    tracker = st.Tracker(painted, camera, device=device, max_pixels=10_000, outline=True, outline_from_m=0.0)
    tracker.start(frame, poses=[pose])
    return lambda: tracker.track(frame)


def touching_call(device: str, objects: int, size: int) -> Call:
    """A frame of boxes side by side, which one tracker fits together."""
    camera = camera_of(size)
    box = st.SDF.box((0.06, 0.09, 0.06), voxels=100)
    first = st.geometry.pose([0.5, -0.6, 0.2], [0.01 - 0.025 * (objects - 1), 0.02, 0.4])
    poses = [first @ st.geometry.pose([0, 0, 0], [0.0605 * k, 0, 0]) for k in range(objects)]
    images = [box.render(camera, pose)[0] for pose in poses]
    nearest = np.min([np.where(image > 0, image, 1.2) for image in images], axis=0)
    frame = st.Frame(nearest.astype(np.float32))
    tracker = st.Tracker([box] * objects, camera, mode="depth", device=device, max_pixels=10_000)
    tracker.start(frame, poses=poses)
    return lambda: tracker.track(frame)


def fit_call(device: str, objects: int, size: int, pixels: int = 10_000) -> Call:
    """A frame of objects that are fitted each on its own, all in one call, from a few millimetres off."""
    camera = camera_of(size)
    box = st.SDF.box((0.12, 0.09, 0.06), voxels=100)
    pose = st.geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.35])
    frame = before_wall(box, camera, pose)
    turns = np.linspace(-0.02, 0.02, objects)
    starts = np.stack([st.geometry.pose([t, 0.01, -t], [0.002, t / 10, 0.002]) @ pose for t in turns])
    fitter = st.PoseFitter(box, camera, device=device)
    return lambda: fitter.fit(frame, starts, max_pixels=pixels)


def mesh_call(device: str, size: int) -> Call:
    camera = camera_of(size)
    mesh, pose = (
        st.SDF.box((0.12, 0.09, 0.06), voxels=80).to_mesh(),
        st.geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.35]),
    )
    return lambda: mesh.raycast(camera, pose, device=device)


def search_call(device: str, size: int) -> Call:
    """A start from a mask: the search, and the fits of what it finds."""
    camera = camera_of(size)
    box, pose = (
        st.SDF.box((0.12, 0.09, 0.06), voxels=100),
        st.geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.5]),
    )
    frame = before_wall(box, camera, pose)
    tracker = st.Tracker(box, camera, mode="depth", device=device)
    mask = box.silhouette(camera, pose)
    return lambda: tracker.start(frame, masks=[mask])


def slic_call(device: str, size: int) -> Call:
    y, x = np.mgrid[: 3 * size // 4, :size]
    image = np.stack([2 * y, x, (x * y) % 97], axis=-1).astype(np.uint8)
    return lambda: st.superpixels.slic(image, image.size // 3 // 256, max_num_iter=5, device=device)


def lwpr_call(device: str, count: int) -> Call:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (5000, 2))
    model = st.LWPR(2, 1, init_D=150.0)
    model.update(x, (np.sin(3 * x[:, 0]) + x[:, 1] ** 2)[:, None])
    ask = rng.uniform(-1, 1, (count, 2))
    return lambda: model.predict(ask, device=device)


def lwpr_update_call(device: str, count: int) -> Call:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (count, 10))
    y = np.sin(x @ rng.normal(size=(10, 50)))

    def learn() -> list[float]:  # and what is asked for brings the fields back
        model = st.LWPR(10, 50, init_D=0.5, norm_in=1.0, norm_out=1.0, init_alpha=1.0, diagonal=True)
        return model.update(x, y, device=device).training_error.tolist()

    return learn


def evolve_call(device: str, voxels: int) -> Call:
    """Ten steps, with the transfers to the device and back."""
    ball = st.SDF.sphere(0.05, voxels=voxels)
    ratio = (-ball.values / ball.voxel_size).astype(np.float32)
    return lambda: st.levelset.evolve(
        ball.values, ratio, 10, ball.voxel_size, redistance_every=0, device=device
    )


def fuse_call(device: str, voxels: int, by_mask: bool = True, shown: bool = False) -> Call:
    """A frame fused into a volume that has had some; shown: and what has changed brought to the host."""
    number = CPU if device == "cpu" else device_number(device)
    camera = st.Camera(fx=500, fy=500, cx=319.5, cy=239.5, width=640, height=480)
    ball = st.SDF.sphere(0.06, voxels=64)
    turns = [st.geometry.pose([0, 0.02 * k, 0], [0, 0, 0.4]) for k in range(8)]
    frames = [np.where((d := ball.render(camera, T)[0]) > 0, d, 1.0).astype(np.float32) for T in turns]
    mask = (frames[0] < 0.9).astype(np.uint8)
    options = st.ReconstructorOptions(known_every=1)
    core = _core.Reconstruction([voxels] * 3, 0.2 / voxels, [-0.1] * 3, None, options, 2, None, number)
    at = iter(range(10**9))

    def fuse() -> None:
        k = next(at) % len(turns)
        core.fuse(frames[k], camera._core, turns[k], (120, 40, 520, 440), mask if by_mask else None)
        if shown:
            core.show()

    core.fuse(frames[0], camera._core, turns[0], (120, 40, 520, 440), mask)
    for _ in turns:
        fuse()
    return fuse


def render_call(device: str, size: int) -> Call:
    camera = camera_of(size)
    box, pose = (
        st.SDF.box((0.12, 0.09, 0.06), voxels=100),
        st.geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.35]),
    )
    return lambda: box.render(camera, pose, device=device)


def march_call(device: str, voxels: int) -> Call:
    """The mesh of a ball, with its volume's way to the device and the mesh's back."""
    ball = st.SDF.sphere(0.05, voxels=voxels)
    return lambda: ball.to_mesh(device=device)


def redistance_call(device: str, voxels: int) -> Call:
    ball = st.SDF.sphere(0.05, voxels=voxels)
    return lambda: st.levelset.redistance(2 * ball.values, ball.voxel_size, device=device)


def calls(quick: bool) -> dict[str, Callable[[str], Call]]:
    """Each task by its name: a device to what runs the task there."""
    size, side = (160, 24) if quick else (640, 200)
    return {
        "one object, a frame": lambda d: fit_call(d, 1, size),
        "100 objects, a frame": lambda d: fit_call(d, 2 if quick else 100, size),
        "tracker of one object, a frame": lambda d: tracker_call(d, 1, size),
        "two objects that touch, a frame": lambda d: touching_call(d, 2, size),
        "four objects that touch, a frame": lambda d: touching_call(d, 4, size),
        "tracker with brightness and outline, a frame": lambda d: painted_call(d, size),
        "level set of 200^3, ten steps": lambda d: evolve_call(d, side),
        "reconstruction of 200^3, a frame": lambda d: fuse_call(d, side),
        "reconstruction of 200^3, a frame without a mask": lambda d: fuse_call(d, side, by_mask=False),
        "reconstruction of 200^3, a frame and its blocks": lambda d: fuse_call(d, side, shown=True),
        "superpixels, 640 x 480": lambda d: slic_call(d, size),
        "pose search in a mask": lambda d: search_call(d, size),
        "ray casting, 640 x 480": lambda d: render_call(d, size),
        "ray casting of a mesh, 640 x 480": lambda d: mesh_call(d, size),
        "mesh of a volume of 200^3": lambda d: march_call(d, side),
        "distances of a field of 200^3": lambda d: redistance_call(d, side),
        "LWPR, 10^6 predictions": lambda d: lwpr_call(d, 1000 if quick else 10**6),
        "LWPR, 10^4 updates of 50 outputs": lambda d: lwpr_update_call(d, 50 if quick else 10**4),
    }


def measure(
    device: str, quick: bool, each: Callable[[dict[str, Any]], object] = lambda _: None
) -> dict[str, Any]:
    """Times of the CPU and of the device; `each` is given those so far after each task."""
    runs = 1 if quick else 20
    out: dict[str, Any] = {}
    for name, make in calls(quick).items():
        few = 1 if quick else 3 if any(part in name for part in SLOW) else runs
        out[name] = {
            "cpu_ms": time_ms(make("cpu"), few),
            "gpu_ms": time_ms(make(device), runs if few == runs else 5),
        }
        print(name, {k: round(v["median"], 3) for k, v in out[name].items()}, flush=True)
        each(out)
    return out
