# SPDX-License-Identifier: MIT
"""Scores of poses, shapes and segmentations against the truth, those of the BOP challenge among them (Hodan et al.,
ECCV workshops 2018 and 2020)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import numbers, whole
from sdftrack.camera import depth_camera
from sdftrack.symmetry import Symmetry

Array = NDArray[np.float64]
FAR_M = 1e15  # no length in metres; its square is a number


def pose_error(T: ArrayLike, T_gt: ArrayLike) -> tuple[Any, Any]:
    """Distance of two poses.

    Parameters
    ----------
    T, T_gt : (..., 4, 4) arrays of T_cam_obj, m; they broadcast against each other

    Returns
    -------
    metres : float, or float64 array for stacks
        Distance between the two object origins.
    radians : float, or float64 array for stacks
        Angle of the rotation between them, in [0, pi], exact for small angles too.
    """
    A, B = _poses(T, "T"), _poses(T_gt, "T_gt")
    R = np.swapaxes(B[..., :3, :3], -1, -2) @ A[..., :3, :3]
    sine = 0.5 * np.linalg.norm(
        np.stack(
            [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1
        ),
        axis=-1,
    )
    # acos of the trace alone loses half of the digits at small angles.
    angle = np.arctan2(sine, 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1))
    distance = np.linalg.norm(A[..., :3, 3] - B[..., :3, 3], axis=-1)
    return (float(distance), float(angle)) if np.ndim(angle) == 0 else (distance, angle)


def add(T: ArrayLike, T_gt: ArrayLike, points: Any) -> Any:
    """ADD (Hinterstoisser et al. 2012): mean distance of each model point to itself under both poses, m. `points` is an
    (N, 3) array in the object's frame, m, or a Mesh (its vertices). Stacks of poses give an array."""
    A, B, p = _poses(T, "T"), _poses(T_gt, "T_gt"), _points(points)
    D = A[..., :3, :] - B[..., :3, :]
    moved = p @ np.swapaxes(D[..., :3], -1, -2) + D[..., None, :, 3]
    mean = np.linalg.norm(moved, axis=-1).mean(axis=-1)
    return float(mean) if np.ndim(mean) == 0 else mean


def adds(T: ArrayLike, T_gt: ArrayLike, points: Any) -> Any:
    """ADD-S: mean distance of each model point under `T_gt` to the nearest under `T`, m; NaN for a lost pose."""
    A, B = np.broadcast_arrays(_poses(T, "T"), _poses(T_gt, "T_gt"))
    p = _points(points)
    nearest = _nearest_in(p)
    flat = []
    for a, b in zip(A.reshape(-1, 4, 4), B.reshape(-1, 4, 4), strict=True):
        # Distances are the same in every frame: one tree in the object's serves all poses.
        with np.errstate(invalid="ignore", over="ignore"):  # of a lost pose
            seen = (p @ b[:3, :3].T + b[:3, 3] - a[:3, 3]) @ a[:3, :3]
        flat.append(float(nearest(seen).mean()) if np.isfinite(seen).all() else np.nan)
    return flat[0] if A.ndim == 2 else np.reshape(flat, A.shape[:-2])


def auc(errors: ArrayLike, threshold: float = 0.1) -> float:
    """Area under the curve of accuracy over threshold, 0..1: 1 when every error is 0. `errors` in metres; NaN or
    infinite entries (lost) count as never accurate. Exact integral from 0 to `threshold` (m; 0.1 is usual for ADD), not
    a sum over steps."""
    if not (np.isfinite(threshold) and threshold > 0):
        raise ValueError(f"threshold: expected metres above 0, got {threshold}")
    e = np.ravel(np.asarray(errors, dtype=np.float64))
    if not e.size:
        raise ValueError("errors: expected at least one number, got none")
    if (e < 0).any():
        raise ValueError("errors: expected distances >= 0, got a negative one")
    e = np.where(np.isfinite(e), e, np.inf)
    return float(np.maximum(0.0, 1.0 - e / threshold).mean())


def chamfer(a: Any, b: Any, samples: int = 20000, seed: int = 0) -> float:
    """Half the sum of the two mean nearest-point distances, m. `a`, `b` are (N, 3) arrays or Meshes; a Mesh is sampled
    uniformly by area at `samples` points, so two samplings of one surface differ by about half their spacing."""
    p, q = (_surface_points(m, samples, seed + i) for i, m in enumerate((a, b)))
    return float(0.5 * (_nearest_in(q)(p).mean() + _nearest_in(p)(q).mean()))


def iou(a: ArrayLike, b: ArrayLike) -> float:
    """Intersection over union of two masks (or two occupancy volumes) of one shape; 1 when both are empty."""
    A, B = np.asarray(a) != 0, np.asarray(b) != 0
    if A.shape != B.shape:
        raise ValueError(f"a, b: expected masks of one shape, got {A.shape} and {B.shape}")
    union = np.count_nonzero(A | B)
    return float(np.count_nonzero(A & B) / union) if union else 1.0


def boundary_recall(labels: ArrayLike, truth: ArrayLike, tolerance: int = 2) -> float:
    """Fraction of the true boundary pixels with one of `labels` within `tolerance` pixels (Chebyshev)."""
    import cv2

    L, G = _label_images(labels, truth)
    true_edges = _edges(G)
    reach = min(whole(tolerance, "tolerance", 0), max(L.shape))
    square = np.ones((2 * reach + 1,) * 2, np.uint8)
    near = cv2.dilate(_edges(L).view(np.uint8), square, borderType=cv2.BORDER_CONSTANT, borderValue=0) != 0
    total = np.count_nonzero(true_edges)
    return float(np.count_nonzero(true_edges & near) / total) if total else 1.0


def undersegmentation(labels: ArrayLike, truth: ArrayLike) -> float:
    """Under-segmentation error of Neubert and Protzel (2012), 0 = every superpixel lies in one segment. For each true
    segment that it touches, a superpixel adds the smaller of its parts inside and outside."""
    overlap = _overlaps(labels, truth)
    outside = overlap.sum(axis=1, keepdims=True) - overlap
    return float(np.minimum(overlap, outside).sum() / overlap.sum())


def achievable_accuracy(labels: ArrayLike, truth: ArrayLike) -> float:
    """Achievable segmentation accuracy (Liu et al. 2011): the upper bound for segmentations composed of superpixels.
    Fraction of correct pixels if each superpixel is assigned to the true segment with the largest overlap."""
    overlap = _overlaps(labels, truth)
    return float(overlap.max(axis=1).sum() / overlap.sum())


def plane_angles(frame: Any, camera: Any = None, tolerance: float = 0.01) -> Array:
    """Angles between the three largest planes of a depth image, degrees, ascending.

    For three orthogonal planes, the deviation from 90 indicates the quality of the intrinsics (thesis, Table 3.1 and
    Fig. 3.13). Each plane is fitted to all its measurements except those near an edge, weighted by the noise along the
    ray; with the true intrinsics the error is about a hundredth of a degree per angle (docs/planes.md).

    Parameters
    ----------
    frame : Frame
        With a depth image of a corner.
    camera : Camera or RGBDCamera, optional
        The intrinsics to assess; None: the frame's own.
    tolerance : float
        Half thickness of a plane, m; at least the sensor's noise.

    Returns
    -------
    (3,) float64

    Raises
    ------
    ValueError
        No depth, no camera, or fewer than three planes, each with a tenth of the remaining measurements.

    Examples
    --------
    >>> seq = st.open_sequence("corner_of_a_room")                                         # doctest: +SKIP
    >>> plane_angles(seq[0], seq.camera).round(0)                                          # doctest: +SKIP
    array([90., 90., 90.])
    """
    from sdftrack.imaging.plane import three_planes

    normals = three_planes(frame, camera, tolerance)[0]
    pairs = ((0, 1), (0, 2), (1, 2))
    sines = [np.linalg.norm(np.cross(normals[i], normals[j])) for i, j in pairs]
    cosines = [normals[i] @ normals[j] for i, j in pairs]
    return np.sort(np.degrees(np.arctan2(sines, cosines)))


def _poses(T: ArrayLike, name: str) -> Array:
    A = numbers(T, name)
    if A.shape[-2:] != (4, 4):
        raise ValueError(f"{name}: expected poses of shape (..., 4, 4), got {A.shape}")
    return A


def _points(points: Any) -> Array:
    p = np.asarray(getattr(points, "vertices", points), dtype=np.float64)
    if p.ndim != 2 or p.shape[1] != 3 or not len(p) or not (np.abs(p) < FAR_M).all():
        raise ValueError(
            f"points: expected (N, 3) finite numbers in metres with N > 0, or a Mesh, got {p.shape}"
        )
    return p


def _nearest_in(points: Array) -> Callable[[Array], Array]:
    """The function that gives, for each of (N, 3) points, the distance to the nearest of `points`."""
    from scipy.spatial import KDTree

    # Of many points at one place a tree is one leaf, which each query would go through as a whole.
    tree, centre = KDTree(np.unique(points, axis=0)), points.mean(axis=0)

    def nearest(queries: Array) -> Array:
        # From the centre: for those that are NaN, or so far away that it is all one.
        away = queries - centre
        distance: Array = np.hypot(np.hypot(away[:, 0], away[:, 1]), away[:, 2])
        near = np.abs(away).max(axis=1) < FAR_M
        if near.any():
            distance[near] = tree.query(queries[near])[0]
        return distance

    return nearest


def _surface_points(shape: Any, samples: int, seed: int) -> Array:
    if not hasattr(shape, "faces"):
        return _points(shape)
    corners = _points(shape)[np.asarray(shape.faces)]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    rng = np.random.default_rng(seed)
    # Stratified along the cumulated area: far less scatter than independent draws.
    at = (np.arange(samples) + rng.random(samples)) / samples * area.sum()
    face = np.minimum(np.searchsorted(np.cumsum(area), at), len(area) - 1)
    r = np.sqrt(rng.random((samples, 1)))
    s = rng.random((samples, 1))
    a, b, c = np.moveaxis(corners[face], 1, 0)
    return (1 - r) * a + r * ((1 - s) * b + s * c)


def _label_images(labels: ArrayLike, truth: ArrayLike) -> tuple[NDArray[Any], NDArray[Any]]:
    L, G = np.asarray(labels), np.asarray(truth)
    if L.ndim != 2 or L.shape != G.shape:
        raise ValueError(
            f"labels, truth: expected two (H, W) images of one size, got {L.shape} and {G.shape}"
        )
    return L, G


def _overlaps(labels: ArrayLike, truth: ArrayLike) -> NDArray[np.int64]:
    """Number of pixels shared by each superpixel (rows) and each true segment."""
    L, G = _label_images(labels, truth)
    _, l = np.unique(L, return_inverse=True)
    _, g = np.unique(G, return_inverse=True)
    n = int(g.max()) + 1
    counts: NDArray[np.int64] = np.bincount(l.ravel() * n + g.ravel(), minlength=(int(l.max()) + 1) * n)
    return counts.reshape(-1, n)


def _edges(labels: NDArray[Any]) -> NDArray[np.bool_]:
    edges = np.zeros(labels.shape, dtype=bool)
    edges[:, :-1] |= labels[:, :-1] != labels[:, 1:]
    edges[:-1] |= labels[:-1] != labels[1:]
    return edges


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
    depth: ArrayLike, depth_estimate: ArrayLike, depth_gt: ArrayLike, camera: Any, tau: float | ArrayLike,
    delta: float = 0.015,
) -> Any:  # fmt: skip
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
    vsd_errors: ArrayLike | None = None, mssd_errors: ArrayLike | None = None,
    mspd_errors: ArrayLike | None = None, diameter: float | ArrayLike | None = None, width: int = 640,
) -> dict[str, float]:  # fmt: skip
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
