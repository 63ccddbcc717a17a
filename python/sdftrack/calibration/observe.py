# SPDX-License-Identifier: MIT
"""Ball candidates in depth and in colour, for every frame of a recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.calibration.ball_color import BallColor, checked_color, moving_color
from sdftrack.calibration.ball_in_color import MIN_RADIUS_PX, Outline, find_outlines
from sdftrack.calibration.ball_in_depth import DepthBall, search_balls
from sdftrack.camera import Camera
from sdftrack.frame import Frame

Array = NDArray[np.float64]
LEARNT_FROM = 20  # frames
STATIC_SHARE = 0.4  # of the frames in which the same place holds something round
FIRST_PASS = 0.2  # of the progress


@dataclass(eq=False)
class ObservedFrame:
    """Frame `index`: its time (s, NaN: none), candidates in depth and in colour, most likely first."""

    index: int
    time_s: float
    balls: list[DepthBall]
    outlines: list[Outline]


@dataclass(eq=False)
class Watch:
    """All frames; the ball's colour; (width, height) of the colour images; radius of the largest rejected blob (px)."""

    seen: list[ObservedFrame]
    color: Array | None
    color_size: tuple[int, int]
    largest_px: float


def watch(
    frames: Any,
    depth_camera: Camera,
    radius_m: float,
    ball_color: Any,
    mask_fn: Callable[[Frame], Any] | None,
    color_camera: Camera | None,
    threads: int,
    seed: int,
    progress: Callable[[float], None] | None,
) -> Watch:
    """Search for the ball in every frame; unreadable frames and those without one of the images are skipped."""
    from concurrent.futures import ThreadPoolExecutor

    tell = progress or (lambda share: None)
    samples = _samples(frames)
    h, w = samples[0].color.shape[:2]
    if color_camera is not None and (w, h) != (color_camera.width, color_camera.height):
        raise ValueError(
            f"color_camera: expected the colour images' size {w} x {h}, got {color_camera.width} x "
            f"{color_camera.height}; scale it with Camera.scaled"
        )
    eye = color_camera or guessed_camera(w, h)
    model = None if mask_fn is not None else _model([f.color for f in samples], ball_color, eye, seed)
    tell(FIRST_PASS)

    def one(i: int) -> tuple[ObservedFrame, float] | None:
        frame = frames[i]
        if not _usable(frame):
            return None
        _check_frame(frame, i, depth_camera, (h, w))
        if mask_fn is not None:
            likeness = _mask(mask_fn(frame), (h, w), i)
        else:
            assert model is not None
            likeness = model.likeness(frame.color)
        balls = search_balls(frame.depth, depth_camera, radius_m)
        time = float("nan") if frame.timestamp is None else frame.timestamp
        outlines = find_outlines(frame.color, likeness, eye, seed)
        return ObservedFrame(i, time, balls, outlines), 0.0 if outlines else _blob_radius(likeness)

    seen: list[ObservedFrame] = []
    largest = 0.0
    with ThreadPoolExecutor(_workers(threads)) as pool:
        for i, found in enumerate(pool.map(one, range(len(frames)))):
            if found is not None:
                seen.append(found[0])
                largest = max(largest, found[1])
            tell(FIRST_PASS + (0.98 - FIRST_PASS) * (i + 1) / len(frames))
    return Watch(seen, None if model is None else model.color, (w, h), largest)


def _samples(frames: Any) -> list[Any]:
    """About 20 usable frames from the whole recording; fewer if not enough are readable."""
    step = max(1, len(frames) // LEARNT_FROM)
    for chosen in (range(0, len(frames), step), range(len(frames))):
        usable = [f for f in (frames[i] for i in chosen) if _usable(f)]
        if usable:
            return usable[:: max(1, len(usable) // LEARNT_FROM)]
    raise ValueError("frames: expected frames with depth and colour, got none with both")


def guessed_camera(width: int, height: int) -> Camera:
    """An initial colour camera with a field of view of 60 degrees."""
    f = 0.87 * max(width, height)
    return Camera(f, f, 0.5 * (width - 1), 0.5 * (height - 1), width, height)


def moving_first(seen: list[ObservedFrame], radius_m: float) -> None:
    """Sort moving candidates before those of the background, in each frame, in place."""
    everything = [b.center_cam for s in seen for b in s.balls]
    if not everything:
        return
    centers = np.array(everything)
    limit = max(5.0, STATIC_SHARE * sum(bool(s.balls) for s in seen))

    def still(ball: DepthBall) -> bool:
        return bool(
            np.count_nonzero(np.linalg.norm(centers - ball.center_cam, axis=1) < 0.5 * radius_m) > limit
        )

    for s in seen:
        s.balls.sort(key=lambda b: (still(b), -b.share))


def _model(images: list[NDArray[np.uint8]], ball_color: Any, eye: Camera, seed: int) -> BallColor:
    """Histogram from the given colour, or from moving pixels, relearned from the outlines found with it."""
    if ball_color is None and len(images) < 3:
        raise ValueError(
            f"ball_color: expected (r, g, b) with so few frames ({len(images)}): motion cannot be detected"
        )
    model = BallColor(checked_color(ball_color) if ball_color is not None else moving_color(images))
    kept, masks = [], []
    for image in images:
        found = find_outlines(image, model.likeness(image), eye, seed, most=1)
        if found:
            kept.append(image)
            masks.append(_disc(found[0], image.shape[:2]))
    if kept:
        model.learn(kept, masks)
    return model


def _disc(outline: Outline, shape: tuple[int, int]) -> NDArray[np.bool_]:
    centre = 0.5 * (outline.edges_px.min(axis=0) + outline.edges_px.max(axis=0))
    v, u = np.mgrid[: shape[0], : shape[1]]
    return np.asarray(np.hypot(u - centre[0], v - centre[1]) < 0.9 * outline.radius_px)


def _usable(frame: Any) -> bool:
    if not isinstance(frame, Frame):
        raise TypeError(
            f"frames: expected st.Frame, got {type(frame).__name__}; make them with st.Frame(depth, color)"
        )
    return frame.depth is not None and frame.color is not None


def _check_frame(frame: Frame, i: int, depth_camera: Camera, color_shape: tuple[int, int]) -> None:
    assert frame.depth is not None
    assert frame.color is not None
    if frame.depth.shape != depth_camera.shape:
        raise ValueError(
            f"depth_camera: frame {i} has depth of {frame.depth.shape[1]} x {frame.depth.shape[0]}, the camera is "
            f"{depth_camera.width} x {depth_camera.height}"
        )
    if frame.color.shape[:2] != color_shape:
        raise ValueError(
            f"frames: expected colour images of one size, {color_shape[1]} x {color_shape[0]}, frame {i} has "
            f"{frame.color.shape[1]} x {frame.color.shape[0]}"
        )


def _mask(mask: Any, shape: tuple[int, int], i: int) -> NDArray[np.float32]:
    m = np.asarray(mask)
    if m.dtype not in (np.bool_, np.uint8) or m.shape != shape:
        raise ValueError(
            f"mask_fn: expected a bool or uint8 mask of shape {shape} (the colour image's), got {m.dtype} "
            f"{m.shape} for frame {i}"
        )
    return (m != 0).astype(np.float32)


def _blob_radius(likeness: NDArray[np.float32]) -> float:
    """Radius of a disc with the largest blob's area, if it is too small to be fitted; else 0."""
    import cv2

    count, _, stats, _ = cv2.connectedComponentsWithStats((likeness > 0.5).astype(np.uint8))
    if count < 2:
        return 0.0
    radius = float(np.sqrt(stats[1:, cv2.CC_STAT_AREA].max() / np.pi))
    return radius if radius < MIN_RADIUS_PX + 1 else 0.0


def _workers(threads: int) -> int:
    from sdftrack import _core

    return int(_core.thread_count(threads))
