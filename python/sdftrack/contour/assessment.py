# SPDX-License-Identifier: MIT
"""What the shape memory says of one silhouette."""

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
    """A silhouette judged and completed, by `ShapeMemory.assess`.

    Attributes
    ----------
    judgement : "unoccluded", "occluded" or "novel"
    mask : (H, W) bool
        What to go on with: the recovered silhouette where it is occluded, else the given one.
    completed : (H, W) bool
        The recovered silhouette whatever the judgement; worth little where that is "novel".
    coefficients : (m,) float64
        Harmonics of `completed`, as from `st.contour.harmonics`.
    std : (m,) float64
        Of `coefficients`: as LWPR predicts it, or among the silhouettes that explain the mask (0 where one alone does);
        0 where they are those of the given mask.
    error : float
        How far the observed silhouette is from the one that was expected; "occluded" from `threshold` on. With
        ``rule="remembered"`` the share of the completed silhouette that is not seen, with ``rule="printed"``
        |x_predicted - x_observed| over the low harmonics (Table 6.3).
    threshold : float
    known : float
        Share of the details that have been seen before: of the outline ("remembered"), of the regressions that are
        active ("printed"). Below a half the silhouette is "novel".
    """

    judgement: Judgement
    mask: NDArray[np.bool_]
    completed: NDArray[np.bool_]
    coefficients: NDArray[np.float64]
    std: NDArray[np.float64]
    error: float
    threshold: float
    known: float

    def __repr__(self) -> str:
        return (
            f"Assessment({self.judgement}, error {self.error:.3g} of {self.threshold:.3g}, "
            f"known {self.known:.2f}, {int(self.mask.sum())} px)"
        )

    def _repr_png_(self) -> bytes:
        return mask_png(self.mask, self.completed)
