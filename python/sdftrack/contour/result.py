# SPDX-License-Identifier: MIT
"""What the contour tracker and the shape memory return: read-only arrays that compare, pickle and show themselves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.array_equality import Compared
from sdftrack.results import Status

PICTURE_PX = 240  # height of a picture in a notebook, at most


class ArrayRecord(Compared):
    """Base of a frozen dataclass (``eq=False``) some of whose fields are arrays.

    Arrays are stored as read-only copies.
    """

    def __post_init__(self) -> None:
        for name, value in self._values().items():
            if isinstance(value, np.ndarray):
                own = value.copy()
                own.setflags(write=False)
                object.__setattr__(self, name, own)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), tuple(
            self._values().values()
        )  # through __post_init__, so that a copy cannot be written


def mask_png(mask: NDArray[np.bool_], more: NDArray[np.bool_] | None = None) -> bytes:
    """PNG of a silhouette, white on black; pixels only in `more` are orange."""
    import cv2

    picture = np.zeros((*mask.shape, 3), np.uint8)
    if more is not None:
        picture[more] = (40, 140, 250)  # BGR
    picture[mask] = 255
    height = min(PICTURE_PX, mask.shape[0])
    width = max(1, round(mask.shape[1] * height / mask.shape[0]))
    small = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
    return bytes(cv2.imencode(".png", small)[1])


class Evidence(NamedTuple):
    """What an outline is judged by.

    Attributes
    ----------
    disagreement : float
        1 less the IoU of the mask and the last mask moved by the optical flow.
    mean_disagreement : float
        The same, averaged over the last frames.
    strangeness : float
        1 less the affinity (sum of sqrt(p q)) of the colours inside and those at the start.
    first_instability : float
        1 less the mean IoU of the first mask and those of the box shifted a little; 0 for a start from a mask.
    shared : float
        Share of the outline beside which the colours are those of the object nearby; the largest of the last frames,
        fading by 0.5 % per frame.
    """

    disagreement: float
    mean_disagreement: float
    strangeness: float
    first_instability: float = 0.0
    shared: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class ContourResult(ArrayRecord):
    """Result of one frame.

    Attributes
    ----------
    mask : (H, W) bool
        Pixels of the object; empty if it is lost.
    warp : (3, 3) float64
        Maps the object's grid, (column, row) from its first cell, to pixels (x, y) of the image.
    phi : (ny, nx) float32
        Signed distance to the outline on the object's grid, in cells, negative inside, truncated beyond the band.
    status : Status
        "ok", "weak" (the mask may be wrong: it is occluded, its colours have changed, or it does not move as the image
        does) or "lost" (it is searched for in the next frames).
    reason : str
        Reason if the status is not "ok"; else empty.
    confidence : float
        0 to 1. Estimated chance that the mask is right (an IoU of 0.5 or more with the truth), from its agreement with
        the optical flow and with the colours at the start; with ``confidence="colors"``, the contrast across
        the outline relative to the start, times the similarity of the colours inside to those at the start (sum of
        sqrt(p q)).
    judgement : str or None
        Judgement of the shape memory: "unoccluded", "occluded" or "novel"; None without a memory or during burn-in.
    evidence : Evidence or None
        What the confidence was computed from; None at a start from a mask, while lost, and with
        ``confidence="colors"``.
    """

    mask: NDArray[np.bool_]
    warp: NDArray[np.float64]
    phi: NDArray[np.float32]
    status: Status
    reason: str
    confidence: float
    judgement: str | None = None
    evidence: Evidence | None = None

    @property
    def ok(self) -> bool:
        """Whether the status is "ok"."""
        return self.status == Status.OK

    def __repr__(self) -> str:
        said = f", {self.judgement}" if self.judgement else ""
        return (
            f"ContourResult({self.status}, confidence {self.confidence:.2f}{said}, {int(self.mask.sum())} px)"
        )

    def _repr_png_(self) -> bytes:
        return mask_png(self.mask)


# -- Assessment of a silhouette by the shape memory


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
