# SPDX-License-Identifier: MIT
"""Fit a primitive of unknown size to points, to a frame, or to several frames."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.checks import numbers
from sdftrack.frame import Frame
from sdftrack.primitives.fusing import fused
from sdftrack.primitives.in_frame import FrameFitter
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.seen import checked_plane
from sdftrack.primitives.solving import Wish, solve

__all__ = ["fit_primitive", "points_view"]

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
) -> PrimitiveFit:
    """Pose and size of a primitive, from points of its surface or from what a camera sees of it.

    Guesses from normals and moments, then the pose at an arbitrary size, then pose and size together (thesis, section
    3.8; docs/math/primitives.md). A frame tells more than points do: where the object ends before what is behind it,
    and the table that it stands on.

    Parameters
    ----------
    points_or_frame : (N, 3) array, Frame, or several frames
        Points of the surface, m, in any frame; outliers are forgiven, up to a third or so. Or a frame with a depth
        image. Or an iterable of frames (a list, a `Sequence`) of one object: each is fitted from where it was in the
        frame before, and the sizes are averaged by their information (thesis Eq. 3.23).
    kind : {"sphere", "cylinder", "cone", "box", "ellipsoid", "auto"}
        ``"auto"`` takes the best of all by `PrimitiveFit.scores`.
    camera : Camera or RGBDCamera, optional
        Of the frame. None: the frame's own.
    mask : (H, W) bool or uint8, optional
        Where the object is, in the depth image's geometry; of several frames in the first one. None: the frame's own;
        without that, the largest piece that stands off the dominant plane.
    initial : PrimitiveFit or (T_cam_obj, {name: m}), optional
        A start in place of guesses.
    seed : int
        Of the guesses; the same seed gives the same bits.
    scaling : {"exact", "printed"}
        The exact distance to a solid of these lengths, or the source's: a unit solid scaled along its axes, its field
        corrected to first order (thesis Eq. 3.27).
    plane : "auto", None or (n, d)
        The table ``n . p + d = 0`` (m, camera frame, n towards the camera) that the object may stand on and cannot
        reach through: searched, none, or given.
    threads : int
        0: all cores. The result does not depend on it.

    Returns
    -------
    PrimitiveFit

    Raises
    ------
    TypeError
        Neither numbers nor frames; a mask of another dtype.
    ValueError
        Fewer points than unknowns, all in one line or plane, or not finite; an unknown kind; a frame without a depth
        image or camera; a mask without readings; nothing that stands off the plane.

    >>> fit = st.fit_primitive(frame, "auto", camera=camera)  # doctest: +SKIP
    >>> fit.kind, fit.size, fit.ok                            # doctest: +SKIP
    ('cylinder', {'radius': 0.033, 'height': 0.102}, True)
    """
    wish = Wish(kind, initial, seed, scaling, threads)
    given = checked_plane(plane)
    if isinstance(points_or_frame, Frame):
        return FrameFitter(camera, given).fit(points_or_frame, mask, wish)
    if _are_frames(points_or_frame):
        frames: Any = points_or_frame
        camera = camera if camera is not None else getattr(frames, "camera", None)
        return fused(frames, wish, mask, FrameFitter(camera, given))
    for name, value in (("camera", camera), ("mask", mask)):
        if value is not None:
            raise ValueError(
                f"{name}: expected None with points, got {type(value).__name__}; pass a Frame instead"
            )
    view = points_view(points_or_frame, wish.least_points())
    if not isinstance(given, str) and given is not None:
        view.set_plane(given[0].tolist(), given[1], False)
    return solve(view, wish)


def _are_frames(value: Any) -> bool:
    if isinstance(value, (np.ndarray, str, bytes, dict)):
        return False
    if isinstance(value, (list, tuple)):
        return any(isinstance(f, Frame) for f in value)
    return hasattr(value, "__iter__") and not hasattr(value, "__array__")


def points_view(points: Any, least: int) -> Any:
    """The core's view of bare points, (N, 3) m."""
    p: NDArray[np.float64] = numbers(points, "points")
    if p.ndim != 2 or p.shape[1] != 3:
        raise ValueError(f"points: expected shape (N, 3), got {p.shape}")
    bad = int(np.count_nonzero(~np.isfinite(p).all(axis=1)))
    if bad:
        raise ValueError(
            f"points: expected finite coordinates, got {bad} of {len(p)} points with NaN or infinity; drop them with "
            "points[np.isfinite(points).all(axis=1)]"
        )
    if len(p) < least:
        raise ValueError(f"points: expected at least {least}, as many as there are unknowns, got {len(p)}")
    spread = np.linalg.svd(p - p.mean(axis=0), compute_uv=False) if len(p) <= 4000 else _spread(p)
    if not spread[0] > 0:
        raise ValueError("points: expected points of a surface, got one place")
    for thin, name in ((1, "line"), (2, "plane")):
        if spread[thin] < FLAT * spread[0]:
            raise ValueError(
                f"points: expected points around a solid, got {len(p)} that all lie in one {name}"
            )
    return _core.PrimitiveView.of_points(p)


def _spread(p: NDArray[np.float64]) -> NDArray[np.float64]:
    d = p - p.mean(axis=0)
    spread: NDArray[np.float64] = np.sqrt(np.maximum(np.linalg.eigvalsh(d.T @ d)[::-1], 0))
    return spread
