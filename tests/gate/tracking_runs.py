# SPDX-License-Identifier: MIT
"""Tracking of known shapes: synthetic scenes, and recordings where they are present."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from digest import CAMERA, Hashes, digest, tracked

import sdftrack as st
from sdftrack import geometry

SIZE_M = (0.12, 0.09, 0.06)
TURN = geometry.pose([0.0, 0.0, 0.03], [0.004, 0.002, 0.001])


def _box() -> st.SDF:
    return st.SDF.box(SIZE_M, voxels=80)


def _scene(n: int, color: bool, occluder=None, clutter=None, count: int = 1, seed: int = 5) -> st.Sequence:
    shape = _box().to_mesh()
    return st.synth.sequence(
        [shape] * count if count > 1 else shape, n, None, 0.001, occluder, seed,
        camera=CAMERA, clutter=clutter, color=color,
    )  # fmt: skip


def _follow(tracker: st.Tracker, frames: list[st.Frame], **start) -> Iterator[st.TrackResult]:
    yield tracker.start(frames[0], **start)
    for frame in frames[1:]:
        yield tracker.track(frame)


def depth() -> Hashes:
    """Depth alone, both motion models, and the source's own options."""
    seq, shape = _scene(12, color=False), _box()
    frames, T = list(seq), seq.ground_truth[0][0]
    out = tracked(_follow(st.Tracker(shape, CAMERA), frames, poses=T))
    moving = tracked(_follow(st.Tracker(shape, CAMERA, motion="constant_velocity"), frames, poses=T))
    printed = st.Tracker(shape, CAMERA, options=st.TrackerOptions.printed())
    return {**out, "moving": digest(moving), "printed": digest(tracked(_follow(printed, frames, poses=T)))}


def rgbd() -> Hashes:
    """Colour and depth among clutter, with a hand in front, and soft membership."""
    seq, shape = _scene(14, True, st.synth.Hand(0.4), "wall"), _box()
    frames, T = list(seq), seq.ground_truth[0][0]
    tracker = st.Tracker(shape, CAMERA, mode="rgbd", membership=True)
    results = list(_follow(tracker, frames, poses=T))
    return {
        **tracked(results),
        "membership": digest([r.membership for r in results], [r.foreground for r in results]),
    }


def lens() -> Hashes:
    """A distorted lens, and a frame with a camera and mask of its own."""
    bent = st.Camera(260, 260, 159.5, 119.5, 320, 240, (0.08, -0.05, 0.0, 0.0))
    seq = st.synth.sequence(_box().to_mesh(), 4, None, 0.001, seed=2, camera=bent, color=False)
    frames = list(seq)
    frames[2] = frames[2].replace(mask=seq.masks(2)[0])
    return tracked(_follow(st.Tracker(_box(), bent), frames, poses=seq.ground_truth[0][0]))


def several() -> Hashes:
    """Two that touch and part, with and without contact terms; one added, one removed."""
    shape, out = _box(), {}
    pose = geometry.pose([0.5, -0.6, 0.2], [0.01, 0, 0.6])
    gaps = (0.02, 0.005, 0.0005, 0.0005, 0.01)
    paths = np.array([[pose, pose @ geometry.pose([0, 0, 0], [0, 0, SIZE_M[2] + g])] for g in gaps])
    seq = st.synth.sequence(
        [shape.to_mesh()] * 2, len(gaps), paths, 0.001, seed=3, camera=CAMERA, clutter="wall"
    )
    frames = list(seq)
    for collision in ("contact", "printed", None):
        tracker = st.Tracker([shape, shape], CAMERA, collision=collision)
        out[str(collision)] = digest(tracked(_follow(tracker, frames, poses=list(paths[0]))))
    tracker = st.Tracker(shape, CAMERA)
    results = [tracker.start(frames[0], poses=paths[0, 0])]
    tracker.add(shape, pose=paths[1, 1], name="second")
    results += [tracker.track(frames[1]), tracker.track(frames[2])]
    tracker.remove(0)
    return {**out, **tracked([*results, tracker.track(frames[3])])}


def overlapping() -> Hashes:
    """Two trackers' objects sent to one place: at most one of them can be right."""
    seq, shape = _scene(3, color=False), _box()
    frames, T = list(seq), seq.ground_truth[0][0]
    tracker = st.Tracker([shape, shape], CAMERA, names=["left", "right"], recover=False)
    return tracked(_follow(tracker, frames, poses=[T, T @ geometry.pose([0, 0, 0.1], [0.015, 0, 0])]))


def start() -> Hashes:
    """From a mask, a box, and the whole image; what cannot be found is lost."""
    seq, shape, out = _scene(3, True, clutter="touching"), _box(), {}
    frames, mask = list(seq), seq.masks(0)[0]
    y, x = np.nonzero(mask)
    box = (int(x.min()), int(y.min()), int(np.ptp(x)) + 1, int(np.ptp(y)) + 1)
    for name, place in (("mask", {"masks": mask}), ("box", {"boxes": box}), ("none", {})):
        out[name] = digest(tracked(_follow(st.Tracker(shape, CAMERA), frames, **place)))
    wall = st.Frame(np.full(CAMERA.shape, 1.2, np.float32))
    return {**out, **tracked(_follow(st.Tracker(shape, CAMERA), [wall, frames[0]]))}


def lost() -> Hashes:
    """Leaves the image and comes back; bad frames; a pose and a prior set by hand; recovery on demand."""
    away = st.synth.leave_and_return(4, 10)
    seq = st.synth.sequence(_box().to_mesh(), 16, away, 0.001, seed=7, camera=CAMERA, clutter="wall")
    frames, T = list(seq), seq.ground_truth[0][0]
    frames[2] = st.Frame.unreadable("depth/000002.png: truncated", timestamp=frames[2].timestamp)
    frames[3] = st.Frame(np.zeros(CAMERA.shape, np.float32), timestamp=frames[3].timestamp)
    tracker = st.Tracker(_box(), CAMERA)
    results = list(_follow(tracker, frames, poses=T))
    results.append(tracker.recover(frames[-1]))
    results.append(tracker.recover(frames[0], k=0, mask=seq.masks(0)[0]))
    tracker.set_pose(0, T @ TURN, np.diag([1e-4] * 3 + [1e-2] * 3))
    results.append(tracker.track(frames[0]))
    return tracked(results)


def look_alikes() -> Hashes:
    """Two of a kind leave the image one after the other, and come back elsewhere: found again, and told apart."""
    near, far = ([0.4, -0.5, 0.2], [-0.3, 0.5, 0.1])
    path = []
    for i in range(16):
        first = [0.10 - 0.01 * i, 0.02, 0.6] if i < 4 else [-0.17, 0.12, 0.8] if i > 8 else [5.0, 0, 1.0]
        second = (
            [-0.12, -0.03 + 0.004 * i, 0.65] if i < 6 else [0.16, -0.1, 0.7] if i > 10 else [-5.0, 0, 1.0]
        )
        turned = far if i > 6 else near
        path.append([geometry.pose(turned, first), geometry.pose(far, second)])
    shape = _box()
    seq = st.synth.sequence(
        [shape.to_mesh()] * 2, 16, np.array(path), 0.001, seed=8, camera=CAMERA, clutter="wall"
    )
    return tracked(_follow(st.Tracker([shape, shape], CAMERA), list(seq), poses=path[0]))


def photometric() -> Hashes:
    """A printed ball that turns: its colours hold what depth does not see."""
    ball = st.SDF.sphere(0.05, voxels=64)
    z, y, x = np.indices(ball.values.shape)
    p = (ball.origin + ball.voxel_size * np.stack([x, y, z], -1)) / 0.006
    wave = np.stack(
        [np.sin(p[..., 0] + 0.3 * p[..., 2]), np.cos(p[..., 1]), np.sin(p[..., 2] + p[..., 1])], -1
    )
    rgba = np.full((*ball.values.shape, 4), 255, np.uint8)
    rgba[..., :3] = np.rint(128 + 70 * wave)
    painted = st.SDF(ball.values, ball.voxel_size, ball.origin, rgba)
    mesh = painted.to_mesh()
    poses = np.array([geometry.pose([0.02 * i, 0.03 * i, 0], [0, 0, 0.5]) for i in range(6)])
    seq = st.synth.sequence(mesh, 6, poses, 0.001, seed=1, camera=CAMERA)
    return tracked(_follow(st.Tracker(painted, CAMERA, mode="rgbd"), list(seq), poses=poses[0]))


def recorded_bop(data: Path) -> Hashes:
    """YCB-Video, and two sequences of the Azure Kinect and the RealSense kind: first frames of each."""
    out = {}
    for name, count, step in (("ycbv10", 6, 1), ("mustard0", 12, 4), ("visp_rbt", 12, 4)):
        with st.open_sequence(data / name) as seq:
            obj = seq.objects[0]
            shape = st.SDF.from_mesh(seq.models[obj], voxels=80)
            frames = list(seq[: count * step : step])
            tracker = st.Tracker(shape, seq.camera)
            T = seq.ground_truth[0][0]
            out[name] = digest(tracked(_follow(tracker, frames, poses=T)))
            out[f"{name} from a mask"] = digest(tracked([tracker.start(frames[0], masks=seq.masks(0)[0])]))
    return out


def recorded_sponges(data: Path) -> Hashes:
    """Two sponges in the hand, a Kinect's unregistered colour."""
    with st.open_sequence(data / "k1") as seq:
        shape = st.SDF.from_mesh(seq.models[1], voxels=80)
        tracker = st.Tracker([shape, shape], seq.camera, mode="rgbd")
        poses = [seq.ground_truth[0][k] for k in (0, 1)]
        return tracked(_follow(tracker, list(seq[:60:6]), poses=poses))


SYNTHETIC = (depth, rgbd, lens, several, overlapping, start, lost, look_alikes, photometric)
RECORDED = (recorded_bop, recorded_sponges)
