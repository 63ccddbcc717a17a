# SPDX-License-Identifier: MIT
"""The noise of recorded depth: how it grows with distance, and how far its errors reach from pixel to pixel."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
REACH_PX = 3
SAMPLES = 200  # fewer in a bin say nothing
MAD = 0.6745  # median of |x| for a unit Gaussian


def temporal_sd(depths: Array) -> tuple[Array, Array]:
    """Median distance and sd over time of every pixel that nothing moves in: (N,) each, m.

    depths : (frames, H, W) float m, 0 = none. The sd is of the difference of successive frames over sqrt(2), so that
    slow drifts do not count; pixels that miss a reading are left out.
    """
    valid = (depths > 0).all(axis=0)
    steps = np.diff(depths[:, valid], axis=0)
    return np.median(depths[:, valid], axis=0), np.sqrt(np.mean(steps**2, axis=0) / 2)


def local_sd(depth: Array) -> tuple[Array, Array]:
    """Distance of a pixel and |z(u - 3) - 2 z(u) + z(u + 3)| / sqrt(6): on smooth surfaces an sd, m."""
    left, middle, right = depth[:, : -2 * REACH_PX], depth[:, REACH_PX:-REACH_PX], depth[:, 2 * REACH_PX :]
    valid = (left > 0) & (middle > 0) & (right > 0)
    return middle[valid], np.abs(left - 2 * middle + right)[valid] / np.sqrt(6)


def fit_noise(z: Array, sd: Array) -> tuple[float, float]:
    """(noise_m, noise_per_m) of sd = noise_m + noise_per_m z^2, both >= 0, least squares of relative errors."""
    A = np.column_stack([np.ones(len(z)), z**2]) / sd[:, None]
    x = np.linalg.lstsq(A, np.ones(len(z)), rcond=None)[0]
    if x[0] < 0:
        x = np.array([0.0, float(A[:, 1].sum() / (A[:, 1] ** 2).sum())])
    if x[1] < 0:
        x = np.array([float(A[:, 0].sum() / (A[:, 0] ** 2).sum()), 0.0])
    return float(x[0]), float(x[1])


def binned(z: Array, value: Array, edges: Array, quantile: float = 0.5) -> list[tuple[float, float, int]]:
    """(middle, quantile of value, count) of the bins that hold enough."""
    rows = []
    for low, high in itertools.pairwise(edges):
        here = (z >= low) & (z < high)
        if here.sum() >= SAMPLES:
            rows.append(
                (float(np.median(z[here])), float(np.quantile(value[here], quantile)), int(here.sum()))
            )
    return rows


def residual_table(seq: Any, k: int, sdf: Any, frames: int, threads: int) -> dict[str, float]:
    """What is left of an object's readings at the tracked pose: robust sd, distance, correlation area (medians)."""
    import sdftrack as st
    from sdftrack import _core

    tracker = st.Tracker(sdf, seq.camera, mode="depth", threads=threads)
    rows = []
    for i in range(frames):
        frame = seq[i]
        first = [np.asarray(seq.ground_truth[0][k])]
        result = tracker.track(frame) if i else tracker.start(frame, poses=first)
        energy = st.Energy(sdf, seq.camera, frame, result.pose, scale_m=0.002, max_pixels=100000)
        r = energy.residuals(energy.start)
        near = (r["hit"] == 1) & (np.abs(r["residual_m"]) < 0.02)
        residual = r["residual_m"][near]
        sd = float(np.quantile(np.abs(residual), 0.3) / 0.3853)
        area = _core.correlation_area(r["u_px"][near], r["v_px"][near], residual, sd, 0.1)
        rows.append((float(np.median(r["depth_m"][near])), sd, area))
    z, sd, area = np.median(np.array(rows), axis=0)
    return {"z_m": float(z), "sd_m": float(sd), "area_px": float(area)}


def lines(data: Path, frames: int = 10, threads: int = 0) -> list[str]:
    """The tables for k1 and ycbv10, as text."""
    import sdftrack as st

    out: list[str] = []
    edges = np.array([0.5, 0.7, 0.9, 1.1, 1.4, 1.8, 2.3, 3.0, 4.0])
    for name, still in (("k1", 25), ("ycbv10", 0)):
        with st.open_sequence(data / name) as seq:
            depths = np.array([seq[i].depth for i in range(still or len(seq))], np.float64)
            curves = {
                "between neighbours": [np.concatenate(p) for p in zip(*map(local_sd, depths), strict=True)]
            }
            if still:
                curves["over time"] = list(temporal_sd(depths))
            for kind, (z, sd) in curves.items():
                rows = binned(z, sd / (MAD if kind == "between neighbours" else 1), edges)
                s0, s2 = fit_noise(np.array([r[0] for r in rows]), np.array([r[1] for r in rows]))
                out.append(f"{name}, {kind}: s(Z) = {1e3 * s0:.2f} mm + {1e3 * s2:.2f} mm/m^2 Z^2")
                out += [f"   {z:5.2f} m  {1e3 * s:6.2f} mm  {n:8d} readings" for z, s, n in rows]
            for k, obj_id in enumerate(seq.objects):
                sdf = st.SDF.from_mesh(seq.models[obj_id])
                r = residual_table(seq, k, sdf, min(frames, len(seq)), threads)
                out.append(
                    f"{name}, object {k}: residuals at {r['z_m']:.2f} m: sd {1e3 * r['sd_m']:.2f} mm, "
                    f"shared by {r['area_px']:.0f} px"
                )
    return out
