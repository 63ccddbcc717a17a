# SPDX-License-Identifier: MIT
"""A ball before a wall, by formula: depth without the errors of any renderer."""

import numpy as np

from sdftrack import Camera, _core

CAMERA = Camera(160, 155, 42.3, 33.6, 84, 70)
K = np.array([CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy])
WALL_M, BALL_M = 0.6, 0.03


def looking_from(direction, distance_m, roll_rad=0.0):
    """T_cam_obj of a camera that looks at the object's origin from `direction`."""
    z = -np.asarray(direction, float) / np.linalg.norm(direction)
    x = np.cross([0.3, 1, 0.2], z)
    x /= np.linalg.norm(x)
    R = np.array([x, np.cross(z, x), z])
    turn = np.array(
        [[np.cos(roll_rad), -np.sin(roll_rad), 0], [np.sin(roll_rad), np.cos(roll_rad), 0], [0, 0, 1]]
    )
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turn @ R, [0, 0, distance_m]
    return T


def directions(n):
    """Spread evenly over the sphere (Fibonacci's spiral)."""
    k = np.arange(n)
    z, a = 1 - (2 * k + 1) / n, np.pi * (3 - np.sqrt(5)) * k
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(a), r * np.sin(a), z], axis=1)


def ball_depth(camera, T_cam_obj, radius_m=BALL_M, wall_m=WALL_M):
    """Depth (m) and mask of a ball about the object's origin; wall_m 0: nothing behind it."""
    v, u = np.mgrid[: camera.height, : camera.width]
    ray = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], axis=-1)
    c = T_cam_obj[:3, 3]
    b, rr = ray @ c, (ray**2).sum(axis=-1)
    root = b * b - rr * (c @ c - radius_m**2)
    hit = root > 0
    depth = np.where(hit, (b - np.sqrt(np.maximum(root, 0))) / rr, wall_m)
    return depth.astype(np.float32), hit.astype(np.uint8)


def lattice(shape, voxel_m, origin):
    """(nz, ny, nx, 3) voxel centres in object coordinates."""
    z, y, x = np.meshgrid(*(np.arange(n) for n in shape), indexing="ij")
    return np.asarray(origin) + voxel_m * np.stack([x, y, z], axis=-1)


def reconstruction(shape, voxel_m, origin, prior=None, threads=1, **options):
    if "printed" in options:
        options["evidence"] = "printed" if options.pop("printed") else "smooth"
    if "max_weight" in options:
        options["memory"] = options.pop("max_weight")
    o = _core.ReconstructionOptions(**options)
    return _core.Reconstruction(list(shape[::-1]), voxel_m, list(origin), prior, o, threads)


def fuse(core, camera, T_cam_obj, depth, mask):
    core.fuse(depth, camera._core, T_cam_obj, [0, 0, camera.width, camera.height], mask)


def zero_crossings(phi, voxel_m, origin):
    """Points (N, 3) where phi, linear between neighbours, is 0."""
    points = lattice(phi.shape, voxel_m, origin)
    out = []
    for axis in range(3):
        a, b = (np.moveaxis(phi, axis, 0)[s] for s in (slice(None, -1), slice(1, None)))
        p, q = (np.moveaxis(points, axis, 0)[s] for s in (slice(None, -1), slice(1, None)))
        turned = (a < 0) != (b < 0)
        t = (a[turned] / (a[turned] - b[turned]))[:, None]
        out.append(p[turned] * (1 - t) + q[turned] * t)
    return np.concatenate(out)


def slope_error(phi, voxel_m, band_voxels=4):
    """Mean of | |grad phi| - 1 | within the band."""
    slope = np.linalg.norm(np.gradient(phi.astype(np.float64), voxel_m), axis=0)
    return float(np.abs(slope - 1)[np.abs(phi) < band_voxels * voxel_m].mean())
