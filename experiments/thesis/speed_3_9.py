# SPDX-License-Identifier: MIT
"""Section 3.9: time per frame against the number of pixels on the object, CPU and GPU.

Set-up: the built-in duck, 200 voxels, in front of a 1280 x 960 camera at distances where it shows 1e3 to 3e5 pixels,
1 mm of noise, going back and forth by 5 mm and 1.5 degrees, every pixel used. Object, camera and motion are not
printed in the thesis; these are ours. Printed: CPU above 100 Hz on a hand-held object; GPU about 20 ms for an object
of about 200 mm; GPU slower than CPU at a few thousand pixels; GPU time nearly constant, CPU time linear in the number
of pixels.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.thesis import Context
from sdftrack.device import resolve_device
from sdftrack.evaluation.tables import text_table

__all__ = ["run"]

PIXELS = (1000, 2000, 5000, 10_000, 30_000, 100_000, 300_000)
VOXELS, SIGMA_M, FRAMES, SEED = 200, 0.001, 60, 0
STEP_M, STEP_RAD = 0.005, np.deg2rad(1.5)
HEAD = ["pixels", "CPU, all pixels, ms", "CPU, default, ms", "GPU, ms"]
PRINTED = (
    "CPU above 100 Hz on a hand-held object; GPU about 20 ms, slower than the CPU at a few thousand pixels"
)
Array = NDArray[np.float64]


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    import sdftrack as st
    from sdftrack._internal.files import write_text
    from sdftrack.synth.duck import duck_mesh

    resolve_device(context.options.get("device", "auto"))  # a GPU that is asked for and missing is an error
    mesh = duck_mesh() if context.mesh is None else st.Mesh.load(context.mesh, context.unit)
    sdf = st.SDF.from_mesh(mesh, voxels=VOXELS, unit="m" if context.unit == "m" else None)
    camera = st.Camera(1050.0, 1050.0, 639.5, 479.5, 1280, 960)
    frames = FRAMES if context.frames is None else max(context.frames, 3)
    options = {"threads": 1, **context.options}
    rows = []
    for k, wanted in enumerate(PIXELS):
        pose = _pose_with(sdf, camera, wanted)
        images, pixels = _images(sdf, camera, pose)
        ways: dict[str, dict[str, Any]] = {
            "cpu_ms": {"max_pixels": 10**6, "device": "cpu"},
            "default_ms": {"device": "cpu"},
        }
        if st.cuda_available():
            ways["gpu_ms"] = {"max_pixels": 10**6, "device": "cuda"}
        row: dict[str, Any] = {"pixels": pixels, "gpu_ms": None}
        for way, more in ways.items():
            row[way] = _time(sdf, camera, images, pose, frames, {**options, **more})
        rows.append(row)
        context.step(k + 1, len(PIXELS), f"{pixels} pixels")
    title = f"Section 3.9, {frames} frames of {'the built-in duck' if context.mesh is None else context.mesh.name}"
    summary = _summary(rows)
    cells = [[_cell(r[key]) for key in ("pixels", "cpu_ms", "default_ms", "gpu_ms")] for r in rows]
    notes = [f"printed: {PRINTED}", *summary.pop("notes")]
    write_text(context.out / "table.txt", "\n".join([text_table(title, HEAD, cells), *notes]) + "\n")
    _plot(context.out / "figure.png", rows)
    return {"title": title, "head": HEAD, "rows": cells, "notes": notes, "levels": rows, **summary}


def _pose_with(sdf: Any, camera: Any, pixels: int) -> Array:
    """The object straight ahead, at the distance where its silhouette has that many pixels."""
    from sdftrack import geometry

    near, far = 0.25, 20.0
    for _ in range(14):
        z = np.sqrt(near * far)
        many = int(sdf.silhouette(camera, geometry.pose([0.5, -0.6, 0.2], [0, 0, z])).sum())
        near, far = (z, far) if many > pixels else (near, z)
    return geometry.pose([0.5, -0.6, 0.2], [0, 0, float(np.sqrt(near * far))])


def _images(sdf: Any, camera: Any, pose: Array) -> tuple[list[Any], int]:
    """Frames at the pose and one step from it."""
    import sdftrack as st
    from sdftrack import geometry

    rng = np.random.default_rng(SEED)
    there = geometry.pose(STEP_RAD * np.array([0.6, 0.0, 0.8])) @ pose
    there[:3, 3] = pose[:3, 3] + STEP_M * np.array([0.6, 0.48, 0.64])
    images, pixels = [], 0
    for T in (pose, there):
        depth = sdf.render(camera, T)[0]
        pixels = int((depth > 0).sum())
        noisy = np.where(depth > 0, depth + rng.normal(0, SIGMA_M, depth.shape), 0)
        images.append(st.Frame(noisy.astype(np.float32), check_units=False))
    return images, pixels


def _time(
    sdf: Any, camera: Any, images: list[Any], pose: Array, frames: int, options: dict[str, Any]
) -> float:
    """Median time of a frame, ms; RuntimeError when the object is lost."""
    import sdftrack as st

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


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    n, cpu = np.array([r["pixels"] for r in rows], float), np.array([r["cpu_ms"] for r in rows])
    slope, offset = np.polyfit(n, cpu, 1, w=1 / cpu)
    out: dict[str, Any] = {"cpu_ns_per_pixel": 1e6 * float(slope), "cpu_fixed_ms": float(offset)}
    lines = [
        f"CPU: {out['cpu_fixed_ms']:.2f} ms + {out['cpu_ns_per_pixel']:.1f} ns per pixel; "
        f"{1e3 / rows[2]['default_ms']:.0f} Hz at {rows[2]['pixels']} pixels with default options"
    ]
    if rows[0]["gpu_ms"] is None:
        lines.append("GPU: no CUDA device, or a build without CUDA")
    else:
        faster = [r["pixels"] for r in rows if r["gpu_ms"] < r["cpu_ms"]]
        out["gpu_faster_from_pixels"] = faster[0] if faster else None
        lines.append(
            f"GPU: faster from {faster[0]} pixels on"
            if faster
            else "GPU: slower at all of these numbers of pixels"
        )
    return {**out, "notes": lines}


def _cell(value: float | int | None) -> str:
    if value is None:
        return "-"
    return str(value) if isinstance(value, int) else f"{value:.3f}"


def _plot(path: Any, rows: list[dict[str, Any]]) -> None:
    from sdftrack.viz.plots import figure, save_figure

    fig, ax = figure(size=(7.0, 4.5))
    n = [r["pixels"] for r in rows]
    for key, label in (
        ("cpu_ms", "CPU, one thread, all pixels"),
        ("default_ms", "CPU, one thread, default options"),
        ("gpu_ms", "GPU"),
    ):
        if rows[0][key] is not None:
            ax.loglog(n, [r[key] for r in rows], "o-", label=label, linewidth=1.2)
    ax.axhline(10, color="0.6", linestyle=":", label="100 Hz")
    ax.set_xlabel("pixels on the object")
    ax.set_ylabel("time per frame (ms)")
    ax.grid(True, which="both", alpha=0.2)
    ax.legend(fontsize=8)
    save_figure(fig, path)
