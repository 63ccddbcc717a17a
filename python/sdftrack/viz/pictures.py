# SPDX-License-Identifier: MIT
"""Figures of a run: a strip of frames, slices through a volume, errors over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.viz.plots import COLORS, figure

Array = NDArray[np.float64]
STATUS_SHADE = {"weak": "#f2c14e", "lost": "#d1495b", "bad_frame": "#9aa0a6"}


def strip(pictures: Sequence[NDArray[np.uint8]], columns: int = 3, scale: float = 0.75) -> NDArray[np.uint8]:
    """Arrange images of equal size in rows, with a thin gap."""
    import cv2

    small = [cv2.resize(p, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) for p in pictures]
    h, w = small[0].shape[:2]
    rows, gap = -(-len(small) // columns), 4
    out = np.full((rows * (h + gap) - gap, columns * (w + gap) - gap, 3), 255, np.uint8)
    for n, p in enumerate(small):
        y, x = (n // columns) * (h + gap), (n % columns) * (w + gap)
        out[y : y + h, x : x + w] = p
    return out


def plot_sdf_slices(sdf: Any) -> Any:
    """Three slices through the centre of a volume: distance in colours, the surface as a line."""
    values, h = np.asarray(sdf.values), 1e3 * sdf.voxel_size
    low = 1e3 * np.asarray(sdf.origin)
    count = np.array(values.shape)  # z, y, x
    inside = np.argwhere(values < 0)
    cut = inside.mean(axis=0).round().astype(int) if len(inside) else count // 2
    planes = [
        ("x (mm)", "z (mm)", values[:, cut[1], :], (low[0], low[2])),
        ("y (mm)", "z (mm)", values[:, :, cut[2]], (low[1], low[2])),
        ("x (mm)", "y (mm)", values[cut[0]], (low[0], low[1])),
    ]
    fig, axes = figure(1, 3, size=(13.0, 4.3))
    limit = 1e3 * float(np.percentile(np.abs(values), 90))
    shown = None
    for a, (across, up, plane, corner) in zip(axes, planes, strict=True):
        u = corner[0] + h * np.arange(plane.shape[1])
        v = corner[1] + h * np.arange(plane.shape[0])
        mm = 1e3 * plane
        shown = a.pcolormesh(u, v, mm, cmap="RdBu", vmin=-limit, vmax=limit, shading="auto", rasterized=True)
        lines = np.arange(-50, 101, 10)
        a.contour(u, v, mm, levels=lines[lines != 0], colors="k", linewidths=0.4, alpha=0.45)
        if mm.min() < 0 < mm.max():
            a.contour(u, v, mm, levels=[0.0], colors="k", linewidths=1.8)
        a.set_aspect("equal")
        a.grid(False)
        a.set_xlabel(across)
        a.set_ylabel(up)
    fig.colorbar(shown, ax=list(axes), label="signed distance (mm), negative inside", shrink=0.85)
    return fig


def plot_run(translation_m: Array, rotation_rad: Array, results: Sequence[Any], k: int = 0) -> Any:
    """Errors over the frames with the tracker's own 2-sigma, confidence, and weak or lost frames."""
    fig, axes = figure(3, 1, size=(9.0, 7.0), sharex=True, height_ratios=[3, 3, 2])
    frames = np.arange(len(results))
    spread = np.array([np.sqrt(np.clip(np.diag(r.covariances[k]), 0, None)) for r in results])
    rows = (
        (1e3 * translation_m, 1e3 * np.linalg.norm(spread[:, :3], axis=1), "translation error (mm)"),
        (np.rad2deg(rotation_rad), np.rad2deg(np.linalg.norm(spread[:, 3:], axis=1)), "rotation error (deg)"),
    )
    for a, (error, sigma, label), color in zip(axes, rows, COLORS, strict=False):
        a.fill_between(frames, 0, 2 * sigma, color=color, alpha=0.15, linewidth=0, label="its own 2 sigma")
        a.plot(frames, error, color=color, linewidth=1.2, label="error")
        top = 1.15 * max(float(np.nanpercentile(error, 99.5)), 2 * float(np.nanmedian(sigma)), 1e-3)
        a.set_ylim(0, top)
        a.set_ylabel(label)
        a.legend(fontsize=8, loc="upper left")
    axes[2].plot(frames, [r.inliers[k] for r in results], color=COLORS[2], label="share of inliers")
    axes[2].plot(frames, [r.confidence[k] for r in results], color=COLORS[3], label="confidence")
    axes[2].set_ylim(0, 1.05)
    axes[2].set_xlabel("frame")
    axes[2].legend(fontsize=8, loc="lower left")
    for a in axes:
        for i, r in enumerate(results):
            shade = STATUS_SHADE.get(str(r.status[k]))
            if shade is not None:
                a.axvspan(i - 0.5, i + 0.5, color=shade, alpha=0.25, linewidth=0)
    return fig
