# SPDX-License-Identifier: MIT
"""Plots of a depth calibration: noise, its growth with incidence, and bias, with the measurements."""

from __future__ import annotations

from typing import Any

import numpy as np

from sdftrack.calibration.depth import DepthCalibration
from sdftrack.viz.plots import COLORS, figure

__all__ = ["plot_depth_errors"]


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
