# SPDX-License-Identifier: MIT
"""Section 3.9: time per frame against the number of pixels on the object, CPU and GPU."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.common.bodies import body
from experiments.options import NO_SETTINGS, Settings
from experiments.pictures import Line, Panel, curves
from experiments.progress import step
from experiments.registry import experiment
from experiments.table import Table
from sdftrack import geometry

PIXELS = (1000, 2000, 5000, 10_000, 30_000, 100_000, 300_000)
SIGMA_M, STEP_M, STEP_RAD = 0.001, 0.005, np.deg2rad(1.5)
TURN = [0.5, -0.6, 0.2]
WAYS: dict[str, tuple[str, dict[str, Any]]] = {
    "cpu_ms": ("CPU, all pixels", {"max_pixels": 10**6, "device": "cpu"}),
    "default_ms": ("CPU, default", {"device": "cpu"}),
    "gpu_ms": ("GPU", {"max_pixels": 10**6, "device": "cuda"}),
}
PRINTED = (
    "printed: CPU above 100 Hz on a hand-held object; GPU 20 ms, slower than the CPU at a few thousand pixels"
)
Array = NDArray[np.float64]


@experiment(
    "thesis.section.3.9",
    chosen_on="nothing was chosen here",
    reported_on="the built-in duck",
    short={"frames": 3},
)
def pixels(
    *,
    frames: int = 60,
    mesh: Path | None = None,
    unit: str | None = None,
    options: Settings = NO_SETTINGS,
) -> Table:
    """Section 3.9: time per frame against the number of pixels, CPU and GPU.

    An object of 200 voxels in front of a 1280 x 960 camera at distances where it shows 1e3 to 3e5 pixels, 1 mm of
    noise, going back and forth by 5 mm and 1.5 degrees, one thread. Object, camera and motion are not printed in the
    thesis; these are ours. Printed: CPU above 100 Hz on a hand-held object; GPU about 20 ms for an object of about 200
    mm; GPU slower than CPU at a few thousand pixels; GPU time nearly constant, CPU time linear in the number of pixels.

    Parameters
    ----------
    mesh
        instead of the built-in duck
    unit
        of the mesh
    """
    it = body(mesh, unit)
    sdf, camera = it.sdf(), st.Camera(1050.0, 1050.0, 639.5, 479.5, 1280, 960)
    rows: list[dict[str, Any]] = []
    for k, wanted in enumerate(PIXELS):
        pose = _pose_with(sdf, camera, wanted)
        images, count = _images(sdf, camera, pose)
        rows.append({"pixels": count, "gpu_ms": None})
        for way, (_, more) in WAYS.items():
            if way != "gpu_ms" or st.cuda_available():
                told = {"threads": 1, **options, **more}
                rows[-1][way] = _time(sdf, camera, images, pose, max(frames, 3), told)
        step(k + 1, len(PIXELS), f"{count} pixels")
    return Table.of(
        f"Section 3.9, {frames} frames of {it.name}",
        {"pixels": "pixels:d", **{f"{label}, ms": f"{way}:.3f" for way, (label, _) in WAYS.items()}},
        rows,
        notes=[PRINTED, *_notes(rows)],
        picture=lambda: _picture(rows),
    )


def _pose_with(sdf: Any, camera: Any, wanted: int) -> Array:
    """The object straight ahead, at the distance where its silhouette has that many pixels."""
    near, far = 0.25, 20.0
    for _ in range(14):
        z = np.sqrt(near * far)
        many = int(sdf.silhouette(camera, geometry.pose(TURN, [0, 0, z])).sum())
        near, far = (z, far) if many > wanted else (near, z)
    return geometry.pose(TURN, [0, 0, float(np.sqrt(near * far))])


def _images(sdf: Any, camera: Any, pose: Array) -> tuple[list[Any], int]:
    """Frames at the pose and one step from it."""
    rng = np.random.default_rng(0)
    there = geometry.pose(STEP_RAD * np.array([0.6, 0.0, 0.8])) @ pose
    there[:3, 3] = pose[:3, 3] + STEP_M * np.array([0.6, 0.48, 0.64])
    images, count = [], 0
    for T in (pose, there):
        depth = sdf.render(camera, T)[0]
        count = int((depth > 0).sum())
        noisy = np.where(depth > 0, depth + rng.normal(0, SIGMA_M, depth.shape), 0)
        images.append(st.Frame(noisy.astype(np.float32), check_units=False))
    return images, count


def _time(sdf: Any, camera: Any, images: list[Any], pose: Array, frames: int, options: Any) -> float:
    """Median time of a frame, ms; RuntimeError when the object is lost."""
    tracker = st.Tracker(sdf, camera, mode="depth", **options)
    tracker.start(images[0], poses=[pose])
    seconds = []
    for i in range(frames):
        begin = time.perf_counter()
        result = tracker.track(images[(i + 1) % 2])
        seconds.append(time.perf_counter() - begin)
        if str(result.status[0]) == "lost":
            raise RuntimeError(f"frame {i}: lost while its time was taken: {result.reason[0]}")
    return 1e3 * float(np.median(seconds))


def _notes(rows: list[dict[str, Any]]) -> list[str]:
    n, cpu = np.array([r["pixels"] for r in rows], float), np.array([r["cpu_ms"] for r in rows])
    slope, fixed = np.polyfit(n, cpu, 1, w=1 / cpu)
    hz = 1e3 / rows[2]["default_ms"]
    line = f"CPU: {fixed:.2f} ms + {1e6 * slope:.1f} ns per pixel; {hz:.0f} Hz at {rows[2]['pixels']} pixels by default"
    if rows[0]["gpu_ms"] is None:
        return [line, "GPU: no CUDA device, or a build without CUDA"]
    faster = [r["pixels"] for r in rows if r["gpu_ms"] < r["cpu_ms"]]
    return [line, f"GPU: faster from {faster[0]} pixels on" if faster else "GPU: slower at all of these"]


def _picture(rows: list[dict[str, Any]]) -> Any:
    lines = [
        Line([r["pixels"] for r in rows], [r[way] for r in rows], label, {"marker": "o"})
        for way, (label, _) in WAYS.items()
        if rows[0][way] is not None
    ]
    log = {
        "xscale": "log",
        "yscale": "log",
        "xlabel": "pixels on the object",
        "ylabel": "time per frame (ms)",
    }
    return curves([[Panel([*lines, Line(None, 10, "100 Hz")], log)]], (7.0, 4.5))
