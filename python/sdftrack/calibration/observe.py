# SPDX-License-Identifier: MIT
"""Ball candidates in depth and in colour, for every frame of a recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.validation import numbers
from sdftrack.camera import Camera
from sdftrack.frame import Frame

Array = NDArray[np.float64]
LEARNT_FROM = 20  # frames
MIN_SATURATION = 0.25
FIRST_PASS = 0.2  # of the progress


@dataclass(eq=False)
class Watch:
    """What the frames show of the ball; its colour; (width, height) of colour images; largest blob too small to fit."""

    recording: _core.BallRecording
    color: Array | None
    color_size: tuple[int, int]
    largest_px: float  # its radius


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
    samples = samples_of(frames)
    h, w = samples[0].color.shape[:2]
    if color_camera is not None and (w, h) != (color_camera.width, color_camera.height):
        raise ValueError(
            f"color_camera: expected the colour images' size {w} x {h}, got {color_camera.width} x "
            f"{color_camera.height}; scale it with Camera.scaled"
        )
    eye = color_camera or guessed_camera(w, h)
    model = None if mask_fn is not None else ball_model([f.color for f in samples], ball_color, eye, seed)
    tell(FIRST_PASS)

    finder = _core.BallFinder(depth_camera._core, radius_m)

    def one(i: int) -> tuple[_core.ObservedFrame, float] | None:
        frame = frames[i]
        if not usable(frame):
            return None
        _check_frame(frame, i, depth_camera, (h, w))
        color = np.ascontiguousarray(frame.color)
        if mask_fn is not None:
            mask = _mask(mask_fn(frame), (h, w), i)
        else:
            assert model is not None
            mask = model.mask(color)
        balls = finder.search(np.ascontiguousarray(frame.depth), frame._given)
        outlines = _core.find_outlines(color, mask, eye._core, seed)
        time = float("nan") if frame.timestamp is None else frame.timestamp
        too_small = 0.0 if outlines else _core.too_small_radius_px(mask)
        return _core.ObservedFrame(i, time, balls, outlines), too_small

    recording = _core.BallRecording()
    largest = 0.0
    with ThreadPoolExecutor(_core.thread_count(threads)) as pool:
        for i, found in enumerate(pool.map(one, range(len(frames)))):
            if found is not None:
                recording.add(found[0])
                largest = max(largest, found[1])
            tell(FIRST_PASS + (0.98 - FIRST_PASS) * (i + 1) / len(frames))
    recording.sort_moving_first(radius_m)
    return Watch(recording, None if model is None else model.color, (w, h), largest)


def samples_of(frames: Any) -> list[Any]:
    """About 20 usable frames from the whole recording; fewer if not enough are readable."""
    step = max(1, len(frames) // LEARNT_FROM)
    for chosen in (range(0, len(frames), step), range(len(frames))):
        good = [f for f in (frames[i] for i in chosen) if usable(f)]
        if good:
            return good[:: max(1, len(good) // LEARNT_FROM)]
    raise ValueError("frames: expected frames with depth and colour, got none with both")


def guessed_camera(width: int, height: int) -> Camera:
    """An initial colour camera with a field of view of 60 degrees."""
    f = 0.87 * max(width, height)
    return Camera(f, f, 0.5 * (width - 1), 0.5 * (height - 1), width, height)


def checked_color(ball_color: Any) -> Array:
    """Check that a colour is valid and saturated; returns (3,) float64."""
    c = numbers(ball_color, "ball_color")
    if c.shape != (3,) or not (np.isfinite(c).all() and (c >= 0).all() and (c <= 255).all()):
        raise ValueError(
            f"ball_color: expected (r, g, b) from 0 to 255, got {np.asarray(ball_color).tolist()}"
        )
    saturation = 1 - c.min() / c.max() if c.max() > 0 else 0.0
    if saturation < MIN_SATURATION:
        raise ValueError(
            f"ball_color: expected a saturated colour, got {tuple(int(v) for v in c)}, which is grey (saturation "
            f"{saturation:.2f}); paint the ball, or give masks of it (from Python: mask_fn)"
        )
    return c


def ball_model(images: list[NDArray[np.uint8]], ball_color: Any, eye: Camera, seed: int) -> _core.BallColor:
    """Model from the given colour, or from moving pixels, relearned from the outlines found with it."""
    if ball_color is None and len(images) < 3:
        raise ValueError(
            f"ball_color: expected (r, g, b) with so few frames ({len(images)}): motion cannot be detected"
        )
    colors = [np.ascontiguousarray(image) for image in images]
    if ball_color is None:
        model = _core.moving_color(colors)
    else:
        model = _core.BallColor(checked_color(ball_color).tolist())
    model.learn(colors, eye._core, seed)
    return model


def usable(frame: Any) -> bool:
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


def _mask(mask: Any, shape: tuple[int, int], i: int) -> NDArray[np.uint8]:
    m = np.asarray(mask)
    if m.dtype not in (np.bool_, np.uint8) or m.shape != shape:
        raise ValueError(
            f"mask_fn: expected a bool or uint8 mask of shape {shape} (the colour image's), got {m.dtype} "
            f"{m.shape} for frame {i}"
        )
    return np.ascontiguousarray(m != 0).astype(np.uint8)
