# SPDX-License-Identifier: MIT
"""Sequential fitting of all primitives on a table."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sdftrack._internal.validation import of_kind, whole
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.segmentation import (
    ON,
    SegmentedFrame,
    camera_of,
    checked_mask,
    checked_plane,
    distance_to,
    pieces,
)
from sdftrack.primitives.solver import FitRequest, solve
from sdftrack.results import Status

CLAIM_M = 0.008  # measurements so near a fitted surface, at up to 1 m, are that object's
MIN_READINGS = 150


def fit_primitives(
    frame: Frame,
    kind: str = "auto",
    *,
    camera: Camera | RGBDCamera | None = None,
    mask: ArrayLike | None = None,
    most: int = 20,
    seed: int = 0,
    scaling: str = "exact",
    plane: Any = "auto",
    threads: int = 0,
) -> list[PrimitiveFit]:
    """Fit primitives sequentially: each removes the measurements on its surface, the next is fitted to the rest.

    Parameters
    ----------
    frame : Frame
        With a depth image.
    kind, camera, seed, scaling, plane, threads
        As in `fit_primitive`.
    mask : (H, W) bool or uint8, optional
        Search region; None: everything above the table.
    most : int
        Maximum number of objects.

    Returns
    -------
    list of PrimitiveFit
        In order of decreasing piece size. Pieces that no primitive explains (status ``"lost"``) are omitted.

    >>> for fit in st.fit_primitives(frame, camera=camera): print(fit)  # doctest: +SKIP
    """
    request = FitRequest(kind, None, seed, scaling, threads)
    most = whole(most, "most", 1, what="a number of objects, at least 1")
    of_kind(frame, Frame, "frame", "make one with st.Frame(depth)")
    pinhole = camera_of(frame, camera)
    given = checked_mask(mask, frame) if mask is not None else None
    seen = SegmentedFrame.of(frame, pinhole, checked_plane(plane), None)
    rest = np.ones(seen.depth.shape, bool) if given is None else given.copy()
    out: list[PrimitiveFit] = []
    while len(out) < most:
        found = [p for p in pieces(seen, rest) if np.count_nonzero(p) >= MIN_READINGS]
        if not found:
            return out
        piece = found[0]
        labels = seen.labels(piece, True)
        if np.count_nonzero(labels == ON) < request.min_points():
            rest &= ~piece
            continue
        fit = solve(seen.view(labels), request)
        lengths = list(fit.size.values())
        claimed = piece & (distance_to(seen, fit.kind, lengths, fit.T_cam_obj) < CLAIM_M)
        if fit.status is Status.LOST or np.count_nonzero(claimed) < MIN_READINGS:
            rest &= ~piece
            continue
        out.append(fit)
        # What is left of a piece that the primitive explains is its rim; else there is another object.
        rest &= ~(piece if fit.inliers > 0.8 else claimed)
    return out
