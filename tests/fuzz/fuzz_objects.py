# SPDX-License-Identifier: MIT
"""Objects with a state: trackers, reconstructors, contours, memories, LWPR, primitives, planes, energies."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_arrays import ONE_THREAD, POSE, made
from fuzz_targets import Case, Target, any_of, finite
from fuzz_values import Call, OneOf, nasty, nasty_array

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


def readings(rng: random.Random) -> Any:
    """Depth images with tiny, huge and odd readings, most of them valid."""
    d = depth()
    if rng.random() < 0.5:
        for _ in range(rng.choice((1, 1, 3, 40))):
            d[rng.randrange(H), rng.randrange(W)] = rng.choice(
                (1e-38, 1e-12, 1e-9, 9e-9, 3e-7, 1e-4, 50.0, 1e9, 3e38, -1.0, np.inf, np.nan, 5e-45)
            )
        if rng.random() < 0.3:
            d[0, 0] = rng.choice((1e-12, 9e-9, 3e-7))
        return d
    return nasty_array(rng, d)


def _frame(rng: random.Random) -> st.Frame:
    c = color() if rng.random() < 0.7 else nasty(rng, color())
    stamp = rng.choice((None, None, 0.0, 1.0, 1e18, -1.0)) if rng.random() < 0.95 else np.nan
    return st.Frame(readings(rng), c, stamp, check_units=rng.random() < 0.3)


def _pose(rng: random.Random) -> Any:
    if rng.random() < 0.5:
        return POSE
    T = POSE.copy()
    T[:3, 3] *= rng.choice((1.0, 0.0, -1.0, 1e-9, 1e3, 1e15, 1e155, 1e300))
    T[rng.randrange(3), 3] = rng.choice((0.0, 1e-300, 1.0, 1e155, -1e300, np.nan, np.inf))
    return T if rng.random() < 0.7 else nasty_array(rng, T)


def _trackers(folder: Path) -> Case:
    box = st.SDF.box(BOX, voxels=14)

    def fresh() -> st.Tracker:
        tracker = st.Tracker([box, st.SDF.sphere(0.03, voxels=10)], CAMERA, mode="rgbd", threads=1)
        tracker.start(st.Frame(depth(), color()), poses=[POSE, st.geometry.pose([0, 0, 0], [0.1, 0, 0.5])])
        return tracker

    ways = {
        "track": lambda t, r: t.track(_frame(r)),
        "array": lambda t, r: t.track(readings(r), nasty(r, color())),
        "start": lambda t, r: t.start(_frame(r), poses=[_pose(r), _pose(r)]),
        "masks": lambda t, r: t.start(_frame(r), masks=[nasty(r, depth() < 1), None]),
        "boxes": lambda t, r: t.start(_frame(r), boxes=[nasty(r, (4.0, 4.0, 20.0, 16.0)), (1, 1, 9, 9)]),
        "clicks": lambda t, r: t.start(_frame(r), clicks=[nasty(r, (16.0, 12.0)), (3, 3)]),
        "search": lambda t, r: t.start(_frame(r)),
        "recover": lambda t, r: t.recover(_frame(r), nasty(r, 0), box=nasty(r, (4.0, 4.0, 20.0, 16.0))),
        "set_pose": lambda t, r: (
            t.set_pose(nasty(r, 0), _pose(r), nasty(r, 1e-6 * np.eye(6))),
            t.track(_frame(r)),
        )[1],
        "set_only": lambda t, r: (t.set_pose(0, _pose(r)), t.track(_frame(r)))[1],
        "add": lambda t, r: (t.add(box, _pose(r)), t.track(_frame(r)), t.remove(nasty(r, 1)))[1],
    }

    def case(rng: random.Random) -> None:
        # A new one each time: the outcome of a seed must not depend on those before.
        tracker = fresh()
        for _ in range(rng.choice((1, 1, 2))):
            finite(ways[rng.choice(list(ways))](tracker, rng))

    return case


def _reconstructors(folder: Path) -> Case:
    box = st.SDF.box(BOX, voxels=24)

    def case(rng: random.Random) -> None:
        star = st.Reconstructor(
            rng.choice((CAMERA, nasty(rng, CAMERA))) if rng.random() < 0.1 else CAMERA,
            voxels=24 if rng.random() < 0.9 else nasty(rng, 24),
            threads=1,
            extent=None if rng.random() < 0.7 else nasty(rng, 0.3),
        )
        if rng.random() < 0.4:
            frame, mask = _frame(rng), nasty(rng, depth() < 1)
        else:
            frame, mask = st.Frame(depth(), color()), depth() < 1
        way = rng.randrange(4)
        if way == 0:
            star = st.Reconstructor(CAMERA, initial=box, threads=1)
            finite(star.start(frame, pose=_pose(rng)))
        elif way == 1:
            finite(star.start(frame, box=nasty(rng, (4.0, 4.0, 20.0, 16.0))))
        else:
            finite(star.start(frame, mask=mask))
        finite(star.track(_frame(rng)))
        rng.choice(
            (
                lambda: star.shape,
                star.mesh,
                star.quality,
                star.tracker,
                lambda: star.resume(_frame(rng), mask),
            )
        )()

    return case


def _contours(folder: Path) -> Case:
    y, x = np.mgrid[:48, :64]
    image = np.where((np.hypot(x - 30, y - 24) < 12)[..., None], [200, 40, 30], [30, 60, 90]).astype(np.uint8)
    image += np.random.default_rng(0).integers(0, 20, image.shape, np.uint8)
    mask = np.hypot(x - 30, y - 24) < 12

    def case(rng: random.Random) -> None:
        tracker = st.contour.ContourTracker(rng.choice(("similarity", "affine")))
        if rng.random() < 0.5:
            tracker.start(nasty(rng, image) if rng.random() < 0.3 else image, mask=nasty(rng, mask))
        else:
            tracker.start(image, box=nasty(rng, (16.0, 10.0, 28.0, 28.0)))
        tracker.track(nasty(rng, image))
        tracker.track(image)

    c = st.contour
    coefficients = c.harmonics(mask, 4, size=24)
    calls = {
        "align": Call(c.align, mask, 24, 0.35),
        "harmonics": Call(c.harmonics, mask, 4, OneOf(("max", "sum")), 24),
        "distances": Call(c.signed_distances, mask),
        "silhouette": Call(c.silhouette, coefficients, 24, level_set=False),
        "outline": Call(c.draw_outline, image, mask, OneOf(("ok", "weak", "lost"))),
    }

    def memory(rng: random.Random) -> None:
        kept = c.ShapeMemory(
            n_harmonics=4 if rng.random() < 0.8 else nasty(rng, 4),
            size=24 if rng.random() < 0.8 else nasty(rng, 24),
            capacity=8 if rng.random() < 0.9 else nasty(rng, 8),
        )
        for a in range(3):
            kept.learn(np.hypot((x - 30) * (1 + 0.1 * a), y - 24) < 12)
        rng.choice((kept.learn, kept.assess, kept.observe, kept.judge, kept.recover))(nasty(rng, mask))
        kept.assess(mask)

    return any_of([case, *calls.values(), *calls.values(), memory])


def _lwpr(folder: Path) -> Case:
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

    def update(x: Any, y: Any) -> Any:
        return trained.copy().partial_fit(x, y)

    return any_of(
        [
            Call(made_anew, x, y, x[:5], 50.0, 0.2, 0.95, 50.0),
            Call(made_anew, x, y, x[:5], np.array([50.0, 20.0]), 0.2, 0.95, 50.0),
            Call(predict, x),
            Call(update, x, y),
        ]
    )


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
    Target("tracker", _trackers, weight=0.4),
    Target("reconstructor", _reconstructors, weight=0.15),
    Target("contour", _contours, weight=1.5),
    Target("lwpr", _lwpr, weight=1.5),
    Target("primitives", made(_primitives), weight=0.3),
    Target("planes", made(_planes), weight=1.5),
    Target("energies", made(_energies)),
)
