# SPDX-License-Identifier: MIT
"""Plots of a depth-to-colour registration: residuals before and after, coverage, and the ball's path."""

from __future__ import annotations

from typing import Any

import numpy as np

from sdftrack.calibration.color_result import ColorCalibration
from sdftrack.camera import RGBDCamera
from sdftrack.viz.plots import figure


def plot_residuals(result: ColorCalibration, before: RGBDCamera) -> Any:
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


def plot_coverage(result: ColorCalibration) -> Any:
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


def plot_path(result: ColorCalibration) -> Any:
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
