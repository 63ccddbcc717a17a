# SPDX-License-Identifier: MIT
"""MSPD, VSD and the average recall of recorded poses, as in the BOP challenge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.metrics import average_recall, mspd, vsd
from sdftrack.symmetry import Symmetry

Array = NDArray[np.float64]
TAUS = np.arange(0.05, 0.51, 0.05)  # of the diameter: how far apart two surfaces of VSD may be
POINTS = 2000  # of the mesh, that distances are taken between
BLOCK = 500


@dataclass(frozen=True)
class BopErrors:
    """Errors of one object over the frames with a pose and ground truth.

    Attributes
    ----------
    mspd_px : (N,) float64
    vsd : (N, 10) float64
        At 5 % to 50 % of the diameter; NaN in frames without a depth image.
    diameter_m : float
    width : int
        Of the depth image.
    """

    mspd_px: Array
    vsd: Array
    diameter_m: float
    width: int

    def recall(self, mssd_m: Array, compared: int) -> dict[str, float]:
        """AR_VSD, AR_MSSD, AR_MSPD and their mean over `compared` frames; frames without a pose count as wrong.

        Frames without a depth image are excluded from VSD; without any there is no AR_VSD.
        """
        missing = max(0, compared - len(mssd_m))
        lost = np.full(missing, np.inf)
        seen = ~np.isnan(self.vsd).any(axis=1)
        errors = None
        if seen.any():
            errors = np.concatenate([self.vsd[seen], np.full((missing, len(TAUS)), np.inf)])
        return average_recall(
            errors,
            np.concatenate([mssd_m, lost]),
            np.concatenate([self.mspd_px, lost]),
            diameter=self.diameter_m,
            width=self.width,
        )


def bop_errors(
    seq: Any,
    frames: list[int],
    poses: Array,
    truth: Array,
    mesh: Any,
    symmetry: Symmetry | None = None,
) -> BopErrors:
    """MSPD and VSD of poses (N, 4, 4) in the sequence's frames with these indices."""
    points = mesh.vertices[:: max(1, len(mesh.vertices) // POINTS)]
    across = diameter(points)
    mspd_px, discrepancy, width = np.zeros(len(frames)), np.full((len(frames), len(TAUS)), np.nan), 0
    for n, (i, T, true) in enumerate(zip(frames, poses, truth, strict=True)):
        frame = seq[i]
        camera = seq.camera if frame.camera is None else frame.camera
        lens = getattr(camera, "depth", camera)
        width = lens.width
        mspd_px[n] = mspd(T, true, points, lens, symmetry)
        if frame.depth is not None:
            found, real = (mesh.raycast(lens, P)[0] for P in (T, true))
            discrepancy[n] = vsd(frame.depth, found, real, lens, TAUS * across)
    return BopErrors(mspd_px, discrepancy, across, width)


def diameter(points: Array) -> float:
    """Largest distance between two of the points."""
    longest = 0.0
    for k in range(0, len(points), BLOCK):
        squared = ((points[k : k + BLOCK, None] - points) ** 2).sum(axis=-1)
        longest = max(longest, float(squared.max()))
    return float(np.sqrt(longest))
