# SPDX-License-Identifier: MIT
"""The pose errors of the BOP challenge and their recall (Hodan et al., ECCV workshops 2018 and 2020)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import whole
from sdftrack.camera import depth_camera
from sdftrack.metrics.scores import _points, _poses
from sdftrack.symmetry import Symmetry

Array = NDArray[np.float64]
TAUS = np.arange(0.05, 0.51, 0.05)  # of the diameter (VSD) and thresholds of MSSD; thresholds of VSD
MSPD_PX = np.arange(5.0, 51.0, 5.0)  # at an image width of 640


def mssd(T: ArrayLike, T_gt: ArrayLike, points: Any, symmetry: Symmetry | None = None) -> float:
    """Maximum symmetry-aware surface distance, m: min over symmetries S of max over points |T x - T_gt S x|."""
    A, p = _one(T, "T"), _points(points)
    seen = p @ A[:3, :3].T + A[:3, 3]
    best = np.inf
    for B in _equal(T_gt, symmetry):
        best = min(best, float(((seen - p @ B[:3, :3].T - B[:3, 3]) ** 2).sum(axis=1).max()))
    return float(np.sqrt(best))


def mspd(T: ArrayLike, T_gt: ArrayLike, points: Any, camera: Any, symmetry: Symmetry | None = None) -> float:
    """Maximum symmetry-aware projection distance, pixels; infinite if a point of `T` is not in front of the camera."""
    lens = depth_camera(camera)
    A, p = _one(T, "T"), _points(points)
    seen = _projected(p @ A[:3, :3].T + A[:3, 3], lens)
    if seen is None:
        return float("inf")
    best = np.inf
    for B in _equal(T_gt, symmetry):
        true = _projected(p @ B[:3, :3].T + B[:3, 3], lens)
        if true is not None:
            best = min(best, float(((seen - true) ** 2).sum(axis=1).max()))
    return float(np.sqrt(best))


def vsd(
    depth: ArrayLike,
    depth_estimate: ArrayLike,
    depth_gt: ArrayLike,
    camera: Any,
    tau: float | ArrayLike,
    delta: float = 0.015,
) -> Any:
    """Visible surface discrepancy, 0..1, one number for each `tau`.

    Parameters
    ----------
    depth, depth_estimate, depth_gt : (H, W) arrays
        The frame's depth and the object rendered alone at the estimated and the true pose, m; 0: nothing.
    camera : Camera or RGBDCamera
    tau : float or array
        Tolerance between two visible surfaces along the ray, m; BOP uses 5 % to 50 % of the diameter.
    delta : float
        Tolerance for a surface behind the frame's depth to count as visible, m.

    Returns
    -------
    float, or float64 array like `tau`
        Fraction of the pixels in the union of both visible masks in which the two renderings disagree.
    """
    lens = depth_camera(camera)
    scene, found, true = (np.asarray(d, np.float64) for d in (depth, depth_estimate, depth_gt))
    if not scene.shape == found.shape == true.shape == tuple(lens.shape):
        raise ValueError(
            f"depth, depth_estimate, depth_gt: expected the camera's shape {tuple(lens.shape)}, got {scene.shape}, "
            f"{found.shape} and {true.shape}"
        )
    limits = np.asarray(tau, np.float64)
    if not (np.isfinite(limits) & (limits > 0)).all() or not delta >= 0:
        raise ValueError(f"tau, delta: expected metres above 0, got {tau!r} and {delta}")
    v, u = np.indices(scene.shape)
    # Distances from the camera's centre in place of depths.
    ray = np.sqrt(((u - lens.cx) / lens.fx) ** 2 + ((v - lens.cy) / lens.fy) ** 2 + 1)
    scene, found, true = (d * ray for d in (scene, found, true))
    visible_true = (true > 0) & ((scene <= 0) | (true <= scene + delta))
    # What hides nothing of the true object hides nothing of the estimate there either.
    visible = (found > 0) & ((scene <= 0) | (found <= scene + delta) | visible_true)
    union = np.count_nonzero(visible | visible_true)
    if not union:
        return 1.0 if limits.ndim == 0 else np.ones(limits.shape)
    both = visible & visible_true
    apart = np.abs(found - true)[both]
    cost = (apart >= limits[..., None]).sum(axis=-1) + union - np.count_nonzero(both)
    return float(cost / union) if limits.ndim == 0 else cost / union


def average_recall(
    vsd_errors: ArrayLike | None = None,
    mssd_errors: ArrayLike | None = None,
    mspd_errors: ArrayLike | None = None,
    diameter: float | ArrayLike | None = None,
    width: int = 640,
) -> dict[str, float]:
    """BOP's average recall: the fraction of poses below a threshold, averaged over the thresholds.

    Parameters
    ----------
    vsd_errors : (N, 10) array, optional
        VSD at the ten `tau` of 5 % to 50 % of the diameter; thresholds 0.05 to 0.5.
    mssd_errors : (N,) array, optional
        m; thresholds 5 % to 50 % of `diameter` (m, one number or one for each).
    mspd_errors : (N,) array, optional
        Pixels; thresholds 5 to 50 times `width` / 640.

    Returns
    -------
    dict
        "AR_VSD", "AR_MSSD", "AR_MSPD" for the given errors, and "AR", their mean. NaN and infinity (lost) count as
        wrong.
    """
    out: dict[str, float] = {}
    if vsd_errors is not None:
        e = _errors(vsd_errors, "vsd_errors", 2)
        out["AR_VSD"] = float((e[..., None] < TAUS).mean())
    if mssd_errors is not None:
        if diameter is None:
            raise ValueError("diameter: expected metres beside mssd_errors, got None")
        e = _errors(mssd_errors, "mssd_errors", 1)
        out["AR_MSSD"] = float((e[:, None] < TAUS * np.broadcast_to(diameter, e.shape)[:, None]).mean())
    if mspd_errors is not None:
        e = _errors(mspd_errors, "mspd_errors", 1)
        out["AR_MSPD"] = float((e[:, None] < MSPD_PX * whole(width, "width", 1) / 640).mean())
    if not out:
        raise ValueError("vsd_errors, mssd_errors, mspd_errors: expected at least one of them, got none")
    out["AR"] = float(np.mean(list(out.values())))
    return out


def _errors(values: ArrayLike, name: str, dimensions: int) -> Array:
    e = np.asarray(values, np.float64)
    if e.ndim != dimensions or not e.size:
        raise ValueError(f"{name}: expected {dimensions} dimensions and at least one number, got {e.shape}")
    return np.where(np.isfinite(e), e, np.inf)


def _one(T: ArrayLike, name: str) -> Array:
    A = _poses(T, name)
    if A.ndim != 2:
        raise ValueError(f"{name}: expected one pose of shape (4, 4), got {A.shape}")
    return A


def _equal(T_gt: ArrayLike, symmetry: Symmetry | None) -> Array:
    B = _one(T_gt, "T_gt")
    return B[None] if symmetry is None else B @ symmetry.motions()


def _projected(p_cam: Array, lens: Any) -> Array | None:
    if not (p_cam[:, 2] > 0).all():
        return None
    return np.stack(
        [lens.fx * p_cam[:, 0] / p_cam[:, 2] + lens.cx, lens.fy * p_cam[:, 1] / p_cam[:, 2] + lens.cy], axis=1
    )
