# SPDX-License-Identifier: MIT
"""Plots of calibrations: of the intrinsics, and of the errors of a depth camera."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.calibration.depth import DepthCalibration
from sdftrack.calibration.intrinsics_residuals import Misfit
from sdftrack.calibration.intrinsics_result import IntrinsicsResult
from sdftrack.calibration.observability import MIN_IN_CELL
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
