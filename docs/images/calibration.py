# SPDX-License-Identifier: MIT
"""The picture of docs/calibration.md: where the object was, an unknown over frames, residuals before and after.

python docs/images/calibration.py docs/images/calibration.png
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import sdftrack as st
from sdftrack.calibration.intrinsics_residuals import compare
from sdftrack.calibration.intrinsics_result import MIN_IN_CELL
from sdftrack.calibration.plots import show_cells, show_estimate
from sdftrack.synth.objects import duck_mesh

truth = st.Camera(572, 570, 318, 243, 640, 480)
guess = st.Camera(600, 600, 300, 200, 640, 480)
path = st.synth.sweep(near_m=0.5, far_m=0.9, reach_x=0.42, reach_y=0.30)
sequence = st.synth.sequence(duck_mesh(), 100, path, 0.002, seed=5, camera=truth, color=False)
shape = st.SDF.from_mesh(duck_mesh(), voxels=150)
frames = [sequence[i] for i in range(len(sequence))]
result = st.calibrate_intrinsics(frames, shape, guess, sequence.ground_truth[0][0])
before, after = compare(frames, shape, guess, result)
print(result, result.reason)
print(f"median distance from the surface: {1e3 * before.median_m:.2f} mm, then {1e3 * after.median_m:.2f} mm")

fig, axes = plt.subplots(2, 3, figsize=(13, 6.2), layout="constrained")
coverage = result.observability.coverage
seen = np.where(coverage > 0, coverage, np.nan).astype(float)
show_cells(axes[0, 0], seen / 1000, result, coverage < MIN_IN_CELL, "{:.1f}", cmap="viridis", vmin=0)
axes[0, 0].set_title("coverage: thousands of readings of the object", fontsize=9)
shared = {"cmap": "magma", "vmin": 0, "vmax": 1e3 * float(np.nanmax(before.cells_m)), "text": "{:.1f}"}
for axis, misfit, name in ((axes[0, 1], before, "first guess"), (axes[0, 2], after, "calibrated")):
    show_cells(axis, 1e3 * misfit.cells_m, result, **shared)
    axis.set_title(f"{name}: distance from the surface, median {1e3 * misfit.median_m:.2f} mm", fontsize=9)
for axis, name in zip(axes[1], ("fx", "cx", "cy"), strict=True):
    k = result.free.index(name)
    show_estimate(axis, result, k)
    axis.axhline(getattr(truth, name), color="black", linestyle=":", linewidth=1.2, label="truth")
    axis.set_title(f"{name}, first guess {getattr(guess, name):g} px", fontsize=9)
    axis.grid(True, alpha=0.25)
axes[1, 0].legend(fontsize=8)
for axis in axes[0]:
    axis.set(xlabel="", ylabel="")
fig.savefig(sys.argv[1], dpi=100)
