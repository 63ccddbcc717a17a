# SPDX-License-Identifier: MIT
"""Objects with a state: trackers, reconstructors, contours, memories, LWPR, primitives, planes, energies."""

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
from fuzz_arrays import ONE_THREAD, POSE, made
from fuzz_targets import Target
from fuzz_values import Call, Fixed, OneOf

import sdftrack as st

BOX = (0.12, 0.09, 0.06)
CAMERA = st.Camera(60.0, 61.0, 31.5, 23.5, 64, 48)
CAMERAS = OneOf((CAMERA, st.RGBDCamera(CAMERA)))
H, W = CAMERA.shape


def depth() -> np.ndarray:
    seen = st.SDF.box(BOX, voxels=16).render(CAMERA, POSE, 1)[0]
    return np.where(seen > 0, seen, 1.2).astype(np.float32)


def color() -> np.ndarray:
    return np.random.default_rng(0).integers(0, 256, (H, W, 3), np.uint8)


def on_new(make: Callable[[], Any], use: Callable[..., Any]) -> Callable[..., Any]:
    """A use of an object that is made anew each time: the outcome of a seed must not depend on those before."""

    def called(*given: Any) -> Any:
        return use(make(), *given)

    called.__signature__ = inspect.Signature(list(inspect.signature(use).parameters.values())[1:])
    return called


def seen(d: Any, c: Any = None, timestamp: Any = None) -> st.Frame:
    return st.Frame(d, c, timestamp, check_units=False)


def _trackers() -> dict[str, Call]:
    box = st.SDF.box(BOX, voxels=14)
    d, c, second = depth(), color(), st.geometry.pose([0, 0, 0], [0.1, 0, 0.5])
    place, whole = (20.0, 14.0, 28.0, 25.0), st.Frame(depth(), color())

    def running() -> st.Tracker:
        tracker = st.Tracker([box, box], CAMERA, mode="rgbd", threads=1)
        tracker.start(whole, poses=[POSE, second])
        return tracker

    def set_pose(t: st.Tracker, k: Any, T: Any, covariance: Any, depth: Any) -> Any:
        t.set_pose(k, T, covariance)
        return t.track(seen(depth, c))

    def add(t: st.Tracker, pose: Any, k: Any, depth: Any) -> Any:
        t.add(box, pose)
        result = t.track(seen(depth, c))
        t.remove(k)
        return result

    ways = {
        "track": (lambda t, depth, color, timestamp: t.track(seen(depth, color, timestamp)), d, c, 0.1),
        "array": (lambda t, depth, color: t.track(depth, color), d, c),
        "poses": (lambda t, depth, poses: t.start(seen(depth, c), poses=[poses, second]), d, POSE),
        "masks": (lambda t, depth, masks: t.start(seen(depth, c), masks=[masks, d < 1]), d, d < 1),
        "boxes": (lambda t, depth, boxes: t.start(seen(depth, c), boxes=[boxes, (1, 1, 9, 9)]), d, place),
        "clicks": (
            lambda t, depth, clicks: t.start(seen(depth, c), clicks=[clicks, clicks]),
            d,
            (33.0, 26.0),
        ),
        "search": (lambda t, depth: t.start(seen(depth, c)), d),
        "recover": (lambda t, depth, k, box: t.recover(seen(depth, c), k, box=box), d, 0, place),
        "set_pose": (set_pose, 0, POSE, 1e-6 * np.eye(6), d),
        "add": (add, POSE, 1, d),
    }
    return {name: Call(on_new(running, use), *given) for name, (use, *given) in ways.items()}


def _reconstructors() -> dict[str, Call]:
    d, c = depth(), color()

    def new(**options: Any) -> st.Reconstructor:
        return st.Reconstructor(CAMERA, voxels=24, threads=1, **options)

    def followed(star: st.Reconstructor, depth: Any, **place: Any) -> Any:
        star.start(seen(d, c), **place)
        result = star.track(seen(depth, c))
        star.mesh(), star.quality(), star.tracker()
        return result

    def at_pose(pose: Any) -> Any:
        return new(initial=st.SDF.box(BOX, voxels=24)).start(seen(d, c), pose=pose)

    def made_otherwise(camera: Any, voxels: Any, extent: Any) -> Any:
        star = st.Reconstructor(camera, voxels=voxels, extent=extent, threads=1)
        return star.start(seen(d, c), mask=d < 1)

    def resumed(depth: Any, mask: Any) -> Any:
        star = new()
        star.start(seen(d, c), mask=d < 1)
        return star.resume(seen(depth, c), mask)

    return {
        "mask": Call(lambda mask, depth: followed(new(), depth, mask=mask), d < 1, d),
        "box": Call(lambda box, depth: followed(new(), depth, box=box), (20.0, 14.0, 28.0, 25.0), d),
        "pose": Call(at_pose, POSE),
        "options": Call(made_otherwise, CAMERAS, 24, 0.3),
        "resume": Call(resumed, d, d < 1),
    }


def _contours() -> dict[str, Call]:
    y, x = np.mgrid[:48, :64]
    picture = np.where((np.hypot(x - 30, y - 24) < 12)[..., None], [200, 40, 30], [30, 60, 90]).astype(
        np.uint8
    )
    picture += np.random.default_rng(0).integers(0, 20, picture.shape, np.uint8)
    silhouette = np.hypot(x - 30, y - 24) < 12
    c = st.contour
    coefficients = c.harmonics(silhouette, 4, size=24)

    def started(warp: Any, image: Any, mask: Any, box: Any) -> None:
        tracker = c.ContourTracker(warp)
        tracker.start(image, mask=mask, box=box)
        tracker.track(picture)

    def tracked(image: Any) -> None:
        tracker = c.ContourTracker()
        tracker.start(picture, mask=silhouette)
        tracker.track(image)
        tracker.track(picture)

    def remembered(n_harmonics: Any, size: Any, capacity: Any, use: Any, mask: Any) -> None:
        kept = c.ShapeMemory(n_harmonics=n_harmonics, size=size, capacity=capacity)
        for a in range(3):
            kept.learn(np.hypot((x - 30) * (1 + 0.1 * a), y - 24) < 12)
        getattr(kept, use, kept.judge)(mask)
        kept.assess(mask)

    warps, uses = OneOf(("similarity", "affine")), OneOf(("learn", "assess", "observe", "judge", "recover"))
    return {
        "mask": Call(started, warps, picture, silhouette, Fixed(None)),
        "box": Call(started, warps, picture, Fixed(None), (16.0, 10.0, 28.0, 28.0)),
        "track": Call(tracked, picture),
        "memory": Call(remembered, 4, 24, 8, uses, silhouette),
        "align": Call(c.align, silhouette, 24, 0.35),
        "harmonics": Call(c.harmonics, silhouette, 4, OneOf(("max", "sum")), 24),
        "distances": Call(c.signed_distances, silhouette),
        "silhouette": Call(c.silhouette, coefficients, 24, level_set=False),
        "outline": Call(c.draw_outline, picture, silhouette, OneOf(("ok", "weak", "lost"))),
    }


def _lwpr() -> dict[str, Call]:
    r = np.random.default_rng(0)
    samples, values = r.random((40, 2)), r.random((40, 1))
    trained = st.LWPR(init_D=50.0, threads=1).fit(samples, values)

    def made_anew(x: Any, y: Any, init_D: Any, w_gen: Any, w_prune: Any, init_alpha: Any) -> Any:
        model = st.LWPR(init_D=init_D, w_gen=w_gen, w_prune=w_prune, init_alpha=init_alpha, threads=1)
        model.fit(x, y)
        model.update(x, y)
        return model.predict(samples[:5], confidence=True), model.activations(samples[:5]), model.fields

    def predict(x: Any) -> Any:
        return trained.predict(x, return_std=True), trained.activations(x), trained.score(x, values)

    return {
        "anew": Call(made_anew, samples, values, 50.0, 0.2, 0.95, 50.0),
        "metric": Call(made_anew, samples, values, np.array([50.0, 20.0]), 0.2, 0.95, 50.0),
        "predict": Call(predict, samples),
        "update": Call(lambda x, y: trained.copy().partial_fit(x, y), samples, values),
    }


def _primitives() -> dict[str, Call]:
    points = np.asarray(st.SDF.cylinder(0.04, 0.1, voxels=20).surface_samples(300)[0], np.float64)

    def frame(depth: Any, kind: Any, mask: Any) -> Any:
        return st.fit_primitive(st.Frame(depth, check_units=False), kind, camera=CAMERA, mask=mask, threads=1)

    kinds = OneOf(("sphere", "cylinder", "box", "cone", "ellipsoid"))
    return {
        "points": Call(
            st.fit_primitive, points, kinds, seed=0, scaling=OneOf(("exact", "printed")), threads=ONE_THREAD
        ),
        "frame": Call(frame, depth(), kinds, depth() < 1),
        "primitive": Call(st.Primitive, kinds, voxels=20, seed=0),
    }


def _planes() -> dict[str, Call]:
    d = depth()

    def remove(depth: Any, camera: Any, start_px: Any, tolerance: Any, method: Any, noise: Any) -> Any:
        return st.remove_plane(
            st.Frame(depth, check_units=False),
            camera,
            start_px,
            tolerance,
            method=method,
            noise=noise,
            threads=1,
        )

    sensor = st.SensorModel.preset("kinect_v1")
    return {
        "remove": Call(
            remove,
            d,
            CAMERAS,
            (4.0, 4.0),
            0.01,
            OneOf(("rigid", "bent", "printed")),
            OneOf((None, 0.002, "measure")),
        ),
        "bias": Call(sensor.bias, d, 0.1),
        "noise": Call(sensor.noise, d, 0.1),
        "corrected": Call(sensor.corrected, d),
        "systematic": Call(sensor.systematic, d),
        "frame": Call(
            st.Frame,
            d,
            color(),
            0.1,
            depth_scale=None,
            color_order=OneOf(("rgb", "bgr")),
            mask=d < 1,
            camera=CAMERAS,
            index=0,
        ),
        "integers": Call(st.Frame, (1000 * d).astype(np.uint16), depth_scale=0.001),
    }


def _energies() -> dict[str, Call]:
    box = st.SDF.box(BOX, voxels=14)

    def energy(depth: Any, poses: Any, scale_m: Any, delta: Any) -> Any:
        e = st.Energy(box, CAMERA, st.Frame(depth, check_units=False), poses, scale_m=scale_m)
        x = st.State(np.asarray(poses, np.float64).reshape(-1, 4, 4))
        e.cost(x), e.linearize(x), e.residuals(x)
        e.cost(e.moved(x, delta))
        return st.minimize(e, x)

    return {"energy": Call(energy, depth(), POSE, 0.002, np.zeros(6))}


TARGETS = (
    Target("tracker", made(_trackers), weight=0.4),
    Target("reconstructor", made(_reconstructors), weight=0.15),
    Target("contour", made(_contours), weight=1.5),
    Target("lwpr", made(_lwpr), weight=1.5),
    Target("primitives", made(_primitives), weight=0.3),
    Target("planes", made(_planes), weight=1.5),
    Target("energies", made(_energies)),
)
