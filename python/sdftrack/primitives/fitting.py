# SPDX-License-Identifier: MIT
"""Fit a primitive of unknown size to points, to a frame, or to several frames."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import numbers
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame
from sdftrack.mesh.files import unit_scale
from sdftrack.primitives.frames import FrameFitter, fused
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.segmentation import checked_plane
from sdftrack.primitives.solver import FitRequest, solve

FARTHEST_M = 1e6  # of a coordinate: beyond it micrometres are lost
WIDEST_M, NARROWEST_M = 10.0, 1e-3  # of points in metres, without the outermost twentieth on each side
MIN_SPREAD = 40  # points, of which a twentieth is more than one
FLAT = 1e-5  # spread across the points over the spread along them, below which they have no thickness at all


def fit_primitive(
    points_or_frame: ArrayLike | Frame | Iterable[Frame],
    kind: str = "auto",
    *,
    camera: Camera | RGBDCamera | None = None,
    mask: ArrayLike | None = None,
    initial: Any = None,
    seed: int = 0,
    scaling: str = "exact",
    plane: Any = "auto",
    threads: int = 0,
    unit: str | None = None,
) -> PrimitiveFit:
    """Fit pose and size of a primitive, to points on its surface or to depth images.

    Initial guesses come from normals and moments; then the pose is fitted at a fixed size, then pose and size jointly
    (thesis, section 3.8; docs/math/primitives.md). A frame provides more information than points: the silhouette
    against the background, and the supporting plane.

    Parameters
    ----------
    points_or_frame : (N, 3) array, Frame, or several frames
        Points on the surface, m, in any coordinate frame; up to about a third may be outliers. Or a frame with a depth
        image. Or an iterable of frames (a list, a `Sequence`) of one object: each is fitted starting from the pose in
        the previous frame, and the sizes are averaged by their information (thesis Eq. 3.23).
    kind : {"sphere", "cylinder", "cone", "box", "ellipsoid", "plane", "superquadric", "auto"}
        ``"plane"`` is a patch: a rectangle without thickness, for a sheet, a door, a sign, a table top or one face of
        an object. ``"auto"`` selects the best solid by `PrimitiveFit.scores`; patches are excluded, because a patch
        cannot be distinguished from a single visible face of a box, and has no distance volume, and superquadrics,
        which contain ellipsoids and nearly boxes and cylinders.
    camera : Camera or RGBDCamera, optional
        Camera of the frame. None: the frame's own.
    mask : (H, W) bool or uint8, optional
        Object mask aligned with the depth image; for several frames, that of the first one. None: the frame's own;
        without one, the largest connected piece above the dominant plane.
    initial : PrimitiveFit or (T_cam_obj, {name: size}), optional
        Initial value, instead of guesses.
    seed : int
        Seed of the guesses; the same seed gives the same bits.
    scaling : {"exact", "printed"}
        Exact distance to the solid, or the form of the thesis (Eq. 3.27): the field of a unit solid at the measured
        points, scaled along its axes.
    plane : "auto", None or (n, d)
        The table ``n . p + d = 0`` (m, camera frame, n towards the camera) on which the object may stand and which it
        cannot penetrate: searched, none, or given.
    threads : int
        0: all cores. The result does not depend on it.
    unit : None, "m", "mm", "cm" or "in"
        Unit of the points; the fit is in metres. None: metres, and an extent of more than 10 m or less than 1 mm is an
        error, because it suggests another unit.

    Raises
    ------
    TypeError
        Neither points nor frames; a mask of unsupported dtype.
    ValueError
        Fewer points than unknowns; points on a line or (except for a patch) in a plane, or not finite; an unknown kind;
        a frame without a depth image or camera; a mask without depth measurements; nothing above the plane.

    >>> fit = st.fit_primitive(frame, "auto", camera=camera)  # doctest: +SKIP
    >>> fit.kind, fit.size, fit.ok                            # doctest: +SKIP
    ('cylinder', {'radius': 0.033, 'height': 0.102}, True)
    """
    request = FitRequest(kind, initial, seed, scaling, threads)
    given = checked_plane(plane)
    frame_like = isinstance(points_or_frame, Frame) or _are_frames(points_or_frame)
    _check_belongings(frame_like, points_or_frame, camera, mask, unit)
    if isinstance(points_or_frame, Frame):
        return FrameFitter(camera, given).fit(points_or_frame, mask, request)
    if _are_frames(points_or_frame):
        frames: Any = points_or_frame
        camera = camera if camera is not None else getattr(frames, "camera", None)
        return fused(frames, request, mask, FrameFitter(camera, given))
    view = points_view(points_or_frame, unit, request.min_points(), request.flat)
    if not isinstance(given, str) and given is not None:
        view.set_plane(given[0].tolist(), given[1], False)
    return solve(view, request)


def _check_belongings(frame_like: bool, given: Any, camera: Any, mask: Any, unit: Any) -> None:
    """Points have no camera and no mask, frames no unit."""
    if isinstance(given, dict):
        raise TypeError(
            "points_or_frame: expected points, a Frame or frames, got dict; pass list(...values())"
        )
    if frame_like:
        if unit is not None:
            raise ValueError(f"unit: expected None with frames, whose depth is in metres, got {unit!r}")
        return
    for name, value in (("camera", camera), ("mask", mask)):
        if value is not None:
            raise ValueError(
                f"{name}: expected None with points, got {type(value).__name__}; pass a Frame instead"
            )


def _are_frames(value: Any) -> bool:
    if isinstance(value, (np.ndarray, str, bytes, dict)):
        return False
    if isinstance(value, (list, tuple)):
        return any(isinstance(f, Frame) for f in value)
    return hasattr(value, "__iter__") and not hasattr(value, "__array__")


def _cloud(points: Any) -> Any:
    """The points of an Open3D cloud, of its tensor form, or of a trimesh.PointCloud; others as they are."""
    if isinstance(points, np.ndarray):
        return points
    if hasattr(points, "point") and "positions" in points.point:
        return points.point["positions"].cpu().numpy()
    inner = getattr(points, "points", getattr(points, "vertices", None))
    return points if inner is None else np.asarray(inner)


def points_view(points: Any, unit: str | None, least: int, flat: bool = False) -> Any:
    """The core's view of points without a camera, (N, 3). `flat`: they may all lie in one plane."""
    p: NDArray[np.float64] = numbers(_cloud(points), "points") * unit_scale(unit)
    if p.ndim != 2 or p.shape[1] != 3:
        raise ValueError(f"points: expected shape (N, 3), got {p.shape}")
    bad = int(np.count_nonzero(~np.isfinite(p).all(axis=1)))
    if bad:
        raise ValueError(
            f"points: expected finite coordinates, got {bad} of {len(p)} points with NaN or infinity; remove them "
            "(points[np.isfinite(points).all(axis=1)])"
        )
    if len(p) < least:
        raise ValueError(f"points: expected at least {least}, as many as there are unknowns, got {len(p)}")
    farthest = float(np.abs(p).max())
    if farthest >= FARTHEST_M:
        raise ValueError(
            f"points: expected coordinates below {FARTHEST_M:g} m, got {farthest:.3g}; check the unit, "
            "or drop invalid points"
        )
    across = float(np.linalg.norm(np.ptp(p, axis=0)))
    if across > WIDEST_M and len(p) >= MIN_SPREAD:  # or a few outliers are
        across = float(np.linalg.norm(np.ptp(np.quantile(p, (0.05, 0.95), axis=0), axis=0)))
    if unit is None and (across > WIDEST_M or 0 < across < NARROWEST_M):
        likely = (
            "are they in mm? pass unit='mm'"
            if across > WIDEST_M
            else "in which unit are they? pass it as unit"
        )
        raise ValueError(
            f"points: expected metres, got an extent of {across:.3g}; {likely} (or unit='m' if this is meant)"
        )
    d = p - p.mean(axis=0)
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(d.T @ d)[::-1], 0))
    if not spread[0] > 0:
        raise ValueError("points: expected points on a surface, got a single location")
    for thin, name in ((1, "line"), (2, "plane")):
        if spread[thin] < FLAT * spread[0] and not (flat and name == "plane"):
            how = "; fit kind='plane' to a patch" if name == "plane" else ""
            raise ValueError(
                f"points: expected points around a solid, got {len(p)} that all lie in one {name}{how}"
            )
    return _core.PrimitiveView.of_points(p)
