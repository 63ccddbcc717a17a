# SPDX-License-Identifier: MIT
"""Plots without a window: figure style and saving; pictures of a run."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import MissingExtra, need

COLORS = ("#2b6cb0", "#d1495b", "#3a9d6b", "#8456a5", "#e08e2b", "#4a4e69")
EXTRA = "plots"
STATUS_SHADE = {"weak": "#f2c14e", "lost": "#d1495b", "bad_frame": "#9aa0a6"}
Array = NDArray[np.float64]


def figure(
    rows: int = 1, columns: int = 1, size: tuple[float, float] = (8.0, 4.5), **options: Any
) -> tuple[Any, Any]:
    """A figure and its axes, without a display; `options` as in ``Figure.subplots``. Needs the extra [plots]."""
    need("matplotlib", EXTRA)
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    fig = Figure(figsize=size, dpi=110, layout="constrained")
    FigureCanvasAgg(fig)
    axes = fig.subplots(rows, columns, **options)
    for a in fig.axes:
        a.set_prop_cycle(color=COLORS)
        a.grid(True, alpha=0.25, linewidth=0.7)
        a.spines[["top", "right"]].set_visible(False)
    return fig, axes


def save_figure(fig: Any, path: Path) -> None:
    """Write a PNG, completely or not at all."""
    from sdftrack._internal.files import replacing

    with replacing(path) as temporary:
        fig.savefig(temporary, format="png")


def write_plots(folder: Path, plots: Mapping[str, Callable[[], Any]]) -> list[str]:
    """Plots of a command, by name and by what makes the figure; returns the names of those written."""
    # Without Matplotlib none is: a warning says how to install it, and plots of an earlier run are removed.
    try:
        need("matplotlib", EXTRA)
    except MissingExtra as error:
        for name in plots:
            (folder / name).unlink(missing_ok=True)
        warnings.warn(f"no {', '.join(plots)}: {error}", RuntimeWarning, stacklevel=2)
        return []
    for name, make in plots.items():
        save_figure(make(), folder / name)
    return list(plots)


def strip(pictures: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Arrange images of equal size in rows of three, smaller and with a thin gap."""
    import cv2

    small = [cv2.resize(p, None, fx=0.75, fy=0.75, interpolation=cv2.INTER_AREA) for p in pictures]
    columns, (h, w) = 3, small[0].shape[:2]
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
