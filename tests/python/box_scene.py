# SPDX-License-Identifier: MIT
"""Boxes before a wall as a small depth camera sees them, in closed form; tests/cpp/box_scene.h is its twin.

`answers` tracks the sequence that both languages track; ``python tests/python/box_scene.py`` writes what they are
compared with, tests/data/tracked_boxes.txt.
"""

import pathlib

import numpy as np

import sdftrack as st

HALF_BOX_M = (0.06, 0.045, 0.03)
WALL_M, NEAR_BOARD_M = np.float32(1.2), 0.4
CAMERA = st.Camera(130, 130, 79.5, 59.5, 160, 120)
EXPECTED = pathlib.Path(__file__).parents[1] / "data" / "tracked_boxes.txt"


def box_volume(n=60, half_m=0.1):
    voxel_m = np.float32(2 * half_m / (n - 1))
    at = -half_m + float(voxel_m) * np.arange(n)
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    q = [np.abs(v) - h for v, h in zip((x, y, z), HALF_BOX_M, strict=True)]
    out = [np.maximum(v, 0.0) for v in q]
    outside = np.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])
    values = outside + np.minimum(0.0, np.maximum(np.maximum(q[0], q[1]), q[2]))
    return st.SDF(values.astype(np.float32), float(voxel_m), np.full(3, np.float32(-half_m), np.float64))


def pose_at(x, y, z):
    """A turn whose matrix is written out, so that no library's sine has a say."""
    return np.array([[0.64, -0.48, 0.6, x], [0.6, 0.8, 0.0, y], [-0.48, 0.36, 0.8, z], [0, 0, 0, 1]])


def beside(T, gap_m):
    """Next to the one at T along the box's shortest edge."""
    out = T.copy()
    out[:3, 3] = T[:3, 2] * (2 * HALF_BOX_M[2] + gap_m) + T[:3, 3]
    return out


def box_depth(T, x, y):
    enters, leaves = np.zeros_like(x), np.full_like(x, np.inf)
    for i, half in enumerate(HALF_BOX_M):
        a, t = T[:3, i], T[:3, 3]
        along, middle = a[0] * x + a[1] * y + a[2], a[0] * t[0] + a[1] * t[1] + a[2] * t[2]
        one, two = (middle - half) / along, (middle + half) / along
        enters = np.maximum(enters, np.minimum(one, two))
        leaves = np.minimum(leaves, np.maximum(one, two))
    return np.where(enters < leaves, enters, np.inf)


def unevenness_m(frame):
    """The same for the same frame number: something like noise of 0.6 mm."""
    y, x = np.mgrid[:120, :160]
    n = ((frame * 120 + y) * 160 + x).astype(np.uint32) * np.uint32(2654435761)
    n = (n ^ (n >> np.uint32(15))) * np.uint32(2246822519)
    n ^= n >> np.uint32(13)
    return ((n & np.uint32(1023)) / 1023.0 - 0.5) * 0.002


def depth_of(boxes, frame, covered=False):
    """`covered`: a board is in front of what only the last of the boxes shows."""
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width].astype(np.float64)
    x, y = (u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy
    depths = np.stack([box_depth(T, x, y) for T in boxes]) if boxes else np.full((1, *x.shape), np.inf)
    nearest = depths.min(axis=0)
    z = np.where(nearest < 10, nearest + unevenness_m(frame), float(WALL_M))
    if covered:
        z[(depths.argmin(axis=0) == len(boxes) - 1) & (nearest < 10)] = NEAR_BOARD_M
    return z.astype(np.float32)


def answers():
    """One result for each call of the sequence."""
    shape = box_volume()
    tracker = st.Tracker([shape, shape], CAMERA, threads=1, names=["left", "right"])
    first = pose_at(-0.02, 0.01, 0.55)
    both = [first, beside(first, 0.004)]

    def frame(i, boxes, **options):
        return st.Frame(depth_of(boxes, i, **options), timestamp=i / 30)

    yield tracker.start(frame(0, both), poses=both)
    for i in (1, 2):
        both = [pose_at(-0.02 + 0.003 * i, 0.01, 0.55), beside(pose_at(-0.02 + 0.003 * i, 0.01, 0.55), 0.004)]
        yield tracker.track(frame(i, both))
    yield tracker.track(st.Frame.unreadable("the file is torn", timestamp=3 / 30))
    yield tracker.track(st.Frame(None, np.zeros((120, 160, 3), np.uint8), timestamp=4 / 30))
    yield tracker.track(st.Frame(np.zeros(CAMERA.shape, np.float32), timestamp=5 / 30))
    yield tracker.track(frame(6, both))
    for i in (7, 8):
        yield tracker.track(frame(i, both, covered=True))
    for i in (9, 10):
        yield tracker.track(frame(i, []))
    away = [pose_at(0.03, 0.0, 0.6), pose_at(-0.16, 0.02, 0.65)]
    for i in (11, 12, 13, 14):
        yield tracker.track(frame(i, away))
    yield tracker.recover(frame(14, away), k=1)
    tracker.set_pose(1, away[0], 1e-9 * np.eye(6))
    yield tracker.track(frame(15, away))
    yield tracker.recover(frame(15, []), k=0)


def lines(results):
    """Numbers with all their digits, the reasons behind them."""
    for call, result in enumerate(results):
        for k, status in enumerate(result.status):
            numbers = [
                *result.poses[k][:3].ravel(), *result.twists[k], result.confidence[k], result.inliers[k],
            ]  # fmt: skip
            yield (
                f"{call} {result.index} {k} {status} {' '.join(f'{float(x):.17g}' for x in numbers)} "
                f"{result.reason[k]}".rstrip()
            )


if __name__ == "__main__":
    EXPECTED.write_text("\n".join(lines(answers())) + "\n")
