# SPDX-License-Identifier: MIT
"""Functions and classes of the private core. Those that are given addresses (of a GPU, of DLPack) are left out."""

from __future__ import annotations

from typing import Any

import numpy as np
from fuzz_arrays import CAMERA, POSE, ball, color, depth, made, rng
from fuzz_targets import Target
from fuzz_values import Call, Few, Fixed, OneOf

import sdftrack as st
from sdftrack import _core

CORE_CAMERA = OneOf((CAMERA._core, _core.Camera(16, 16, 8, 6, 32, 24)))
THREADS = Fixed(1)
ORIGIN = [-0.05, -0.05, -0.05]
OBJ_CAM = st.geometry.inverse(POSE)
KINDS = OneOf(
    (
        _core.PrimitiveKind.sphere,
        _core.PrimitiveKind.cylinder,
        _core.PrimitiveKind.box,
        _core.PrimitiveKind.cone,
        _core.PrimitiveKind.ellipsoid,
    )
)
SIZES = OneOf(([0.05], [0.05, 0.1], [0.1, 0.05, 0.07]))


def _volumes() -> dict[str, Call]:
    b = ball()
    mesh = b.to_mesh()
    v, f, values = np.asarray(mesh.vertices), np.asarray(mesh.faces), np.asarray(b.values)
    args, points = (values, b.voxel_size, ORIGIN), 0.1 * rng().normal(size=(9, 3))
    known = (np.abs(values) < 0.01).astype(np.uint8)
    shape = [12, 13, 14]
    return {
        "clean": Call(_core.clean_mesh, v, f, 0.02),
        "to_sdf": Call(_core.mesh_to_sdf, v, f, shape, 0.01, ORIGIN, 6.0, THREADS),
        "open": Call(_core.open_mesh_to_sdf, v, f, shape, 0.01, ORIGIN, 6.0, THREADS),
        "winding": Call(_core.winding_numbers, v, f, shape, 0.01, ORIGIN, THREADS),
        "paint": Call(_core.paint, v, f, np.full((len(v), 3), 9, np.uint8), *args, 0.02, THREADS),
        "sweep": Call(_core.fast_sweep, known, values, 0.01),
        "redistance": Call(_core.redistance, values, 0.01, THREADS),
        "evolve": Call(_core.evolve, values, values, 0.01, Few(2), Fixed(_core.EvolveOptions()), THREADS),
        "render": Call(_core.render_sdf, *args, CORE_CAMERA, POSE, THREADS),
        "sample": Call(_core.sample_sdf, *args, points, THREADS),
        "samples": Call(_core.surface_samples, *args, Few(30)),
        "primitive": Call(
            _core.primitive_sdf, OneOf(("box", "cone", "sphere")), SIZES, shape, 0.01, ORIGIN, THREADS
        ),
        "caster": Call(lambda v, f, p: _core.MeshCaster(v, f).closest(p), v, f, points),
        "cast": Call(
            lambda v, f, c, T: _core.MeshCaster(v, f).raycast(c, T, None, 1), v, f, CORE_CAMERA, POSE
        ),
    }


def _small() -> dict[str, Call]:
    v3 = [0.1, 0.2, 0.3]
    flat = rng().normal(size=40).astype(np.float32)
    model = _core.LwprModel(2, 1, _core.LwprOptions(), [1.0, 1.0], [1.0])
    return {
        "rigid": Call(_core.nearest_rigid, POSE, "T"),
        "exp": Call(_core.rotation_exp, v3),
        "mrp": Call(_core.rotation_from_mrp, v3),
        "log": Call(_core.rotation_log, POSE),
        "seed": Call(_core.seed_rotation, 3, 60),
        "camera": Call(_core.Camera, 16.0, 16.0, 8.0, 6.0, 32, 24, [0.1, 0.2, 0.001, 0.002]),
        "rays": Call(
            lambda *a: _core.Camera(*a).rays(),
            16.0,
            16.0,
            8.0,
            6.0,
            Few(32),
            Few(24),
            [0.1, 0.2, 0.001, 0.002],
        ),
        "project": Call(CAMERA._core.project, rng().normal(size=(7, 3))),
        "map": Call(
            lambda P, q, w, h, u, v, d: _core.ColorMap.projective(P, q, w, h).find(u, v, d),
            np.eye(3),
            np.zeros(3),
            32,
            24,
            3.0,
            4.0,
            1.0,
        ),
        "rigid_map": Call(
            lambda a, b, T, u, v, d: _core.ColorMap.rigid(a, b, T).find(u, v, d),
            CORE_CAMERA,
            CORE_CAMERA,
            np.eye(4),
            3.0,
            4.0,
            1.0,
        ),
        "correlation": Call(_core.correlation_area, flat, flat, flat, 0.01, 0.1),
        "add": Call(_core.scale_and_add, 2.0, flat, flat),
        "offset": Call(_core.outline_offset, np.full(25, 0.5, np.float32), 8),
        "distances": Call(_core.primitive_distances, KINDS, SIZES, rng().normal(size=(7, 3))),
        "reach": Call(_core.primitive_reach, KINDS, SIZES, v3),
        "clearance": Call(_core.primitive_clearance, KINDS, SIZES, OBJ_CAM, [0.0, 0.0, 1.0], 0.1, 2.0),
        "threads": Call(_core.thread_count, Few(2)),
        "model": Call(
            lambda a, b, r, s: _core.ColorModel(0.7).update(a, b, r, s),
            np.ones(4096, np.float32),
            np.ones(4096, np.float32),
            0.05,
            0.3,
        ),
        "lwpr": Call(_core.LwprModel.from_bytes, model.to_bytes()),
    }


def _images() -> dict[str, Call]:
    d, c, b = depth(), color(), ball()
    mask, counts = (d < 1).astype(np.uint8), np.ones(4096, np.float32)
    aligned = _core.ColorMap.aligned(32, 24)
    shape = (np.asarray(b.values), b.voxel_size, ORIGIN)
    phi = np.where(mask, -1, 1).astype(np.float32)
    warp = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    options = _core.contour_options()
    view = _core.PrimitiveView.of_points(np.asarray(b.surface_samples(50)[0], np.float64))
    return {
        "counts": Call(_core.color_counts, *shape, CORE_CAMERA, d, None, c, Fixed(aligned), POSE, 0.02, 1000),
        "colors": Call(_core.colors_at, d, c, Fixed(aligned), [1, 1, 9, 9]),
        "plane": Call(
            _core.fit_plane, d, CORE_CAMERA, None, mask, [0.0, 0.0, -1.0], 1.2, 0.01, [0.001, 0.0, 0.0], False
        ),
        "remove": Call(
            _core.remove_plane,
            d,
            CORE_CAMERA,
            None,
            2,
            3,
            0.01,
            OneOf(("rigid", "bent")),
            [0.001, 0.0, 0.0],
            False,
            False,
            THREADS,
        ),
        "smooth": Call(
            _core.smooth_foreground,
            np.arange(8, dtype=np.int32),
            np.ones(8, np.float32),
            np.full(8, 0.5, np.float32),
            32,
            30.0,
            0.001,
        ),
        "lines": Call(
            _core.outline_lines,
            shape,
            CORE_CAMERA,
            d,
            c,
            Fixed(aligned),
            (counts, counts),
            POSE,
            Few(20),
            Few(8),
        ),
        "view": Call(
            lambda d, l, cam, r: _core.PrimitiveView.of_image(d, l, cam, r).rays,
            d,
            mask.astype(np.uint8),
            CORE_CAMERA,
            Few(2),
        ),
        "energy": Call(view.energy, KINDS, OBJ_CAM, SIZES, Fixed(_core.PrimitiveEnergyOptions())),
        "contour_distance": Call(_core.contour_distance, phi, 4),
        "contour_steps": Call(
            _core.contour_steps, phi, np.full(phi.shape, 0.5, np.float32), Few(2), Fixed(options)
        ),
        "registration": Call(
            _core.contour_registration,
            phi,
            warp,
            np.zeros((2, 5), np.float32),
            np.full(5, 0.5, np.float32),
            1.0,
            True,
        ),
        "templates": Call(
            _core.contour_template_scores, np.ones((2, 9), np.float32), np.ones((3, 9), np.float32)
        ),
        "slic": Call(
            _core.slic, c, Fixed(_core.SlicOptions()), OneOf((None, mask)), OneOf((None, d)), THREADS, -1
        ),
    }


def _objects() -> dict[str, Call]:
    d, b = depth(), ball()
    shape = (np.asarray(b.values), b.voxel_size, ORIGIN)
    options = _core.TrackerOptions()
    region = [2, 2, 20, 16]

    def track(shape: Any, camera: Any, d: Any, T: Any, k: Any, motions: Any) -> Any:
        tracker = _core.Tracker(
            [shape], camera, options, 1, True, _core.MotionModel.adaptive, -1, _core.Collision.contact
        )
        tracker.set_pose(k, T, None)
        tracker.set_symmetries(k, motions)
        tracker.region(k, T, 0.01)
        return tracker.track(_core.TrackerFrame(d), ["a"])

    def judge(d: Any, k: Any, T: Any, region: Any, index: Any) -> Any:
        tracker = _core.Tracker(
            [shape],
            CAMERA._core,
            options,
            1,
            True,
            _core.MotionModel.adaptive,
            -1,
            _core.Collision.contact,
        )
        frame = _core.TrackerFrame(d)
        tracker.set_pose(0, POSE, None)
        tracker.judge(frame, k, T)
        tracker.look_at(frame, k, region)
        tracker.interrupt(index)
        tracker.mark_unfound(k, "start")
        return tracker.membership(frame)

    def rebuilt(
        voxels: Any, size: Any, origin: Any, d: Any, camera: Any, T: Any, region: Any, mask: Any
    ) -> Any:
        made = _core.Reconstruction(voxels, size, origin, None, _core.ReconstructionOptions(), 1)
        made.fuse(d, camera, T, region, mask)
        return made.phi, made.seen

    def grown(before: Any, after: Any) -> Any:
        return (
            _core.Reconstruction([12, 12, 12], 0.01, ORIGIN, None, _core.ReconstructionOptions(), 1)
            .grown(before, after)
            .phi
        )

    def search(shape: Any, d: Any, camera: Any, mask: Any, box: Any, seeds: Any) -> Any:
        return _core.Searcher(shape, options).search(d, camera, mask, box, seeds=seeds, threads=1)

    def first(camera: Any, T: Any, from_m: Any, planes: Any, middle: Any, radius: Any, points: Any) -> Any:
        return _core.FirstView(camera, T, from_m, planes, middle, radius).may_hold(points)

    def lwpr(n_in: Any, n_out: Any, a: Any, b: Any, x: Any, y: Any, output: Any) -> Any:
        model = _core.LwprModel(n_in, n_out, _core.LwprOptions(), a, b)
        model.update(x, y, 1)
        model.fields(output)
        return model.predict(x, True, 1), model.activations(x, 1)

    return {
        "track": Call(track, shape, CORE_CAMERA, d, POSE, 0, np.eye(4)[None]),
        "judge": Call(judge, d, 0, POSE, region, 0),
        "rebuilt": Call(rebuilt, [12, 12, 12], 0.01, ORIGIN, d, CORE_CAMERA, POSE, region, None),
        "grown": Call(grown, [1, 1, 1], [1, 1, 1]),
        "search": Call(
            search,
            shape,
            d,
            CORE_CAMERA,
            OneOf((None, (d < 1).astype(np.uint8))),
            OneOf((None, [2, 2, 20, 16])),
            Few(5),
        ),
        "first": Call(
            first, CORE_CAMERA, POSE, d, np.zeros((0, 5)), [0.0, 0.0, 0.0], 0.1, rng().normal(size=(5, 3))
        ),
        "lwpr": Call(lwpr, Few(2), Few(1), [1.0, 1.0], [1.0], rng().random((9, 2)), rng().random((9, 1)), 0),
    }


TARGETS = (
    Target("core_volumes", made(_volumes), private=True, weight=1.5),
    Target("core_small", made(_small), private=True, weight=2),
    Target("core_images", made(_images), private=True, weight=1.2),
    Target("core_objects", made(_objects), private=True, weight=0.6),
)
