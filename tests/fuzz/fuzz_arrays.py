# SPDX-License-Identifier: MIT
"""Public functions of arrays and numbers."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_targets import Case, Target, any_of
from fuzz_values import Call, Few, Fixed, OneOf

import sdftrack as st

CAMERA = st.Camera(30.0, 30.5, 15.5, 11.5, 32, 24)
LENS = st.Camera(30.0, 30.5, 15.5, 11.5, 32, 24, (0.1, -0.05, 0.001, 0.002, 0.01))
POSE = st.geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.4])
CAMERAS = OneOf((CAMERA, LENS, st.RGBDCamera(CAMERA)))
ONE_THREAD = Fixed(1)


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def ball() -> st.SDF:
    return st.SDF.sphere(0.05, voxels=14)


def depth() -> np.ndarray:
    seen = st.SDF.box([0.12, 0.09, 0.06], voxels=16).render(CAMERA, POSE, 1)[0]
    return np.where(seen > 0, seen, 1.2).astype(np.float32)


def color(shape: tuple[int, int] = (24, 32)) -> np.ndarray:
    return rng().integers(0, 256, (*shape, 3), np.uint8)


def made(calls: Callable[[], dict[str, Call]]) -> Callable[[Path], Case]:
    def make(folder: Path) -> Case:
        return any_of(calls())

    return make


def _geometry() -> dict[str, Call]:
    g, v = st.geometry, np.array([0.1, 0.2, 0.3])
    points = rng().normal(size=(5, 3))
    return {
        "rigid": Call(g.rigid, POSE),
        "pose": Call(g.pose, v, v),
        "exp": Call(g.exp, np.concatenate([v, v])),
        "log": Call(g.log, POSE),
        "inverse": Call(g.inverse, np.stack([POSE, POSE])),
        "look_at": Call(g.look_at, v, 2 * v + 0.3, np.array([0.0, 0, 1])),
        "points": Call(g.transform_points, POSE, points),
        "camera": Call(st.Camera, 30.0, 30.0, 15.0, 11.0, 32, 24, np.array([0.1, -0.05, 0.001, 0.002])),
        "from_K": Call(st.Camera.from_K, CAMERA.K, 32, 24),
        "from_fov": Call(st.Camera.from_fov, 1.0, 32, 24),
        "scaled": Call(CAMERA.scaled, 0.5),
        "cropped": Call(CAMERA.cropped, 2, 3, 10, 8),
        "project": Call(LENS.project, points + np.array([0, 0, 3])),
        "back": Call(LENS.back_project, depth()),
        "rgbd": Call(st.RGBDCamera, Fixed(CAMERA), Fixed(LENS), T_color_depth=POSE),
        "projective": Call(st.RGBDCamera, Fixed(CAMERA), Fixed(LENS), projective=(np.eye(3), np.zeros(3))),
        "symmetry": Call(st.Symmetry, np.diag([-1.0, -1, 1, 1])[None], [(v, v)]),
        "canonical": Call(st.Symmetry(np.diag([-1.0, -1, 1, 1])[None]).canonical, POSE, POSE),
        "back_project": Call(st.back_project, depth(), CAMERAS, depth() < 1),
    }


def _mesh() -> dict[str, Call]:
    b = ball().to_mesh()
    colors = rng().integers(0, 256, (len(b.vertices), 3), np.uint8)

    def cast(vertices: Any, faces: Any, colors: Any, T: Any) -> Any:
        return st.Mesh(vertices, faces, colors).raycast(CAMERA, T, 1)

    def volume(vertices: Any, faces: Any, voxels: Any, padding: Any, holes: Any) -> Any:
        return st.SDF.from_mesh((vertices, faces), voxels, padding, holes=holes, threads=1)

    vertices, faces = np.asarray(b.vertices), np.asarray(b.faces)
    return {
        "cast": Call(cast, vertices, faces, colors, POSE),
        "from_mesh": Call(volume, vertices, faces, OneOf((16, 24)), 0.1, OneOf(("error", "close"))),
        "transformed": Call(b.transformed, POSE),
        "decimated": Call(b.decimated, 40),
        "mesh": Call(st.Mesh, vertices, faces, colors, seen=np.ones(len(vertices), bool)),
    }


def _sdf() -> dict[str, Call]:
    b = ball()
    values = np.asarray(b.values)
    colors = np.full((*values.shape, 4), 200, np.uint8)
    points = 0.1 * rng().normal(size=(20, 3))
    mesh = b.to_mesh()
    painted = st.Mesh(mesh.vertices, mesh.faces, np.full((len(mesh.vertices), 3), 90, np.uint8))

    def used(values: Any, voxel_size: Any, origin: Any, colors: Any, T: Any) -> Any:
        sdf = st.SDF(values, voxel_size, origin, colors)
        sdf.render(CAMERA, T, 1)
        sdf.surface_samples(30)
        return sdf.redistanced(1)

    def whole(values: Any, voxel_size: Any, origin: Any) -> Any:
        sdf = st.SDF(values, voxel_size, origin)
        sdf.to_mesh()
        return sdf.cropped(2)

    return {
        "used": Call(used, values, b.voxel_size, np.asarray(b.origin), colors, POSE),
        "whole": Call(whole, values, b.voxel_size, np.asarray(b.origin)),
        "call": Call(b, points),
        "gradient": Call(b.gradient, points),
        "render": Call(b.render, CAMERAS, POSE, ONE_THREAD),
        "silhouette": Call(b.silhouette, CAMERAS, POSE, ONE_THREAD),
        "transformed": Call(b.transformed, POSE),
        "cropped": Call(b.cropped, 3),
        "samples": Call(b.surface_samples, 100),
        "colored": Call(b.colored, Fixed(painted), unit=OneOf((None, "mm")), threads=ONE_THREAD),
        "box": Call(st.SDF.box, np.array([0.1, 0.2, 0.1]), voxels=16, padding=0.1),
        "sphere": Call(st.SDF.sphere, 0.1, voxels=16, padding=0.1),
        "cylinder": Call(st.SDF.cylinder, 0.1, 0.2, voxels=16, padding=0.1),
        "cone": Call(st.SDF.cone, 0.1, 0.2, voxels=16, padding=0.1),
        "ellipsoid": Call(st.SDF.ellipsoid, np.array([0.1, 0.2, 0.1]), voxels=16, padding=0.1),
        "smooth_union": Call(st.smooth_union, Fixed(b), Fixed(b.transformed(POSE)), radius=0.01),
        "symmetries": Call(st.find_symmetries, Fixed(b), 1.5),
    }


def _levelset() -> dict[str, Call]:
    values = np.asarray(ball().values)
    ratio = rng().normal(size=values.shape).astype(np.float32)

    def evidence(depth: Any, T_cam_obj: Any, voxel_size: Any, origin: Any, mask: Any, sigma_d_m: Any) -> Any:
        frame, grid = st.Frame(depth, check_units=False), ((10, 11, 12), voxel_size, origin)
        return st.levelset.evidence(frame, CAMERA, T_cam_obj, grid, sigma_d_m=sigma_d_m, mask=mask, threads=1)

    size = ball().voxel_size
    return {
        "redistance": Call(st.levelset.redistance, values, size, threads=ONE_THREAD),
        "evolve": Call(
            st.levelset.evolve, values, ratio, Few(3), size, regulariser=OneOf(("double_well", "printed")), sigma_h=4.0,
            sigma_phi=3.0, dt=1.0, redistance_every=5, threads=ONE_THREAD,
        ),
        "evidence": Call(
            evidence, depth(), POSE, 0.01, np.full(3, -0.05), depth() < 1, 0.003
        ),
    }  # fmt: skip


def _superpixels() -> dict[str, Call]:
    s, picture = st.superpixels, color()
    labels = np.asarray(s.slic(picture, 12))

    def video(image: Any, n_segments: Any) -> Any:
        v = s.Video(n_segments)
        v.next(picture)
        return v.next(image)

    return {
        "slic": Call(
            s.slic, picture, 12, 10.0, Few(3), color_space=OneOf(("lab", "xyz", "rgb")), start_label=1,
            mask=OneOf((None, depth() < 1)), enforce_connectivity=True,
        ),
        "regions": Call(s.regions, labels, picture),
        "adjacency": Call(s.adjacency, labels),
        "boundaries": Call(s.boundaries, labels),
        "mark": Call(s.mark_boundaries, picture, labels, (255, 0, 0)),
        "mean": Call(s.mean_colors, picture, labels),
        "video": Call(video, picture, 12),
        "achievable": Call(st.metrics.achievable_accuracy, labels, labels),
        "recall": Call(st.metrics.boundary_recall, labels, labels, 2),
        "under": Call(st.metrics.undersegmentation, labels, labels),
    }  # fmt: skip


def _metrics() -> dict[str, Call]:
    m, points = st.metrics, 0.1 * rng().normal(size=(30, 3))
    T = POSE @ st.geometry.pose([0.01, 0, 0], [0.001, 0, 0])
    errors = rng().random(9)
    return {
        "add": Call(m.add, T, POSE, points),
        "adds": Call(m.adds, T, POSE, points),
        "mssd": Call(m.mssd, T, POSE, points),
        "mspd": Call(m.mspd, T, POSE, points, Fixed(CAMERA)),
        "pose_error": Call(m.pose_error, T, POSE),
        "auc": Call(m.auc, errors, 0.5),
        "recall": Call(m.average_recall, np.tile(errors, (2, 1)), errors, errors, 0.2, 640),
        "iou": Call(m.iou, depth() < 1, depth() < 1.1),
        "vsd": Call(m.vsd, depth(), depth(), depth() + 0.001, CAMERAS, 0.02, 0.015),
        "chamfer": Call(m.chamfer, points, points + 0.01, 100, 0),
    }


def _motion() -> dict[str, Call]:
    m, n = st.motion, 40
    times = np.arange(n) / 30
    T = np.array(
        [st.geometry.pose([0, 0, 0.1 * i], [0.2 * np.sin(6 * t), 0, 0.8]) for i, t in enumerate(times)]
    )
    C = np.tile(1e-6 * np.eye(6), (n, 1, 1))
    given = m.Trajectory(times, T, C)

    def trajectory(times: Any, poses: Any, covariances: Any) -> Any:
        return m.smooth(m.Trajectory(times, poses, covariances), samples=4)

    def live(times: Any, points: Any) -> Any:
        one = m.LiveMotion()
        return [one.add(t, p) for t, p in zip(times, points, strict=False)][-1:]

    return {
        "smooth": Call(trajectory, times, T, C),
        "analyze": Call(
            m.analyze,
            Fixed(given),
            cues_s=np.array([0.1]),
            up=np.array([0, 0, 1.0]),
            axis_obj=np.array([0, 0, 1.0]),
        ),
        "at_point": Call(m.at_point, Fixed(given), np.zeros(3)),
        "butterworth": Call(m.butterworth, Fixed(given), 6.0, 2),
        "savgol": Call(m.savitzky_golay, Fixed(given), 0.3, 4),
        "resample": Call(m.resample, Fixed(given), 60.0, max_gap_s=0.3),
        "dtw": Call(m.dtw_distance, T[:, :3, 3], T[:, :3, 3], 0.15),
        "jerk": Call(m.log_dimensionless_jerk, T[None, :, :3, 3], 30.0),
        "sparc": Call(m.sparc, np.abs(np.sin(times))[None], 30.0),
        "table": Call(m.table_frame, np.array([0, 0, 1.0]), 0.5),
        "in_frame": Call(m.in_frame, Fixed(given), POSE, "table"),
        "tremor": Call(m.tremor_of, Fixed(given), 0.1, 1.2, noise_m=0.001),
        "target": Call(m.parse_target, OneOf(("box:0,0,0,1,1,1", "sphere:0,0,0,0.1", "x"))),
        "live": Call(live, times, T[:, :3, 3]),
    }


TARGETS = (
    Target("geometry", made(_geometry), weight=2),
    Target("mesh", made(_mesh), weight=0.4),
    Target("sdf", made(_sdf)),
    Target("levelset", made(_levelset)),
    Target("superpixels", made(_superpixels), weight=1.2),
    Target("metrics", made(_metrics), weight=1.5),
    Target("motion", made(_motion), weight=0.25),
)
