# SPDX-License-Identifier: MIT
"""Calibration, planes, contours, shapes and movements. Changing these numbers breaks comparisons."""

import itertools
from collections.abc import Callable

import numpy as np
from harness import benchmark

import sdftrack as st
from experiments.common.sweeps import TRUTH, box_mesh, swept
from experiments.synth.blob import blob_video
from experiments.synth.covers import hide
from experiments.synth.gait import gait
from experiments.synth.room import corner
from experiments.synth.table_scene import table_scene
from sdftrack import _core
from sdftrack.calibration.lens import core_lens

# Intrinsics of 100 frames of a cube of 200 mm swept through 640 x 480 pixels, 1 mm of noise.
FRAMES, SIGMA_M, POSE_SCALE_M = 100, 0.001, 0.004
GUESS = st.Camera(632.5, 632.5, 339.5, 259.5, 640, 480)  # 10 % and 20 px off
NEAR = st.Camera(577.0, 573.0, 321.0, 238.5, 640, 480)  # where the frames before have led to


def calibrating(joint_alone: bool) -> Callable[[], object]:
    seq, sdf = swept(box_mesh(), FRAMES, SIGMA_M), st.SDF.from_mesh(box_mesh())
    frames, poses = [seq[i] for i in range(FRAMES)], [seq.ground_truth[i][0] for i in range(FRAMES)]
    options = _core.IntrinsicsOptions()
    options.threads = 0

    def solve() -> object:
        core = _core.Calibration(sdf._core_args, core_lens(TRUTH), [0, 1, 2, 3], options)
        for frame, T in zip(frames, poses, strict=True):
            core.add(frame.depth, None, T)
        core.lens = core_lens(NEAR)
        core.solve(POSE_SCALE_M)
        return core.examine()

    return solve if joint_alone else lambda: st.calibrate_intrinsics(frames, sdf, GUESS, poses[0])


benchmark("calibration/joint_100_frames", lambda: calibrating(True), FRAMES, "frame")
benchmark("calibration/intrinsics_100_frames", lambda: calibrating(False), FRAMES, "frame")


# A table 0.6 m below a camera that looks down by 45 degrees, with three boxes and the noise of a structured-light
# sensor, found and masked in 640 x 480 pixels on one thread.
def removing(**given: object) -> Callable[[], object]:
    scene = table_scene()
    return lambda: st.remove_plane(scene.frame, scene.camera, **given)  # type: ignore[arg-type]


def plane_angles() -> Callable[[], object]:
    seq = corner(1, "kinect")
    frame = seq[0]
    return lambda: st.metrics.plane_angles(frame, seq.camera)


benchmark("planes/remove_plane", removing, unit="frame")
benchmark("planes/remove_plane_from_a_pixel", lambda: removing(start_px=(320, 440)), unit="frame")
benchmark("planes/remove_plane_bent", lambda: removing(method="bent"), unit="frame")
benchmark("planes/remove_plane_printed", lambda: removing(method="printed"), unit="frame")
benchmark("planes/plane_angles", plane_angles, unit="frame")


# A contour on one thread: a textured blob of a third of the image's height before texture with noise; the first frames
# of a slow video, back and forth.
def contouring(size: tuple[int, int], **options: object) -> Callable[[], object]:
    video = blob_video(frames=60, size=size)
    tracker = st.contour.ContourTracker(**options)  # type: ignore[arg-type]
    tracker.start(video.images[0], mask=video.masks[0])
    images = itertools.cycle(video.images[1:12] + video.images[12:0:-1])
    return lambda: tracker.track(next(images))


benchmark("contour/track_427x240", lambda: contouring((427, 240)), unit="frame")
benchmark("contour/track_427x240_affine", lambda: contouring((427, 240), warp="affine"), unit="frame")
benchmark("contour/track_854x480", lambda: contouring((854, 480)), unit="frame")

# One silhouette of 64 x 64 pixels of the walker: 250 learnt, 20 others with a bar before 40 % asked about in turn.
KIND, LEARN, ASK, HIDDEN = "walker", 250, 20, 0.4


def learnt(masks: np.ndarray, rule: str = "remembered") -> st.contour.ShapeMemory:
    memory = st.contour.ShapeMemory(rule=rule)
    for mask in masks[:LEARN]:
        memory.learn(mask)
    return memory


def asking(rule: str) -> Callable[[], object]:
    masks = gait(KIND, LEARN + ASK)
    memory = learnt(masks, rule)
    seen = itertools.cycle([hide(m, HIDDEN, "bar", k) for k, m in enumerate(masks[LEARN:])])
    return lambda: memory.assess(next(seen))


def learning() -> Callable[[], object]:
    masks = gait(KIND, LEARN)
    return lambda: learnt(masks)


def harmonics() -> Callable[[], object]:
    mask = gait(KIND, 1)[0]
    return lambda: st.contour.harmonics(mask, 10)


benchmark("shape_memory/assess_remembered", lambda: asking("remembered"), unit="frame")
benchmark("shape_memory/assess_printed", lambda: asking("printed"), unit="frame")
benchmark("shape_memory/learn_250", learning, LEARN, "frame")
benchmark("shape_memory/harmonics", harmonics, unit="frame")


# A cup that is carried away and back for a minute at 30 Hz: the smoother, and the measures of 200 samples.
def analyzing() -> Callable[[], object]:
    made = st.synth.exercise("reach", seed=7, repetitions=10)
    poses, rng = made.poses(), np.random.default_rng(7)
    poses[:, :3, 3] += rng.normal(0, 0.001, (len(poses), 3))
    covariances = np.tile(np.diag(np.repeat([1e-3, 5e-3], 3) ** 2), (len(poses), 1, 1))
    cup = st.motion.Trajectory(made.times_s, poses, covariances, name="cup")
    return lambda: st.motion.analyze(cup, up=made.up)


benchmark("motion/analyze_60_s", analyzing, unit="recording")
