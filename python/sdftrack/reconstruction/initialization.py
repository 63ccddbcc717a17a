# SPDX-License-Identifier: MIT
"""Initialisation of a reconstruction: the object's pixels, a ball fitted to them, the extent of the volume."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.options import TrackerOptions
from sdftrack.reconstruction.first_view import FirstView, above, own_pixels, planes_below, room
from sdftrack.reconstruction.options import ReconstructorOptions
from sdftrack.sdf import SDF

EXTENT_PER_BALL = 1.8  # of its diameter: as in the thesis' section 4.6, with room for what is not seen yet
MIN_READINGS = 100
FRONT_QUANTILE = 0.05
WIDER = 1.1  # than the ball is what may be guessed, where the mask and planes bound it
CENTRE_BEHIND = 0.6  # radii: measurements are the front of the ball, their median lies inside its outline
JUMPS_M = (0.05, 0.03, 0.02, 0.01)  # of depth between neighbouring measurements of one object
MAX_ON_BORDER = 0.03  # of a box's border pixels
MIN_NOISE_M = 5e-4
GUESS_FADES_VOXELS = 4.0  # sigma_G of thesis Eq. 4.34

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Ball:
    centre_cam: Array  # m
    radius_m: float
    behind_m: float  # its centre, behind the object's front
    shorter_m: float  # the shorter side of the mask


@dataclass(frozen=True)
class Beginning:
    """Observation of the object in the first frame."""

    T_cam_obj: Array
    on_object: Mask  # (H, W), its pixels
    ball: Ball
    noise_m: float  # sd of the depth
    view: FirstView | None = None  # where it can be; None: anywhere
    outline: Mask | None = None  # the mask, or the box; None where a pose was given


def find_object(
    depth: NDArray[np.float32], place: Any, camera: Camera, initial: SDF | None, options: ReconstructorOptions
) -> Beginning:
    """Find the object from a mask, a box, or the pose of the initial shape (see `sdftrack.imaging.pose_hint`)."""
    posed = not isinstance(place, tuple) and place.shape == (4, 4)
    if isinstance(place, tuple):
        on_object = mask_of_box(_without_planes(depth, place, camera) if options.planes else depth, place)
    elif posed:
        assert initial is not None
        on_object = initial.silhouette(camera, place)
        if np.count_nonzero(on_object & (depth > 0)) < MIN_READINGS:
            x, y, z = place[:3, 3]
            raise ValueError(
                "pose: expected one at which there are depth measurements of the shape, got a T_cam_obj at "
                f"({x:.3g}, {y:.3g}, {z:.3g}) m; it is in metres, with OpenCV's axes: x right, y down, z forward "
                "(z < 0 is behind the camera)"
            )
    else:
        on_object = place != 0
    ball = ball_of(depth, on_object, camera)
    view = outline = None
    if not posed:
        # The connected region in a box may be smaller than the object.
        outline = _rectangle(on_object.shape, place) if isinstance(place, tuple) else on_object
    if outline is not None and (options.keep_to_mask or options.planes):
        planes = np.zeros((0, 5))
        if options.planes:
            planes = planes_below(depth, on_object, camera, 2 * ball.radius_m)
        on_object = own_pixels(depth, on_object, camera, planes)
        limits = outline if options.keep_to_mask else np.ones(outline.shape, bool)
        view = FirstView(room(depth, on_object, limits, options.mask_margin_px), planes)
        ball = ball_of(depth, on_object, camera)
    T = np.eye(4)
    T[:3, 3] = ball.centre_cam
    if initial is not None:
        points = inside_points(initial)
        T[:3, 3] -= 0.5 * (points.min(0) + points.max(0))
    noise_m = options.noise_m or measured_noise(depth, on_object)
    return Beginning(place if posed else T, on_object, ball, noise_m, view, outline)


def _without_planes(
    depth: NDArray[np.float32], box: tuple[int, int, int, int], camera: Camera
) -> NDArray[np.float32]:
    """The depth image, 0 on planes that extend beyond the box."""
    inside = _rectangle(depth.shape, box) & (depth > 0)
    if not inside.any():
        return depth
    _, _, w, h = box
    size_m = max(w / camera.fx, h / camera.fy) * float(np.median(depth[inside]))
    planes = planes_below(depth, inside, camera, size_m, among=True)
    free = above(depth, camera, planes)
    if not (free & inside).any():
        raise ValueError(
            "box: expected an object in it, got only a plane that extends beyond it (a table, a wall); move the "
            "box, or give planes=False if the object is that flat"
        )
    return np.where(free, depth, np.float32(0))


def _rectangle(shape: tuple[int, ...], box: tuple[int, int, int, int]) -> Mask:
    x, y, w, h = box
    inside = np.zeros(shape, bool)
    inside[y : y + h, x : x + w] = True
    return inside


def inside_points(shape: SDF) -> Array:
    """Voxel centres inside a shape, (N, 3), object frame."""
    zyx = np.argwhere(shape.values <= 0)
    points: Array = zyx[:, ::-1] * shape.voxel_size + shape.origin
    return points


def ball_of(depth: NDArray[np.float32], mask: Mask, camera: Camera) -> Ball:
    """Fit a ball to a mask: its diameter is the longer side, its front touches the measurements."""
    if mask.mean() > 0.8:
        raise ValueError(f"mask: expected the object alone, got {100 * mask.mean():.0f} % of the image")
    ys, xs = np.nonzero(mask & (depth > 0))
    if len(ys) < MIN_READINGS:
        raise ValueError(
            f"mask: expected at least {MIN_READINGS} depth measurements on the object, got {len(ys)}; is it black, "
            "shiny, too small or too near?"
        )
    z = float(np.median(depth[ys, xs]))
    near = np.abs(depth[ys, xs] - z) < 0.5 * z
    ys, xs = ys[near], xs[near]
    low = np.array([(xs.min() - camera.cx) / camera.fx, (ys.min() - camera.cy) / camera.fy])
    high = np.array([(xs.max() - camera.cx) / camera.fx, (ys.max() - camera.cy) / camera.fy])
    radius = 0.5 * float((high - low).max()) * z
    at = z + CENTRE_BEHIND * radius
    middle = 0.5 * (low + high)
    front = float(np.quantile(depth[ys, xs], FRONT_QUANTILE))
    return Ball(
        at * np.array([middle[0], middle[1], 1.0]), radius, at - front, _shorter_side(xs, ys) * z / camera.fx
    )


def _shorter_side(xs: NDArray[np.intp], ys: NDArray[np.intp]) -> float:
    """Shorter side of the narrowest rectangle around the pixels, px."""
    import cv2

    return float(min(cv2.minAreaRect(np.stack([xs, ys], axis=1).astype(np.float32))[1]))


def mask_of_box(depth: NDArray[np.float32], box: tuple[int, int, int, int]) -> Mask:
    """Measurements in a box connected to its centre, with the largest depth step that does not lead out of the box."""
    x, y, w, h = box
    part = np.ascontiguousarray(depth[y : y + h, x : x + w])
    seed = _middle_reading(part)
    for jump_m in JUMPS_M:
        inside = _joined(part, seed, jump_m)
        border = np.concatenate([inside[0], inside[-1], inside[:, 0], inside[:, -1]])
        if border.mean() < MAX_ON_BORDER:
            break
    mask = np.zeros(depth.shape, bool)
    mask[y : y + h, x : x + w] = inside
    return mask


def _middle_reading(part: NDArray[np.float32]) -> tuple[int, int]:
    """The pixel (x, y) nearest to the centre, among the near pixels of the central half."""
    h, w = part.shape
    y0, x0 = h // 4, w // 4
    middle = part[y0 : max(y0 + 1, 3 * h // 4), x0 : max(x0 + 1, 3 * w // 4)]
    if not (middle > 0).any():
        raise ValueError(
            "box: expected depth measurements at its centre, got none; is the object black or shiny?"
        )
    near = float(np.percentile(middle[middle > 0], 25))
    inner = np.argwhere((middle > 0) & (np.abs(middle - near) < JUMPS_M[-1]))
    centre = 0.5 * (np.array(middle.shape) - 1)
    row, column = inner[np.argmin(np.linalg.norm(inner - centre, axis=1))]
    return int(column) + x0, int(row) + y0


def _joined(part: NDArray[np.float32], seed: tuple[int, int], jump_m: float) -> Mask:
    import cv2

    filled = np.zeros((part.shape[0] + 2, part.shape[1] + 2), np.uint8)
    cv2.floodFill(part, filled, seed, 0, jump_m, jump_m, 4 | cv2.FLOODFILL_MASK_ONLY | (255 << 8))
    joined: Mask = (filled[1:-1, 1:-1] > 0) & (part > 0)
    return joined


def measured_noise(depth: NDArray[np.float32], mask: Mask) -> float:
    """Sd (m) of the depth in a mask about straight lines through neighbouring pixels; at least 0.5 mm."""
    found = []
    for z, on in ((depth, mask & (depth > 0)), (depth.T, (mask & (depth > 0)).T)):
        bend = z[:, 2:] - 2 * z[:, 1:-1] + z[:, :-2]
        bend = np.abs(bend[on[:, 2:] & on[:, 1:-1] & on[:, :-2]])
        if len(bend) > MIN_READINGS // 2:
            kept = np.sort(bend)[: int(0.9 * len(bend))]  # edges and curvature are among the largest
            found.append(float(np.sqrt(np.mean(kept**2) / 6)) * 1.3)
    return max(MIN_NOISE_M, float(np.mean(found))) if found else 1e-3


@dataclass(frozen=True)
class Lattice:
    """Voxel centres: ``origin + voxel_m * (x, y, z)``, object frame."""

    voxels: tuple[int, int, int]
    voxel_m: float
    origin: tuple[float, float, float]

    def distances(self, shape: SDF) -> NDArray[np.float32]:
        """Signed distances of a shape, in its own object frame, (nz, ny, nx)."""
        zyx = np.indices(self.voxels[::-1], dtype=np.float64)
        points = np.moveaxis(zyx[::-1], 0, -1).reshape(-1, 3) * self.voxel_m + self.origin
        return shape(points).reshape(self.voxels[::-1]).astype(np.float32)


def ball_prior(ball: Ball, weight: float, lattice: Lattice, *, bounded: bool) -> NDArray[np.float32]:
    """Prior log ratio (z, y, x) of a ball around the object frame's origin.

    If the first view bounds the guess laterally, its depth is the mask's shorter side, and the ball is wider.
    """
    x, y, z = (
        np.arange(n, dtype=np.float32) * np.float32(lattice.voxel_m) + np.float32(o)
        for n, o in zip(lattice.voxels, lattice.origin, strict=True)
    )
    guess: NDArray[np.float32] = z[:, None, None] ** 2 + y[None, :, None] ** 2 + x[None, None, :] ** 2
    np.sqrt(guess, out=guess)
    np.subtract(np.float32(ball.radius_m * (WIDER if bounded else 1)), guess, out=guess)
    if bounded:
        back = np.float32(ball.shorter_m - ball.behind_m) - z
        np.minimum(guess, back[:, None, None], out=guess)
    return _faded(guess, weight, lattice.voxel_m)


def _faded(inside_m: NDArray[np.float32], weight: float, voxel_m: float) -> NDArray[np.float32]:
    """Scale to full weight a few voxels from the surface; in place."""
    inside_m *= np.float32(weight / (GUESS_FADES_VOXELS * voxel_m))
    return np.clip(inside_m, -weight, weight, out=inside_m)


def shape_prior(shape: SDF, weight: float, lattice: Lattice) -> NDArray[np.float32]:
    """Prior log ratio of a given shape."""
    return _faded(-lattice.distances(shape), weight, lattice.voxel_m)


# -- Initialisation and tracking with ``evolution="printed"``: first shape, prior, tracker options


INFLUENCE = 0.5  # a of thesis Eq. 4.34
PRINTED_SCALE_VOXELS = 2.0  # s of the tracker's likelihood (below Eq. 4.13)
Field = NDArray[np.float32]


def printed_shape(ball: Ball, initial: SDF | None, lattice: Lattice) -> Field:
    """Signed distance to the initial shape of the evolution: `initial`, or a ball of the mask's size.

    The thesis does not specify the location of its sphere. Ours has the mean width of the mask, and its front touches
    the object's, because the steps of the first frame move the surface by only about ten voxels. The origin of the
    object frame is the centre of `ball`.
    """
    if initial is not None:
        return lattice.distances(initial)
    radius_m = float(np.sqrt(0.5 * ball.shorter_m * ball.radius_m))
    back = (radius_m - ball.behind_m) * ball.centre_cam / ball.centre_cam[2]
    x, y, z = (
        np.arange(n, dtype=np.float64) * lattice.voxel_m + o - b
        for n, o, b in zip(lattice.voxels, lattice.origin, back, strict=True)
    )
    away = np.sqrt(z[:, None, None] ** 2 + y[None, :, None] ** 2 + x[None, None, :] ** 2)
    return (away - radius_m).astype(np.float32)


def printed_prior(shape_m: Field, voxel_m: float) -> Field:
    """Prior log ratio of inside to outside from the first shape (thesis Eqs. 4.32 to 4.34), (nz, ny, nx)."""
    inside = INFLUENCE / (1 + np.exp(shape_m / (GUESS_FADES_VOXELS * voxel_m))) + 0.5 * (1 - INFLUENCE)
    guess: Field = np.log(inside / (1 - inside)).astype(np.float32)
    return guess


def printed_tracker_options() -> TrackerOptions:
    """Options of the thesis' tracker, which does not assess its poses."""
    return TrackerOptions.printed().replace(
        lost_inliers=0.0, weak_inliers=0.0, lost_evidence=0.0, weak_evidence=0.0
    )
