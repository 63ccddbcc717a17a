# SPDX-License-Identifier: MIT
"""A frame of the contour tracker on one thread. Changing these numbers breaks comparisons.

A textured blob of a third of the image's height over a textured background with noise, 427 x 240 and 854 x 480; the
frames of a slow video, back and forth.
"""

import itertools
from collections.abc import Callable

from harness import benchmark

import sdftrack as st
from sdftrack.synth.blob import blob_video

FRAMES = 12  # of 60


def tracking(size: tuple[int, int], **options: object) -> Callable[[], object]:
    video = blob_video(frames=60, size=size)
    tracker = st.contour.ContourTracker(**options)  # type: ignore[arg-type]
    tracker.start(video.images[0], mask=video.masks[0])
    images = itertools.cycle(video.images[1:FRAMES] + video.images[FRAMES:0:-1])
    return lambda: tracker.track(next(images))


@benchmark("contour/track_427x240", unit="frame")
def track_small() -> Callable[[], object]:
    return tracking((427, 240))


@benchmark("contour/track_427x240_affine", unit="frame")
def track_affine() -> Callable[[], object]:
    return tracking((427, 240), warp="affine")


@benchmark("contour/track_854x480", unit="frame")
def track_large() -> Callable[[], object]:
    return tracking((854, 480))
