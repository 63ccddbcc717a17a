# SPDX-License-Identifier: MIT
"""Edges of the sponges of k1 in its colour images, against where P and q put them: outlines, creases, depth steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from sdftrack.calibration.ball_in_color import edges_along
from sdftrack.calibration.projective import decompose
from sdftrack.geometry import inverse, transform_points

__all__ = ["Scene", "crease_shift", "depth_step_shift", "outline_shift"]

Array = NDArray[np.float64]
FINER = 3  # of the picture that outlines are taken from
REACH_PX = 5.0
MIN_EDGES = 80


@dataclass(frozen=True)
class Scene:
    """The sponge's mesh and volume, the sequence, and M = [P K | q] on points of the depth camera (m)."""

    seq: Any
    mesh: Any
    sdf: Any
    M: Array

    @classmethod
    def of(cls, seq: Any, voxels: int = 150) -> Scene:
        mesh = next(iter(seq.models.values()))
        P, q = seq.camera.projective
        return cls(
            seq, mesh, st.SDF.from_mesh(mesh, voxels=voxels), np.column_stack([P @ seq.camera.depth.K, q])
        )

    def project(self, p_cam: Array) -> Array:
        y = np.column_stack([p_cam, np.ones(len(p_cam))]) @ self.M.T
        px: Array = y[:, :2] / y[:, 2:]
        return px


def outline_shift(scene: Scene, T_cam_obj: Array, image: NDArray[Any]) -> Array | None:
    """(dx, dy, outward) px that bring the projected outline of a sponge onto its edges in the image; None: too few.

    The third is a uniform growth: errors of the shape's size, and the halo of an edge, go there and not into the shift.
    """
    at, normal = _outline(scene, T_cam_obj)
    found = edges_along(image.astype(np.float32), at, normal, np.full(len(at), REACH_PX))
    off = np.einsum("nk,nk->n", found.at - at, normal)
    if np.count_nonzero(found.sure) < MIN_EDGES:
        return None
    A, d = np.column_stack([normal, np.ones(len(at))])[found.sure], off[found.sure]
    return robust(A, d)


def crease_shift(
    scene: Scene, T_cam_obj: Array, grey: NDArray[np.float32]
) -> tuple[float, float, float] | None:
    """(dx px, depth m, u px) of the upright crease between two faces that both face the camera; None without one.

    A crease is where two planes meet, both of them read in depth: what happens at the outline does not touch it.
    """
    import cv2

    p, ends = _creases(scene, T_cam_obj)
    px, next_px = scene.project(p), scene.project(p + 0.001 * ends)
    along = next_px - px
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    upright = np.abs(along[:, 1]) > 0.95
    if np.count_nonzero(upright) < 25:
        return None
    s = np.arange(-8, 8.01, 0.25)
    at = px[upright]
    u, v = (at[:, None, 0] + s).astype(np.float32), np.repeat(at[:, 1:], len(s), 1).astype(np.float32)
    slope = np.gradient(cv2.remap(grey, u, v, cv2.INTER_LINEAR).mean(axis=0), s)
    peak = 8 + int(np.argmax(np.abs(slope[8:-8])))
    near = slice(peak - 8, peak + 9)
    weight = np.clip(slope[near] * np.sign(slope[peak]), 0, None)
    return float((weight * s[near]).sum() / weight.sum()), float(p[upright, 2].mean()), float(at[:, 0].mean())


def depth_step_shift(
    scene: Scene, T_cam_obj: Array, depths: NDArray[np.float32], image: NDArray[Any]
) -> Array:
    """(left, right) median displacement (px, along x) of the sponge's own steps in depth.

    Shape and pose only say where to look. A step lies where half of the frames `depths` (n, H, W) read the sponge.
    """
    lens = scene.seq.camera.depth
    model = scene.sdf.render(lens, np.ascontiguousarray(T_cam_obj))[0]
    on = model > 0
    near, far = model[on].min() - 0.02, model[on].max() + 0.02
    share = np.mean((depths > near) & (depths < far), axis=0)
    typical = np.median(depths, axis=0)
    rows = np.flatnonzero(on.any(axis=1))[8:-4]
    out = []
    for inward in (1, -1):
        at = []
        for v in rows:
            columns = np.flatnonzero(on[v])
            start = columns[0] if inward == 1 else columns[-1]
            reach = start + inward * np.arange(-10, 7)
            if reach.min() < 0 or reach.max() >= lens.width:
                continue
            seen = share[v, reach]
            if seen[:3].max() > 0.2 or seen[-3:].min() < 0.8:
                continue
            u = start + inward * (-10.5 + (1 - seen).sum())
            z = float(np.median(typical[v, np.rint(u + inward * np.arange(1, 4)).astype(int)]))
            at.append(_point(lens, u, v, z))
        px = scene.project(np.array(at))
        normal = np.tile([-float(inward), 0.0], (len(px), 1))
        found = edges_along(image.astype(np.float32), px, normal, np.full(len(px), 6.0))
        out.append(float(np.median((found.at - px)[found.sure, 0])))
    return np.array(out)


def robust(A: Array, d: Array) -> Array:
    """Least squares under Tukey's loss."""
    x: Array = np.asarray(np.linalg.lstsq(A, d, rcond=None)[0], dtype=np.float64)
    for _ in range(30):
        r = d - A @ x
        sd = max(1.4826 * float(np.median(np.abs(r))), 0.1)
        u = r / (4.685 * sd)
        root = np.where(np.abs(u) < 1, 1 - u * u, 0)
        x = np.asarray(np.linalg.lstsq(A * root[:, None], d * root, rcond=None)[0], dtype=np.float64)
    return x


def _point(lens: Any, u: float, v: float, z: float) -> Array:
    return np.array([(u - lens.cx) / lens.fx * z, (v - lens.cy) / lens.fy * z, z])


def _outline(scene: Scene, T_cam_obj: Array) -> tuple[Array, Array]:
    """Points (px) of the outline as the colour camera sees it, and its outward normals."""
    import cv2

    _, T = decompose(scene.M)
    eye = st.Camera(525, 525, 320, 245, 640, 480).scaled(FINER)
    depth = scene.sdf.render(eye, np.ascontiguousarray(T @ T_cam_obj))[0]
    mask = (depth > 0).astype(np.uint8)
    border = max(cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0], key=len)[:, 0]
    z = depth[border[:, 1], border[:, 0]]
    p_eye = np.column_stack([(border[:, 0] - eye.cx) / eye.fx * z, (border[:, 1] - eye.cy) / eye.fy * z, z])
    px = scene.project(transform_points(inverse(T), p_eye))
    wide = 9
    ring = np.vstack([border[-wide:], border, border[:wide]]).astype(float)
    smooth = np.column_stack(
        [np.convolve(ring[:, k], np.ones(2 * wide + 1) / (2 * wide + 1), "valid") for k in (0, 1)]
    )
    along = np.roll(smooth, -6, axis=0) - np.roll(smooth, 6, axis=0)
    normal = np.column_stack([along[:, 1], -along[:, 0]])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    test = np.rint(smooth + 6 * normal).astype(int)
    h, w = mask.shape
    inward = mask[np.clip(test[:, 1], 0, h - 1), np.clip(test[:, 0], 0, w - 1)] > 0
    normal[inward] *= -1
    # The border's pixels are the last inside: the outline is half a fine pixel further.
    return (px + 0.5 / FINER * normal)[::FINER], normal[::FINER]


def _creases(scene: Scene, T_cam_obj: Array) -> tuple[Array, Array]:
    """Points (m, depth camera) each millimetre along sharp edges between two faces in view, and directions."""
    corners, own = np.unique(np.round(scene.mesh.vertices, 6), axis=0, return_inverse=True)
    faces = own.reshape(-1)[np.asarray(scene.mesh.faces)]
    p = transform_points(T_cam_obj, corners)
    a, b, c = (p[faces[:, k]] for k in range(3))
    n = np.cross(b - a, c - a)
    n /= np.linalg.norm(n, axis=1, keepdims=True) + 1e-15
    eye = -np.linalg.solve(scene.M[:, :3], scene.M[:, 3])
    facing = np.einsum("nk,nk->n", n, a - eye) < -0.1 * np.linalg.norm(a - eye, axis=1)
    beside: dict[tuple[int, int], list[int]] = {}
    for f, corner in enumerate(faces.tolist()):
        for k in range(3):
            i, j = sorted((corner[k], corner[(k + 1) % 3]))
            beside.setdefault((i, j), []).append(f)
    points, ends = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for (i, j), two in beside.items():
        if len(two) == 2 and facing[two].all() and n[two[0]] @ n[two[1]] < 0.6:
            length = float(np.linalg.norm(p[j] - p[i]))
            s = np.linspace(0, 1, max(2, int(1000 * length)))[:, None]
            points.append(p[i] + s * (p[j] - p[i]))
            ends.append(np.tile((p[j] - p[i]) / length, (len(s), 1)))
    every, direction = np.concatenate(points), np.concatenate(ends)
    return _in_front(scene, every, direction, T_cam_obj)


def _in_front(scene: Scene, p: Array, direction: Array, T_cam_obj: Array) -> tuple[Array, Array]:
    """Those that the sponge itself does not hide."""
    lens = scene.seq.camera.depth
    shown = scene.sdf.render(lens, np.ascontiguousarray(T_cam_obj))[0]
    px = np.rint(lens.project(p)).astype(int)
    z = shown[np.clip(px[:, 1], 0, lens.height - 1), np.clip(px[:, 0], 0, lens.width - 1)]
    front = np.abs(z - p[:, 2]) < 0.02
    return p[front], direction[front]
