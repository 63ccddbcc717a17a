# SPDX-License-Identifier: MIT
"""Objects with a state: trackers, reconstructors, contours, memories, LWPR, primitives, planes, energies."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from fuzz_arrays import ONE_THREAD, POSE, made
from fuzz_targets import Target, finite
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
    return lambda *given: use(make(), *given)


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

    def moved(t: st.Tracker, k: Any, T: Any, C: Any, d: Any) -> Any:
        t.set_pose(k, T, C)
        return t.track(seen(d, c))

    def added(t: st.Tracker, T: Any, k: Any, d: Any) -> Any:
        t.add(box, T)
        result = t.track(seen(d, c))
        t.remove(k)
        return result

    ways = {
        "track": (lambda t, *frame: t.track(seen(*frame)), d, c, 0.1),
        "array": (lambda t, d, c: t.track(d, c), d, c),
        "poses": (lambda t, d, T, U: t.start(seen(d, c), poses=[T, U]), d, POSE, second),
        "masks": (lambda t, d, m: t.start(seen(d, c), masks=[m, depth() < 1]), d, d < 1),
        "boxes": (lambda t, d, b: t.start(seen(d, c), boxes=[b, (1, 1, 9, 9)]), d, place),
        "clicks": (lambda t, d, at: t.start(seen(d, c), clicks=[at, at]), d, (33.0, 26.0)),
        "search": (lambda t, d: t.start(seen(d, c)), d),
        "recover": (lambda t, d, k, b: t.recover(seen(d, c), k, box=b), d, 0, place),
        "set_pose": (moved, 0, POSE, 1e-6 * np.eye(6), d),
        "add": (added, POSE, 1, d),
    }
    return {name: Call(on_new(running, use), *given, check=finite) for name, (use, *given) in ways.items()}


def _reconstructors() -> dict[str, Call]:
    d, c = depth(), color()

    def new(**options: Any) -> st.Reconstructor:
        return st.Reconstructor(CAMERA, voxels=24, threads=1, **options)

    def first(start: Callable[..., Any]) -> Callable[..., Any]:
        def use(d: Any, place: Any, later: Any) -> Any:
            star = new()
            start(star, seen(d, c), place)
            result = star.track(seen(later, c))
            star.mesh(), star.quality(), star.tracker()
            return result

        return use

    def made_otherwise(camera: Any, voxels: Any, extent: Any) -> Any:
        star = st.Reconstructor(camera, voxels=voxels, extent=extent, threads=1)
        return star.start(seen(d, c), mask=d < 1)

    def at_pose(T: Any) -> Any:
        return new(initial=st.SDF.box(BOX, voxels=24)).start(seen(d, c), pose=T)

    def resumed(later: Any, mask: Any) -> Any:
        star = new()
        star.start(seen(d, c), mask=d < 1)
        return star.resume(seen(later, c), mask)

    return {
        "mask": Call(
            first(lambda star, frame, mask: star.start(frame, mask=mask)), d, d < 1, d, check=finite
        ),
        "box": Call(
            first(lambda star, frame, box: star.start(frame, box=box)), d, (20.0, 14.0, 28.0, 25.0), d
        ),
        "options": Call(made_otherwise, CAMERAS, 24, 0.3, check=finite),
        "pose": Call(at_pose, POSE, check=finite),
        "resume": Call(resumed, d, d < 1, check=finite),
    }


def _contours() -> dict[str, Call]:
    y, x = np.mgrid[:48, :64]
    image = np.where((np.hypot(x - 30, y - 24) < 12)[..., None], [200, 40, 30], [30, 60, 90]).astype(np.uint8)
    image += np.random.default_rng(0).integers(0, 20, image.shape, np.uint8)
    mask = np.hypot(x - 30, y - 24) < 12
    c = st.contour
    coefficients = c.harmonics(mask, 4, size=24)

    def followed(warp: Any, first: Any, mask: Any, box: Any, later: Any) -> None:
        tracker = c.ContourTracker(warp)
        tracker.start(first, mask=mask, box=box)
        tracker.track(later)
        tracker.track(image)

    def remembered(n: Any, size: Any, capacity: Any, use: Any, mask: Any) -> None:
        kept = c.ShapeMemory(n_harmonics=n, size=size, capacity=capacity)
        for a in range(3):
            kept.learn(np.hypot((x - 30) * (1 + 0.1 * a), y - 24) < 12)
        getattr(kept, use, kept.judge)(mask)
        kept.assess(mask)

    warps, uses = OneOf(("similarity", "affine")), OneOf(("learn", "assess", "observe", "judge", "recover"))
    return {
        "mask": Call(followed, warps, image, mask, Fixed(None), image),
        "box": Call(followed, warps, image, Fixed(None), (16.0, 10.0, 28.0, 28.0), image),
        "memory": Call(remembered, 4, 24, 8, uses, mask),
        "align": Call(c.align, mask, 24, 0.35),
        "harmonics": Call(c.harmonics, mask, 4, OneOf(("max", "sum")), 24),
        "distances": Call(c.signed_distances, mask),
        "silhouette": Call(c.silhouette, coefficients, 24, level_set=False),
        "outline": Call(c.draw_outline, image, mask, OneOf(("ok", "weak", "lost"))),
    }


def _lwpr() -> dict[str, Call]:
    r = np.random.default_rng(0)
    x, y = r.random((40, 2)), r.random((40, 1))
    trained = st.LWPR(init_D=50.0, threads=1).fit(x, y)

    def made_anew(x: Any, y: Any, asked: Any, init_D: Any, w_gen: Any, w_prune: Any, init_alpha: Any) -> Any:
        model = st.LWPR(init_D=init_D, w_gen=w_gen, w_prune=w_prune, init_alpha=init_alpha, threads=1)
        model.fit(x, y)
        model.update(x, y)
        return model.predict(asked, confidence=True), model.activations(asked), model.fields

    def predict(asked: Any) -> Any:
        return trained.predict(asked, return_std=True), trained.activations(asked), trained.score(asked, y)

    return {
        "anew": Call(made_anew, x, y, x[:5], 50.0, 0.2, 0.95, 50.0),
        "metric": Call(made_anew, x, y, x[:5], np.array([50.0, 20.0]), 0.2, 0.95, 50.0),
        "predict": Call(predict, x),
        "update": Call(lambda x, y: trained.copy().partial_fit(x, y), x, y),
    }


def _primitives() -> dict[str, Call]:
    points = np.asarray(st.SDF.cylinder(0.04, 0.1, voxels=20).surface_samples(300)[0], np.float64)

    def frame(d: Any, kind: Any, mask: Any) -> Any:
        return st.fit_primitive(st.Frame(d, check_units=False), kind, camera=CAMERA, mask=mask, threads=1)

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

    def remove(d: Any, camera: Any, start: Any, tolerance: Any, method: Any, noise: Any) -> Any:
        return st.remove_plane(
            st.Frame(d, check_units=False), camera, start, tolerance, method=method, noise=noise, threads=1
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

    def energy(d: Any, T: Any, scale: Any, delta: Any) -> Any:
        e = st.Energy(box, CAMERA, st.Frame(d, check_units=False), T, scale_m=scale)
        x = st.State(np.asarray(T, np.float64).reshape(-1, 4, 4))
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
