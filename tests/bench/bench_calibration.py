# SPDX-License-Identifier: MIT
"""Intrinsics of 100 frames: the joint solution alone, and everything with it."""

from harness import benchmark

import sdftrack as st
from experiments.thesis.scenes.sweeps import TRUTH, box_mesh, swept
from sdftrack import _core
from sdftrack.calibration.lens import core_lens

FRAMES, SIGMA_M, POSE_SCALE_M = 100, 0.001, 0.004  # changing these breaks comparisons
GUESS = st.Camera(632.5, 632.5, 339.5, 259.5, 640, 480)  # 10 % and 20 px off
NEAR = st.Camera(577.0, 573.0, 321.0, 238.5, 640, 480)  # where the frames before have led to


def scene():
    """The 200 mm cube swept through 640 x 480 pixels, 1 mm of noise."""
    seq = swept(box_mesh(), FRAMES, SIGMA_M)
    return [seq[i] for i in range(FRAMES)], [seq.ground_truth[i][0] for i in range(FRAMES)]


@benchmark("calibration/joint_100_frames", items=FRAMES, unit="frame")
def joint():
    frames, poses = scene()
    sdf = st.SDF.from_mesh(box_mesh())
    options = _core.IntrinsicsOptions()
    options.threads = 0

    def solve():
        core = _core.Calibration(sdf._core_args, core_lens(TRUTH), [0, 1, 2, 3], options)
        for frame, T in zip(frames, poses, strict=True):
            core.add(frame.depth, None, T)
        core.lens = core_lens(NEAR)
        core.solve(POSE_SCALE_M)
        return core.examine()

    return solve


@benchmark("calibration/intrinsics_100_frames", items=FRAMES, unit="frame")
def everything():
    frames, poses = scene()
    sdf = st.SDF.from_mesh(box_mesh())
    return lambda: st.calibrate_intrinsics(frames, sdf, GUESS, poses[0])
