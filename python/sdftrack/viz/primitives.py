# SPDX-License-Identifier: MIT
"""Wireframes of primitives over an image, or over the fitted point cloud."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera

if TYPE_CHECKING:
    from sdftrack.primitives import PrimitiveFit

Array = NDArray[np.float64]
RING = 72  # corners of a circle
WIRE_RGB = {"ok": (20, 150, 60), "weak": (255, 190, 60), "lost": (235, 80, 90)}
CLOUD_POINTS = 3000


def wires(kind: str, size: dict[str, float]) -> list[Array]:
    """Lines (K, 3), m, on a primitive's surface: edges of a box or patch, rings and sides of the others."""
    if kind == "box":
        h = np.array([size["x"], size["y"], size["z"]]) / 2
        base = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]], float)
        rings = [np.column_stack([base, np.full(5, z)]) * h for z in (-1.0, 1.0)]
        return rings + [np.array([rings[0][i], rings[1][i]]) for i in range(4)]
    if kind == "plane":
        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [-1, -1, 0]], float)
        normal = np.array([[0, 0, 0], [0, 0, 0.25 * min(size.values())]])
        return [corners * [size["width"] / 2, size["height"] / 2, 0], normal]
    a = np.linspace(0, 2 * np.pi, RING + 1)
    c, s, o = np.cos(a), np.sin(a), np.zeros(RING + 1)
    if kind in ("cylinder", "cone"):
        r, h2 = size["radius"], size["height"] / 2
        low = np.column_stack([r * c, r * s, o - h2])
        top = np.array([[0, 0, h2]]) if kind == "cone" else low + np.array([0, 0, 2 * h2])
        ends = [low] if kind == "cone" else [low, top]
        sides = range(0, RING, RING // 8)
        return ends + [np.array([low[i], top[0] if kind == "cone" else top[i]]) for i in sides]
    radii = np.array(
        [size["radius"]] * 3 if kind == "sphere" else [size[name] for name in ("rx", "ry", "rz")]
    )
    out = [np.column_stack([c, s, o]), np.column_stack([c, o, s]), np.column_stack([o, c, s])]
    for z in (-0.5, 0.5):
        out.append(np.column_stack([np.sqrt(1 - z * z) * c, np.sqrt(1 - z * z) * s, o + z]))
    if kind == "superquadric":
        out = [line / _norm(np.abs(line), size["e1"], size["e2"]) for line in out]
    return [line * radii for line in out]


def _norm(p: Array, e1: float, e2: float) -> Array:
    """The norm (K, 1) whose unit ball is the superquadric of half axes 1, at points (K, 3), coordinates positive."""
    level = (p[:, 0] ** (2 / e2) + p[:, 1] ** (2 / e2)) ** (e2 / 2)
    out: Array = (level ** (2 / e1) + p[:, 2] ** (2 / e1)) ** (e1 / 2)
    return out[:, None]


def _moved(line: NDArray[Any], T: NDArray[Any]) -> Array:
    return np.asarray(line @ T[:3, :3].T + T[:3, 3])


def draw_primitives(frame: Any, fits: Sequence[PrimitiveFit], camera: Any) -> NDArray[np.uint8]:
    """The frame, aligned with its depth image, with wireframes, thin where self-occluded, and sizes of all fits."""
    # Green: ok, amber: weak, red: lost.
    import cv2

    from sdftrack.viz.overlay import STATUS_RGB, backdrop, write_panel

    lens = depth_camera(frame.camera if frame.camera is not None else camera)
    picture = np.ascontiguousarray(backdrop(frame, camera)).copy()
    for fit in fits:
        colour = WIRE_RGB.get(fit.status.value, WIRE_RGB["lost"])
        flat = fit.kind == "plane"
        inner = np.linalg.inv(fit.T_cam_obj)[:3, 3]  # the camera, in the object's frame
        for line in wires(fit.kind, fit.size):
            p = _moved(line, fit.T_cam_obj)
            if (p[:, 2] <= 0.01).any():
                continue
            px = np.round(8 * lens.project(p)).astype(np.int32)
            away = line - inner
            normal = line / np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-9)
            front = flat or (np.einsum("ni,ni->n", away, normal) < 0).mean() > 0.5
            cv2.polylines(picture, [px], False, colour, 2 if front else 1, cv2.LINE_AA, shift=3)
    write_panel(picture, [(_said(fit), STATUS_RGB[fit.status.value]) for fit in fits])
    return picture


def _said(fit: PrimitiveFit) -> str:
    return f"{fit.kind}: {fit.sizes_in_words()}"


def plot_cloud(points: NDArray[Any], fit: PrimitiveFit) -> Any:
    """Three views of the point cloud in the primitive's frame, with its wireframe."""
    from sdftrack.viz.plots import figure

    T = np.linalg.inv(fit.T_cam_obj)
    local = 1e3 * _moved(points[:: max(1, len(points) // CLOUD_POINTS)], T)
    fig, axes = figure(1, 3, size=(13.0, 4.6))
    for axis, (i, j) in zip(axes, ((0, 1), (0, 2), (1, 2)), strict=True):
        axis.plot(local[:, i], local[:, j], ".", markersize=1.2, alpha=0.5, color="#4a4e69")
        for line in wires(fit.kind, fit.size):
            axis.plot(1e3 * line[:, i], 1e3 * line[:, j], color="#d1495b", linewidth=1)
        axis.set_aspect("equal", adjustable="datalim")
        axis.set_xlabel(f"{'xyz'[i]} (mm)")
        axis.set_ylabel(f"{'xyz'[j]} (mm)")
    fig.suptitle(f"{_said(fit)}; rms {1e3 * fit.rms:.1f} mm, {fit.status.value}")
    return fig
