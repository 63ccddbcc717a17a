# SPDX-License-Identifier: MIT
"""Assessment of a silhouette by the shape memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.record import ArrayRecord, mask_png

__all__ = ["Assessment", "Judgement"]

Judgement: TypeAlias = Literal["unoccluded", "occluded", "novel"]


@dataclass(frozen=True, eq=False, repr=False)
class Assessment(ArrayRecord):
    """Judgement and completion of a silhouette, by `ShapeMemory.assess`.

    Attributes
    ----------
    judgement : "unoccluded", "occluded" or "novel"
    mask : (H, W) bool
        The silhouette to use: the recovered one if it is occluded and `doubt` is at most 2, else the given one.
    completed : (H, W) bool
        The recovered silhouette, whatever the judgement; unreliable if that is "novel".
    coefficients : (m,) float64
        Harmonics of `completed`, as from `st.contour.harmonics`.
    std : (m,) float64
        Standard deviation of `coefficients`: predicted by LWPR, or among the silhouettes that explain the mask (0 for a
        single one); 0 if they are those of the given mask.
    error : float
        Deviation of the observed silhouette from the expected one; "occluded" from `threshold` on. With
        ``rule="remembered"`` the share of the completed silhouette that is not visible, with ``rule="printed"``
        |x_predicted - x_observed| over the low harmonics (Table 6.3).
    threshold : float
    known : float
        Share of the details that were observed before: of the outline ("remembered"), or of the active regressions
        ("printed"). Below one half the silhouette is "novel".
    doubt : float
        Of the hidden part: area that no stored silhouette explains over the area that would be added, and more if
        `known` is small; infinite if nothing would be added. 0 with ``rule="printed"``, which has no measure of it.
    """

    judgement: Judgement
    mask: NDArray[np.bool_]
    completed: NDArray[np.bool_]
    coefficients: NDArray[np.float64]
    std: NDArray[np.float64]
    error: float
    threshold: float
    known: float
    doubt: float = 0.0

    def __repr__(self) -> str:
        return (
            f"Assessment({self.judgement}, error {self.error:.3g} of {self.threshold:.3g}, "
            f"known {self.known:.2f}, {int(self.mask.sum())} px)"
        )

    def _repr_png_(self) -> bytes:
        return mask_png(self.mask, self.completed)
