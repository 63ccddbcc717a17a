# SPDX-License-Identifier: MIT
"""The picture of docs/color_calibration.md: the ball in both images, and depth drawn on colour before and after.

python -m docs.images.color_calibration docs/images/color_calibration.png
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import sdftrack as st
from experiments.synth.ball import ball_scene
from sdftrack import _core

scene = ball_scene(40, noise="kinect", seed=2)
depth_camera, color_camera = scene.camera.depth, scene.camera.color
result = st.calibrate_color_to_depth(scene.sequence, depth_camera, scene.radius_m, scene.color)
inside = np.all((scene.color_px > 110) & (scene.color_px < (530, 370)), axis=1)
i = int(np.argmin(np.where(inside, np.abs(scene.centers_cam[:, 2] - 0.7), 9)))
frame = scene.sequence[i]


def on_color(camera):
    """Depth pixels at steps, where `camera` puts them in the colour image."""
    z = frame.depth
    behind = np.where(z > 0, z, 9)  # beside a step the sensor often reads nothing
    step = np.zeros(z.shape, bool)
    for axis in (0, 1):
        for way in (1, -1):
            step |= (z > 0) & (z < 1.6) & (np.roll(behind, way, axis) > z + 0.1)
    return camera.project_to_color(depth_camera.back_project(z)[step])


u, v = scene.color_px[i]
fig, axes = plt.subplots(1, 4, figsize=(13, 3.5), layout="constrained")
mask = _core.BallColor(scene.color).mask(frame.color)
outline = _core.find_outlines(frame.color, mask, color_camera._core)[0]
center, _ = outline.center(color_camera._core)
axes[0].imshow(frame.color)
axes[0].plot(*outline.edges_px.T, ".", color="white", markersize=2)
axes[0].plot(*center, "+", color="white", markersize=12)
axes[0].plot(*outline.edges_px.mean(axis=0), "x", color="black", markersize=7)
axes[0].set(xlim=(u - 45, u + 45), ylim=(v + 45, v - 45))
axes[0].set_title("colour: edges, centre +, mean of the edges x", fontsize=9)
finder = _core.BallFinder(depth_camera._core, scene.radius_m)
ball = min(finder.search(frame.depth), key=lambda b: b.center_cam[2])
angle = np.linspace(0, 2 * np.pi, 90)
rim = ball.center_cam + scene.radius_m * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
axes[1].imshow(np.where(frame.depth > 0, frame.depth, np.nan), cmap="viridis", vmax=2)
axes[1].plot(*depth_camera.project(rim).T, color="white", linewidth=1.2)
axes[1].set_title("depth: the fitted sphere", fontsize=9)
for axis, camera, name in (
    (axes[2], st.RGBDCamera(depth_camera), "taken as aligned"),
    (axes[3], result.camera, f"registered (rms {result.rms_px:.2f} px)"),
):
    axis.imshow(frame.color)
    axis.plot(*on_color(camera).T, ".", color="cyan", markersize=0.8)
    axis.set(xlim=(u - 110, u + 160), ylim=(v + 160, v - 110))
    axis.set_title(f"steps of depth on colour: {name}", fontsize=9)
for axis in axes:
    axis.set(xticks=[], yticks=[])
fig.savefig(sys.argv[1], dpi=100)
