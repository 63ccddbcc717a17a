# SPDX-License-Identifier: MIT
"""Errors of one object of recorded results, and their summary."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.evaluation.bop_scores import BopErrors
from sdftrack.metrics import auc
from sdftrack.symmetry import Symmetry

Array = NDArray[np.float64]


@dataclass
class ObjectScore:
    """Errors of one object over the frames with ground truth.

    Attributes
    ----------
    images : (N,) int64
        Numbers of the tracked images with ground truth.
    translation_m, rotation_rad, add_m : (N,) float64
        ``add_m`` is NaN without a model.
    poses, truth : (N, 4, 4) float64
    bop : BopErrors or None
        MSPD and VSD; None without a model.
    adds_m, mssd_m : (N,) float64
        ADD-S and MSSD, the latter over the symmetries of the results or the data set; NaN without a model.
    frames, compared, lost : int
        Number of all frames; of those with ground truth; of those without a pose (lost, bad frame).
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

        def three(a: Array) -> dict[str, float | None]:
            if not len(a) or not np.isfinite(a).any():
                return {"mean": None, "median": None, "max": None}
            return {"mean": float(a.mean()), "median": float(np.median(a)), "max": float(a.max())}

        # A lost frame with known truth counts against the area as an infinite error.
        missing = np.full(max(0, self.compared - len(self.images)), np.inf)
        area = auc(np.concatenate([self.add_m, missing])) if np.isfinite(self.add_m).any() else None
        out: dict[str, Any] = plain(
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
                **self._bop(three),
                "per_frame": {
                    "im_id": self.images,
                    "translation_mm": mm,
                    "rotation_deg": deg,
                    "add_mm": add_mm,
                    "adds_mm": 1e3 * self.adds_m,
                    "mssd_mm": 1e3 * self.mssd_m,
                    "mspd_px": None if self.bop is None else self.bop.mspd_px,
                    "vsd": None if self.bop is None else self.bop.vsd.mean(axis=1),
                },
            }
        )
        return out

    def _bop(self, three: Callable[[Array], dict[str, float | None]]) -> dict[str, Any]:
        """MSPD, VSD (its mean over BOP's tolerances) and the average recall; None without a model."""
        if self.bop is None:
            return {"mspd_px": three(np.zeros(0)), "vsd": three(np.zeros(0)), "average_recall": None}
        discrepancy = self.bop.vsd.mean(axis=1)
        return {
            "mspd_px": three(self.bop.mspd_px),
            "vsd": three(discrepancy[np.isfinite(discrepancy)]),
            "average_recall": self.bop.recall(self.mssd_m, self.compared),
        }
