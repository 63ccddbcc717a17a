# SPDX-License-Identifier: MIT
"""The tracker on one thread, its searches on two: frames and starts. Changing these numbers breaks comparisons.

640 x 480 pixels at 525 px focal length, a box of 200^3 voxels before a wall, sigma 1 mm. The frames go back and forth
by 5 mm / 1.5 degrees, so that every frame has a motion to find. The name says how many pixels lie on the object.
"""

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from harness import benchmark

import sdftrack as st
from sdftrack import geometry

CAMERA = st.Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
SIZE_M = (0.12, 0.09, 0.06)
WALL_M = 2.5
DISTANCE_M = {2000: 1.3662, 5000: 0.866, 8000: 0.6834}  # of the box, for that many pixels at the START
START = geometry.pose([0.5, -0.6, 0.2])
STEP = geometry.pose(np.radians(1.5) * np.array([0.6, 0.0, 0.8]))
STEP_M = 0.005 * np.array([0.6, 0.48, 0.64])


def poses(pixels: int) -> list[np.ndarray]:
    here = START.copy()
    here[:3, 3] = 0, 0, DISTANCE_M[pixels]
    there = STEP @ here
    there[:3, 3] = here[:3, 3] + STEP_M
    return [here, there]


def frames(shape: st.SDF, pixels: int, color: bool = False) -> list[st.Frame]:
    rng = np.random.default_rng(0)
    out = []
    for T in poses(pixels):
        depth = shape.render(CAMERA, T)[0]
        noisy = np.where(depth > 0, depth + rng.normal(0, 0.001, depth.shape), WALL_M)
        image = None
        if color:
            image = np.where((depth > 0)[..., None], (200, 60, 40), (90, 100, 110))
            image = np.clip(image + rng.normal(0, 8, image.shape), 0, 255).astype(np.uint8)
        out.append(st.Frame(noisy.astype(np.float32), image))
    return out


def tracking(
    pixels: int, mode: str = "depth", options: st.TrackerOptions | None = None
) -> Callable[[], object]:
    shape = st.SDF.box(SIZE_M)
    images = frames(shape, pixels, color=mode == "rgbd")
    tracker = st.Tracker(shape, CAMERA, mode=mode, threads=1, options=options)
    tracker.start(images[0], poses=poses(pixels)[:1])
    count = 0

    def run() -> object:
        nonlocal count
        count += 1
        return tracker.track(images[count % 2])

    return run


def frame_from_memory() -> Callable[[], object]:
    """Frames that no cache holds, as a camera delivers them: 100 copies are 120 MB."""
    shape = st.SDF.box(SIZE_M)
    images = [st.Frame(image.depth.copy()) for image in frames(shape, 5000) * 50]
    tracker = st.Tracker(shape, CAMERA, mode="depth", threads=1)
    tracker.start(images[0], poses=poses(5000)[:1])
    turn = itertools.cycle(images)
    return lambda: tracker.track(next(turn))


def tracking_in_threads(count: int) -> Callable[[], object]:
    """200 frames of 5,000 pixels, shared out to as many trackers as there are Python threads."""
    runs = [tracking(5000) for _ in range(count)]
    pool = ThreadPoolExecutor(count)

    def share(run: Callable[[], object]) -> None:
        for _ in range(200 // count):
            run()

    return lambda: list(pool.map(share, runs))


def tracking_many(count: int) -> Callable[[], object]:
    """Boxes of 2,000 pixels side by side in one image, tracked by one tracker on one thread."""
    shape, side = st.SDF.box(SIZE_M), int(np.ceil(np.sqrt(count)))
    rng, depth, many = np.random.default_rng(0), np.full(CAMERA.shape, WALL_M), []
    for k in range(count):
        pose, z = poses(2000)[0], DISTANCE_M[2000]
        pose[0, 3] = ((k % side + 0.5) / side - 0.5) * 640 / 525 * z
        pose[1, 3] = ((k // side + 0.5) / side - 0.5) * 480 / 525 * z
        seen = shape.render(CAMERA, pose)[0]
        depth = np.where(seen > 0, seen + rng.normal(0, 0.001, seen.shape), depth)
        many.append(pose)
    image = st.Frame(depth.astype(np.float32))
    tracker = st.Tracker([shape] * count, CAMERA, mode="depth", threads=1)
    tracker.start(image, poses=many)
    return lambda: tracker.track(image)


def searching(threads: int, how: str) -> Callable[[], object]:
    shape = st.SDF.box(SIZE_M)
    image = frames(shape, 5000)[0]
    mask = shape.silhouette(CAMERA, poses(5000)[0])
    y, x = np.nonzero(mask)
    box = (x.min() - 20, y.min() - 20, np.ptp(x) + 40, np.ptp(y) + 40)
    given = {"mask": {"masks": mask}, "box": {"boxes": box}, "anywhere": {}}[how]
    tracker = st.Tracker(shape, CAMERA, mode="depth", threads=threads)
    return lambda: tracker.start(image, **given)


def lost_frame() -> Callable[[], object]:
    """A frame in which the object is looked for: clutter of the object's size, but not the object."""
    shape, other = st.SDF.box(SIZE_M), st.SDF.sphere(0.05)
    tracker = st.Tracker(shape, CAMERA, mode="depth", threads=2)
    tracker.start(frames(shape, 5000)[0], poses=poses(5000)[:1])
    image = frames(other, 5000)[0]
    return lambda: tracker.track(image)


def start_5000() -> Callable[[], object]:
    shape = st.SDF.box(SIZE_M)
    image, pose = frames(shape, 5000)[0], poses(5000)[0]
    tracker = st.Tracker(shape, CAMERA, threads=1)
    return lambda: tracker.start(image, poses=[pose])


def new_tracker() -> Callable[[], object]:
    shape = st.SDF.box(SIZE_M)
    return lambda: st.Tracker(shape, CAMERA, threads=1)


FAST = st.TrackerOptions.fast()
benchmark("tracking/frame_2000px", lambda: tracking(2000), unit="frame")
benchmark("tracking/frame_5000px", lambda: tracking(5000), unit="frame")
benchmark("tracking/frame_8000px", lambda: tracking(8000), unit="frame")
benchmark("tracking/rgbd_frame_2000px", lambda: tracking(2000, "rgbd"), unit="frame")
benchmark("tracking/rgbd_frame_5000px", lambda: tracking(5000, "rgbd"), unit="frame")
benchmark("tracking/fast_frame_8000px", lambda: tracking(8000, options=FAST), unit="frame")
benchmark("tracking/fast_rgbd_frame_8000px", lambda: tracking(8000, "rgbd", FAST), unit="frame")
benchmark("tracking/frame_5000px_from_memory", frame_from_memory, unit="frame")
benchmark("tracking/200_frames_in_1_python_thread", lambda: tracking_in_threads(1), 200, "frame")
benchmark("tracking/200_frames_in_2_python_threads", lambda: tracking_in_threads(2), 200, "frame")
benchmark("tracking/1_object_of_2000px", lambda: tracking_many(1), 1, "object")
benchmark("tracking/5_objects_of_2000px", lambda: tracking_many(5), 5, "object")
benchmark("tracking/20_objects_of_2000px", lambda: tracking_many(20), 20, "object")
benchmark("tracking/start_from_mask_2_threads", lambda: searching(2, "mask"), unit="start")
benchmark("tracking/start_from_box_2_threads", lambda: searching(2, "box"), unit="start")
benchmark("tracking/start_anywhere_2_threads", lambda: searching(2, "anywhere"), unit="start")
benchmark("tracking/lost_frame_2_threads", lost_frame, unit="frame")
benchmark("tracking/new_tracker_200_voxels", new_tracker, unit="tracker")
benchmark("tracking/start_5000px", start_5000, unit="start")
