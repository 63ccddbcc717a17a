# SPDX-License-Identifier: MIT
"""Keyframes cropped to the object, their selection, and the result of refining them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.saved_file import array_of
from sdftrack.camera import Camera
from sdftrack.camera.rgbd import color_map
from sdftrack.frame import Frame

MARGIN_PX = 25  # of what is kept around the object
Region = tuple[int, int, int, int]


@dataclass
class Keyframe:
    """A fused frame: its images cropped to the object, and the pose used for fusion."""

    index: int
    region: Region  # x0, y0, x1, y1 of the depth image
    depth: NDArray[np.float32]
    rgb: NDArray[np.uint8] | None
    foreground: NDArray[np.float32]
    T_cam_obj: NDArray[np.float64]
    mask: NDArray[np.uint8] | None = None  # of the region; the first frame has one
    recording: int = 0  # 0: the one that `start` began

    def whole(self, part: NDArray[Any] | None, size: tuple[int, int]) -> Any:
        """`depth`, `rgb` or `mask` as an image (height, width) that is 0 outside the region; None for None."""
        if part is None:
            return None
        image = np.zeros((*size, *part.shape[2:]), part.dtype)
        x0, y0, x1, y1 = self.region
        image[y0:y1, x0:x1] = part
        return image

    def frame(self, camera: Camera) -> Frame:
        """Both images, colour aligned to depth; measurements without a colour (black) are removed."""
        depth, color = (self.whole(part, camera.shape) for part in (self.depth, self.rgb))
        if color is None:
            return Frame(depth, camera=camera, check_units=False)
        return Frame(np.where(color.any(axis=2), depth, 0), color, camera=camera, check_units=False)


@dataclass(frozen=True)
class Refined:
    """Result of :meth:`Reconstructor.refine`.

    Attributes
    ----------
    poses : dict of int to (4, 4) float64
        Refined ``T_cam_obj`` of each kept frame, by its index.
    rounds : int
        Number of rounds in which all poses and the shape were re-estimated.
    moved_m, turned_rad : list of float
        RMS change of the object's centre and orientation in each round.
    misfit_m : (float, float)
        Mean distance of the frames' measurements from the shape before and after, m.
    taken : bool
        Whether the refined poses and shape were accepted; otherwise they are unchanged.
    """

    poses: dict[int, NDArray[np.float64]]
    rounds: int
    moved_m: list[float]
    turned_rad: list[float]
    misfit_m: tuple[float, float] = (float("nan"), float("nan"))
    taken: bool = True


def cut(image: NDArray[Any], region: Region) -> NDArray[Any]:
    """Crop a region of an image, contiguous."""
    x0, y0, x1, y1 = region
    return np.ascontiguousarray(image[y0:y1, x0:x1])


def region_of(mask: NDArray[np.bool_], camera: Camera) -> Region:
    """Bounding box of a mask (H, W), with a margin."""
    at = np.argwhere(mask)[:, ::-1]
    low = np.maximum(at.min(axis=0) - MARGIN_PX, 0)
    high = np.minimum(at.max(axis=0) + MARGIN_PX + 1, (camera.width, camera.height))
    (x0, y0), (x1, y1) = low.tolist(), high.tolist()
    return x0, y0, x1, y1


def masked_keyframe(
    frame: Frame,
    on_object: NDArray[np.bool_],
    T_cam_obj: NDArray[np.float64],
    depth_camera: Camera,
    camera: Any,
) -> Keyframe:
    """A keyframe (index 0) with the object given by a mask; `camera`: that of the colours, None: no colour."""
    assert frame.depth is not None
    region = region_of(on_object, depth_camera)
    rgb = None
    if camera is not None and frame.color is not None:
        rgb = _core.colors_at(frame.depth, frame.color, color_map(camera, frame.color), region)
    nothing = np.empty(0, np.float32)
    mask = cut(on_object.astype(np.uint8), region)
    return Keyframe(0, region, cut(frame.depth, region), rgb, nothing, T_cam_obj, mask)


# -- Selection of keyframes: a limited number, spread over viewpoints and time


Numbers = NDArray[np.float64]
PER_DISTANCE = 0.5  # from half as far is another view, as 20 degrees to the side are
PER_FRAME, LATE = 1e-4, 0.02  # the same view again: 200 frames later and more it counts as 1.1 degrees away
NEAREST_M = 1e-6


class Keyframes:
    """Keeps the first frame of each recording, and those frames whose removal would leave the widest gaps.

    Two frames are similar if they show the same side from the same distance; rotation about the line of sight is
    ignored, and time has a small weight. Once there are more than `most`, each new frame replaces the frame with the
    smallest sum of distances to its two nearest neighbours. (With the nearest one alone it would always be the second
    to last frame of a moving camera, and the gap behind it would grow without bound.) Each frame stores its two nearest
    neighbours, so adding a frame costs O(most). `frames` are in order of arrival.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self.frames: list[Keyframe] = []
        self._views = np.empty((0, 5))
        self._nearest = np.empty((0, 2), np.intp)  # of each its two nearest; -1: there are none yet
        self._gaps = np.empty((0, 2))  # to these

    def record(self) -> dict[str, Any]:
        """What it knows about the keyframes, beside them, for a file."""
        return {"views": self._views, "nearest": self._nearest.astype(np.int64), "gaps": self._gaps}

    @staticmethod
    def from_record(record: dict[str, Any], frames: list[Keyframe], most: int) -> Keyframes:
        """Restore what `record` returned, with the keyframes."""
        out, n = Keyframes(most), len(frames)
        if not n:
            raise ValueError("keyframes: expected at least one, got none")
        nearest = array_of(record["nearest"], "nearest", np.int64, (n, 2))
        if (nearest < -1).any() or (nearest >= n).any():
            raise ValueError(f"nearest: expected numbers of {n} keyframes, or -1")
        out.frames, out._nearest = frames, nearest.astype(np.intp)
        out._views = array_of(record["views"], "views", np.float64, (n, 5))
        out._gaps = array_of(record["gaps"], "gaps", np.float64, (n, 2))
        return out

    def add(self, keyframe: Keyframe) -> None:
        """Add a keyframe, and remove one if there are too many."""
        n = len(self.frames)
        self.frames.append(keyframe)
        self._views = np.vstack([self._views, _view(keyframe)])
        gaps = _apart(self._views[:n], self._views[n])
        new = np.full(n, n, np.intp)
        self._gaps, self._nearest = _two_smallest(
            np.column_stack([self._gaps, gaps]), np.column_stack([self._nearest, new])
        )
        self._gaps = np.vstack([self._gaps, [np.inf, np.inf]])
        self._nearest = np.vstack([self._nearest, [-1, -1]])
        self._look_around(n)
        if n == self.most:
            self._drop(self._least_missed())

    def _least_missed(self) -> int:
        """The keyframe to remove; never the first of a recording, to which its other frames refer."""
        gaps = self._gaps.sum(axis=1)
        recordings = np.array([keyframe.recording for keyframe in self.frames])
        later = np.flatnonzero(np.diff(recordings, prepend=-1) == 0)
        return int(later[gaps[later].argmin()]) if len(later) else len(gaps) - 1

    def _drop(self, k: int) -> None:
        del self.frames[k]
        self._views, self._gaps = np.delete(self._views, k, 0), np.delete(self._gaps, k, 0)
        nearest = np.delete(self._nearest, k, 0)
        self._nearest = nearest - (nearest > k)
        for i in np.nonzero((nearest == k).any(axis=1))[0]:  # few: nobody is among the nearest of many
            self._look_around(int(i))

    def _look_around(self, i: int) -> None:
        """Update the two nearest neighbours of keyframe i."""
        gaps = _apart(self._views, self._views[i])
        gaps[i] = np.inf
        who = np.append(np.where(np.isfinite(gaps), np.arange(len(gaps)), -1), -1)
        least, nearest = _two_smallest(np.append(gaps, np.inf)[None], who[None])
        self._gaps[i], self._nearest[i] = least[0], nearest[0]


def _view(keyframe: Keyframe) -> Numbers:
    """Viewpoint relative to the object: direction, distance, and time."""
    R, t = keyframe.T_cam_obj[:3, :3], keyframe.T_cam_obj[:3, 3]
    away = max(float(np.linalg.norm(t)), NEAREST_M)
    return np.array([*(-R.T @ t / away), PER_DISTANCE * np.log(away), keyframe.index])


def _apart(views: Numbers, view: Numbers) -> Numbers:
    """(n,) dissimilarity of each of `views` to `view`: radians, for nearby directions."""
    aside = np.linalg.norm(views[:, :4] - view[:4], axis=1)
    return np.asarray(aside + np.minimum(PER_FRAME * np.abs(views[:, 4] - view[4]), LATE))


def _two_smallest(gaps: Numbers, who: NDArray[np.intp]) -> tuple[Numbers, NDArray[np.intp]]:
    """(n, 2) of (n, k): the two smallest gaps of each row in order; ties go to the earlier one."""
    order = np.argsort(gaps, axis=1, kind="stable")[:, :2]
    return np.take_along_axis(gaps, order, 1), np.take_along_axis(who, order, 1)
