# SPDX-License-Identifier: MIT
"""Shapes that are found: reconstruction, primitives, planes; and the cameras: lens, colour to depth."""

from pathlib import Path

import cv2
import numpy as np
from digest import CAMERA, Hashes, digest, mesh, tracked

import sdftrack as st
from experiments.synth.ball import ball_scene
from sdftrack import geometry

KINDS = ("sphere", "cylinder", "cone", "box", "ellipsoid")


def _body() -> st.SDF:
    ball = st.SDF.sphere(0.032, voxels=64).transformed(geometry.pose((0, 0, 0), (0.035, 0.0, 0.01)))
    return st.smooth_union(st.SDF.box((0.08, 0.05, 0.04), voxels=64), ball, radius=0.01)


def _turning(n: int) -> np.ndarray:
    axis = np.array([0.2, 1.0, 0.1]) / np.linalg.norm([0.2, 1.0, 0.1])
    return np.array([geometry.pose(np.radians(4 * i) * axis, (0.0, 0.0, 0.5)) for i in range(n)])


def _solid(kind: str) -> st.SDF:
    sizes = {"sphere": (0.05,), "cylinder": (0.04, 0.12), "cone": (0.05, 0.12), "box": ((0.1, 0.07, 0.05),)}
    return getattr(st.SDF, kind)(*sizes.get(kind, ((0.05, 0.04, 0.03),)), voxels=64)


def _found(fit: st.PrimitiveFit) -> str:
    return digest(fit.kind, fit.T_cam_obj, list(fit.size.values()), fit.covariance, fit.rms, str(fit.status),
                  fit.reason, fit.scores)  # fmt: skip


def reconstruction() -> Hashes:
    """An unknown body that turns, by depth and with colours, refined; then the tracker that goes on with it."""
    camera = st.Camera(400.0, 400.0, 159.5, 119.5, 320, 240)
    seq = st.synth.sequence(_body(), 14, _turning(14), 0.001, seed=4, camera=camera)
    frames = list(seq)
    star = st.Reconstructor(camera, voxels=80, options=st.ReconstructorOptions(settle_after=4))
    results = [star.start(frames[0], mask=seq.masks(0)[0])] + [star.track(f) for f in frames[1:11]]
    out = {"mesh": mesh(star.mesh()), "shape": digest(star.shape.values, star.shape.colors)}
    star.refine()
    out["refined"] = digest(mesh(star.mesh()), star.shape.values)
    results += [star.track(f) for f in frames[11:]]
    out["tracker"] = digest(tracked([star.tracker().track(frames[-1])]))
    return {**tracked(results), **out}


def primitives() -> Hashes:
    """Each kind from a frame on a table, one from points, `auto`, several frames, and tracked with a free size."""
    out = {}
    for kind in KINDS:
        seq = st.synth.sequence(
            _solid(kind).to_mesh(), 4, _turning(4), 0.001, seed=6, camera=CAMERA, clutter="wall"
        )
        masks, frames = [seq.masks(i)[0] for i in range(4)], list(seq)
        out[kind] = _found(st.fit_primitive(frames[0], kind, camera=CAMERA, mask=masks[0]))
        if kind in ("cylinder", "box"):
            out[f"{kind} by auto"] = _found(st.fit_primitive(frames[0], camera=CAMERA, mask=masks[0]))
            out[f"{kind} from four frames"] = _found(st.fit_primitive(
                [f.replace(mask=m) for f, m in zip(frames, masks, strict=True)], kind, camera=CAMERA))  # fmt: skip
            tracker = st.Tracker(st.Primitive(kind, voxels=64), CAMERA)
            results = [tracker.start(frames[0], masks=masks[0])] + [tracker.track(f) for f in frames[1:]]
            out[f"{kind} tracked"] = digest(tracked(results), [_found(s) for s in tracker.sizes if s])
    points = np.random.default_rng(0).normal(size=(800, 3))
    points = 0.05 * points / np.linalg.norm(points, axis=1, keepdims=True) + [0, 0, 0.6]
    out["points"] = _found(st.fit_primitive(points, "sphere"))
    missed = st.Tracker(st.Primitive("box"), CAMERA)
    out["not found"] = digest(tracked([missed.start(st.Frame(np.full(CAMERA.shape, 1.2, np.float32)))]))
    return out


def cameras() -> Hashes:
    """Lens from a box swept through the image, and the colour camera from a ball."""
    truth = st.Camera(290.0, 286.0, 158.0, 121.5, 320, 240)
    guess = st.Camera(319.0, 315.0, 168.0, 131.5, 320, 240)
    box = st.SDF.box((0.20, 0.16, 0.12), voxels=80)
    path = st.synth.sweep(near_m=0.45, far_m=0.8)
    seq = st.synth.sequence(box.to_mesh(), 30, path, 0.001, seed=3, camera=truth, color=False)
    found = st.calibrate_intrinsics([seq[i] for i in range(30)], box, guess, seq.ground_truth[0][0])
    out = {
        "lens": digest(found.values, found.covariance, found.poses, found.bias, found.status, found.reason)
    }
    depth, color = (
        st.Camera(262.0, 263.0, 159.0, 120.5, 320, 240),
        st.Camera(305.0, 306.0, 161.0, 118.0, 320, 240),
    )
    scene = ball_scene(16, 0.05, depth_camera=depth, color_camera=color, fps=7.5)
    both = st.calibrate_color_to_depth([scene.sequence[i] for i in range(16)], depth, 0.05)
    return {**out, "color": digest(both.P, both.q, both.covariance, both.rms_px)}


def volumes() -> Hashes:
    """Volumes of meshes and solids, rendering, planes, level sets."""
    out = {kind: digest(_solid(kind).values) for kind in KINDS}
    body = _body()
    again = st.SDF.from_mesh(body.to_mesh(), voxels=60)
    out["from mesh"] = digest(again.values, again.origin)
    T = geometry.pose((0.3, 0.2, 0.1), (0.0, 0.0, 0.5))
    out["rendered"] = digest(*body.render(CAMERA, T), body.silhouette(CAMERA, T))
    out["cast"] = digest(*body.to_mesh().raycast(CAMERA, T))
    frame = st.Frame(body.to_mesh().raycast(CAMERA, T)[0])
    ratio = st.levelset.evidence(frame, CAMERA, T, body)
    out["evolved"] = digest(ratio, st.levelset.evolve(body.values, ratio, 4, body.voxel_size))
    return out


def recorded_tables(data: Path) -> Hashes:
    """Planes and primitives of table scenes."""
    camera, out = st.Camera.load(data / "osd" / "camera.json"), {}
    for name in ("learn00", "learn33"):
        depth = cv2.imread(str(data / "osd" / f"{name}_depth.png"), cv2.IMREAD_UNCHANGED)
        label = cv2.imread(str(data / "osd" / f"{name}_label.png"), cv2.IMREAD_UNCHANGED)
        frame = st.Frame(depth, depth_scale=0.001)
        off, plane = st.remove_plane(frame, camera)
        out[f"{name} plane"] = digest(off, *plane)
        first = label == np.unique(label)[1]
        out[f"{name} primitive"] = _found(st.fit_primitive(frame, camera=camera, mask=first))
    return out


SYNTHETIC = (reconstruction, primitives, cameras, volumes)
RECORDED = (recorded_tables,)
