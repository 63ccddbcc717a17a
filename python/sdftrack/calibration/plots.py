# SPDX-License-Identifier: MIT
"""Plots of calibrations: of the intrinsics, of the errors of a depth camera, of depth to colour."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.calibration.color_result import ColorCalibration
from sdftrack.calibration.depth import DepthCalibration
from sdftrack.calibration.intrinsics_residuals import Misfit
from sdftrack.calibration.intrinsics_result import MIN_IN_CELL, IntrinsicsResult
from sdftrack.camera import RGBDCamera
from sdftrack.viz.plots import COLORS, figure

Array = NDArray[np.float64]

UNITS = {"fx": "px", "fy": "px", "cx": "px", "cy": "px", "skew": "px", "depth_offset": "m"}
FIRST_SHOWN = 0.2  # of the frames are left out of the range of the axis: their means still jump about
BAND_IN_VIEW = 3.0  # the axis holds so many half-widths of the interval about the value at least


def plot_coverage(result: IntrinsicsResult) -> Any:
    """Number of object pixels in each cell of the image; cells with too few are crossed out."""
    fig, axis = figure(1, 1, (6.6, 5.0))
    coverage = result.observability.coverage
    few = coverage < MIN_IN_CELL
    shown = np.where(coverage > 0, coverage, np.nan).astype(float)
    picture = show_cells(axis, shown, result, few, cmap="viridis", vmin=0)
    fig.colorbar(picture, ax=axis, label="depth measurements of the object")
    axis.set_title(
        f"the object covered {100 * np.mean(~few):.0f} % of the image (x: fewer than {MIN_IN_CELL} pixels)",
        fontsize=10,
    )
    return fig


def plot_estimates(result: IntrinsicsResult) -> Any:
    """Each parameter over the number of frames: single frames, running mean, and result with its interval."""
    n = len(result.free)
    columns = 2 if n > 1 else 1
    rows = -(-n // columns)
    fig, axes = figure(rows, columns, (5.6 * columns, 2.6 * rows + 0.4), squeeze=False)
    for k, axis in enumerate(axes.flat):
        if k < n:
            show_estimate(axis, result, k)
        else:
            axis.set_axis_off()
    axes.flat[0].legend(fontsize=8, loc="best")
    return fig


def show_estimate(axis: Any, result: IntrinsicsResult, k: int) -> None:
    """Draw the k-th parameter over the number of frames into `axis`."""
    name, value, (low, high) = result.free[k], result.values[k], result.interval95[k]
    single, running = result.per_frame.values[:, k], result.per_frame.running()[:, k]
    count = np.arange(1, len(single) + 1)
    axis.plot(count, single, ".", color="0.7", markersize=3, label="single frame")
    axis.plot(count, running, color=COLORS[1], linewidth=1.4, label="running mean")
    axis.axhspan(low, high, color=COLORS[0], alpha=0.2, label="95 %")
    axis.axhline(
        value, color=COLORS[0], linewidth=1.2, label="all together" if result.joint else "the answer"
    )
    settled = running[int(FIRST_SHOWN * len(running)) :]
    reach = max(float(np.abs(settled - value).max()), 0.5 * BAND_IN_VIEW * (high - low))
    axis.set(xlim=(0, len(single) + 1), ylim=(value - 1.2 * reach, value + 1.2 * reach), xlabel="frames")
    axis.ticklabel_format(axis="y", useOffset=False)
    unit = UNITS.get(name, "")
    axis.set_ylabel(f"{name}, {unit}" if unit else name)


def plot_residuals(before: Misfit, after: Misfit, result: IntrinsicsResult) -> Any:
    """Median distance of the measurements from the surface, by cells, for the initial and the calibrated camera."""
    fig, axes = figure(1, 2, (11.0, 4.4))
    known = np.concatenate([before.cells_m.ravel(), after.cells_m.ravel()])
    known = known[np.isfinite(known)]
    max_mm = 1e3 * float(known.max()) if len(known) else 1.0
    picture = None
    for axis, seen, name in ((axes[0], before, "first guess"), (axes[1], after, "calibrated")):
        picture = show_cells(
            axis, 1e3 * seen.cells_m, result, cmap="magma", vmin=0, vmax=max_mm, text="{:.1f}"
        )
        told = f"median {1e3 * seen.median_m:.2f} mm" if seen.frames else "the object was not found"
        axis.set_title(f"{name}: {told}, {seen.frames} frames", fontsize=10)
    fig.colorbar(picture, ax=axes, label="distance from the surface, mm")
    return fig


def show_cells(
    axis: Any,
    cells: Array,
    result: IntrinsicsResult,
    crossed: NDArray[np.bool_] | None = None,
    text: str = "",
    **options: Any,
) -> Any:
    """Cells drawn over the frame of the image, NaN as blank; `text` formats each one's number."""
    w, h = result.camera.width, result.camera.height
    picture = axis.imshow(cells, extent=(-0.5, w - 0.5, h - 0.5, -0.5), interpolation="nearest", **options)
    rows, columns = cells.shape
    limit = picture.norm.vmax
    for i in range(rows):
        for j in range(columns):
            at = ((j + 0.5) * w / columns - 0.5, (i + 0.5) * h / rows - 0.5)
            if crossed is not None and crossed[i, j]:
                axis.text(*at, "x", ha="center", va="center", color=COLORS[1], fontsize=9)
            elif text and np.isfinite(cells[i, j]):
                ink = "black" if cells[i, j] > 0.6 * limit else "white"
                axis.text(*at, text.format(cells[i, j]), ha="center", va="center", color=ink, fontsize=7)
    axis.plot(result.camera.cx, result.camera.cy, "+", color=COLORS[1], markersize=10)
    axis.grid(False)
    axis.set(xlim=(-0.5, w - 0.5), ylim=(h - 0.5, -0.5), xlabel="column, px", ylabel="row, px")
    return picture


# -- Plots of a depth calibration: noise, its growth with incidence, and bias, with the measurements


def plot_depth_errors(result: DepthCalibration) -> Any:
    """Noise over distance (nearly frontal views) and over incidence; the smooth error and the bias over distance."""
    sensor = result.sensor
    z, tangent, sd = (np.array([s[k] for s in result.noise]) for k in range(3))
    fig, axes = figure(1, 3, (12.0, 3.6))
    line = np.linspace(0.95 * z.min(), 1.05 * z.max(), 60)
    straight = tangent < 1.0
    axes[0].plot(z[straight], 1e3 * sd[straight], ".", color=COLORS[0], label="measured, below 45 degrees")
    axes[0].plot(line, 1e3 * sensor.noise(line), color=COLORS[1], label="model, straight")
    axes[0].set(xlabel="distance m", ylabel="noise sd mm", title="noise over distance")
    angle = np.degrees(np.arctan(tangent))
    ratio = sd / sensor.noise(z)
    axes[1].plot(angle, ratio, ".", color=COLORS[0], label="seen")
    angles = np.linspace(0, 75, 60)
    middle = float(np.median(z))
    model = sensor.noise(middle, np.radians(angles)) / sensor.noise(middle)
    axes[1].plot(angles, model, color=COLORS[1], label=f"model at {middle:.2f} m")
    axes[1].set(
        xlabel="incidence, degrees", ylabel="noise relative to frontal view", title="noise over incidence"
    )
    if len(result.systematic):
        axes[2].plot(*(result.systematic * [1, 1e3]).T, ".", color=COLORS[0], label="smooth error, sd")
    axes[2].plot(line, 1e3 * sensor.systematic(line), color=COLORS[1], label="model of it")
    if len(result.bias):
        axes[2].plot(*(result.bias * [1, 1e3]).T, "x", color=COLORS[2], label="measured minus true")
        axes[2].plot(line, 1e3 * sensor.bias(line), color=COLORS[2], label="bias")
    axes[2].set(xlabel="distance m", ylabel="mm", title="systematic part")
    for axis in axes:
        axis.legend(fontsize=7)
    return fig


# -- Plots of a depth-to-colour registration: residuals before and after, coverage, and the ball's path


def plot_color_residuals(result: ColorCalibration, before: RGBDCamera) -> Any:
    """Residuals over the colour image for the previous camera (`before`) and the new one, equally magnified."""
    p = result.pairs
    old = p.color_px - before.project_to_color(p.center_cam)
    fig, axes = figure(1, 2, (11.0, 4.2))
    for axis, r, name in ((axes[0], old, "before"), (axes[1], p.residual_px, "after")):
        known = np.isfinite(r).all(axis=1)
        size = float(np.median(np.linalg.norm(r[known], axis=1))) if known.any() else 1.0
        enlarged = 30 / max(size, 1e-6)
        for kept, color in ((True, "#2b6cb0"), (False, "#d1495b")):
            use = known & (p.kept == kept)
            if use.any():
                axis.quiver(
                    *p.color_px[use].T, *(enlarged * r[use]).T, angles="xy", scale_units="xy", scale=1, color=color,
                    width=0.003, label="kept" if kept else "dropped",
                )  # fmt: skip
        rms = float(np.sqrt((r[known & p.kept] ** 2).sum(axis=1).mean()))
        axis.set_title(f"{name}: rms {rms:.2f} px, arrows magnified x {enlarged:.0f}", fontsize=10)
        _image_axes(axis, result)
        axis.legend(fontsize=8)
    return fig


def plot_color_coverage(result: ColorCalibration) -> Any:
    """Distribution of the pairs over the image and depth: outside it the registration is extrapolated."""
    p = result.pairs
    fig, axes = figure(1, 2, (11.0, 4.2))
    shown = axes[0].scatter(*p.color_px[p.kept].T, c=p.center_cam[p.kept, 2], s=14, cmap="viridis")
    fig.colorbar(shown, ax=axes[0], label="depth, m")
    _image_axes(axes[0], result)
    axes[0].set_title("colour image", fontsize=10)
    axes[1].hist(p.center_cam[p.kept, 2], 20)
    axes[1].set(xlabel="depth, m", ylabel="pairs")
    return fig


def plot_ball_path(result: ColorCalibration) -> Any:
    """The ball's path in the depth camera's frame, and residuals per frame."""
    p = result.pairs
    fig, axes = figure(1, 2, (11.0, 4.2))
    for k, name in enumerate("xyz"):
        axes[0].plot(p.index, p.center_cam[:, k], ".-", markersize=3, linewidth=0.8, label=name)
    axes[0].set(xlabel="frame", ylabel="centre, m")
    axes[0].legend(fontsize=8)
    for k, name in enumerate(("along x", "along y")):
        axes[1].plot(p.index, p.residual_px[:, k], ".-", markersize=3, linewidth=0.6, label=name)
    axes[1].plot(p.index[~p.kept], p.residual_px[~p.kept, 0], "x", color="#d1495b", label="dropped")
    axes[1].set(xlabel="frame", ylabel="residual, px")
    axes[1].legend(fontsize=8)
    return fig


def _image_axes(axis: Any, result: ColorCalibration) -> None:
    w, h = result.color_size
    axis.set(xlim=(0, w), ylim=(h, 0), xlabel="column", ylabel="row", aspect="equal")
