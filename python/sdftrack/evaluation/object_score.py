# SPDX-License-Identifier: MIT
"""Errors of one object of recorded results, those of the BOP challenge among them, and their summary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.metrics import auc, average_recall, mspd, vsd
from sdftrack.metrics.bop import TAUS
from sdftrack.symmetry import Symmetry

Array = NDArray[np.float64]
POINTS = 2000  # of the mesh, that distances are taken between
BLOCK = 500


@dataclass(frozen=True)
class BopErrors:
    """Errors of one object over the frames with a pose and ground truth.

    `vsd` (N, 10) is that at 5 % to 50 % of the diameter, NaN in frames without a depth image; `width` is that of the
    depth image.
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


@dataclass
class ObjectScore:
    """Errors of one object over the tracked images with ground truth; NaN, and no `bop`, without a model.

    `mssd_m` is over the symmetries of the results or the data set. `frames`, `compared` and `lost` are the numbers of
    all frames, of those with ground truth, and of those without a pose (lost, bad frame).
    """

    name: str
    obj_id: int
    images: NDArray[np.int64]
    translation_m: Array
    rotation_rad: Array
    add_m: Array
    poses: Array
    truth: Array
    frames: int
    compared: int
    lost: int
    adds_m: Array
    mssd_m: Array
    instance: int | None = None
    symmetry: Symmetry | None = None
    bop: BopErrors | None = None

    def told(self) -> str:
        """Description of the object and the images compared."""
        n = len(self.images)
        which = f"images {self.images.min()} to {self.images.max()}" if n else "no image"
        alike = "" if not self.symmetry else ", with its symmetries"
        return (
            f"{self.name} (obj_id {self.obj_id}) against instance {self.instance}{alike}: {n} of {self.frames} frames "
            f"compared, {which}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Summary and errors per frame in mm and degrees, ready for JSON."""
        from sdftrack.io.report_file import plain

        mm, deg, add_mm = 1e3 * self.translation_m, np.rad2deg(self.rotation_rad), 1e3 * self.add_m
        bop, mspd_px, discrepancy = self.bop, np.zeros(0), np.zeros(0)
        if bop is not None:
            mspd_px, discrepancy = bop.mspd_px, bop.vsd.mean(axis=1)  # over BOP's tolerances

        def three(a: Array) -> dict[str, float | None]:
            if not len(a) or not np.isfinite(a).any():
                return {"mean": None, "median": None, "max": None}
            return {"mean": float(a.mean()), "median": float(np.median(a)), "max": float(a.max())}

        # A lost frame with known truth counts against the area as an infinite error.
        missing = np.full(max(0, self.compared - len(self.images)), np.inf)
        area = auc(np.concatenate([self.add_m, missing])) if np.isfinite(self.add_m).any() else None
        return plain(
            {
                "name": self.name,
                "obj_id": self.obj_id,
                "frames": self.frames,
                "frames_with_truth": self.compared,
                "lost": self.lost,
                "translation_mm": three(mm),
                "rotation_deg": three(deg),
                "add_mm": three(add_mm),
                "add_auc": area,
                "instance": self.instance,
                "compared_images": [int(self.images.min()), int(self.images.max())]
                if len(self.images)
                else None,
                "adds_mm": three(1e3 * self.adds_m),
                "mssd_mm": three(1e3 * self.mssd_m),
                "mspd_px": three(mspd_px),
                "vsd": three(discrepancy[np.isfinite(discrepancy)]),
                "average_recall": None if bop is None else bop.recall(self.mssd_m, self.compared),
                "per_frame": {
                    "im_id": self.images,
                    "translation_mm": mm,
                    "rotation_deg": deg,
                    "add_mm": add_mm,
                    "adds_mm": 1e3 * self.adds_m,
                    "mssd_mm": 1e3 * self.mssd_m,
                    "mspd_px": None if bop is None else mspd_px,
                    "vsd": None if bop is None else discrepancy,
                },
            }
        )
