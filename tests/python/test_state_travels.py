# SPDX-License-Identifier: MIT
"""A copy, a pickle and a file of a tracker continue with the bits of the tracker that goes on."""

import copy
import pickle
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import pytest
from contour_scenes import disc_mask, painted
from tracking_scene import SIZE_M, box_mesh

import sdftrack as st
from sdftrack import _core

CAMERA = st.Camera(fx=130, fy=130, cx=79.5, cy=59.5, width=160, height=120)
BOX = st.SDF.box(SIZE_M, voxels=32)
CAN = st.SDF.cylinder(0.033, 0.1, voxels=40)
BEFORE, AFTER = 8, 20
HIDDEN = (3, 5)  # of those after: nothing but the wall


def pose(i: int, side: float = 0.0) -> Any:
    return st.geometry.pose([0.5 + 0.01 * i, -0.6, 0.2], [0.01 + side + 0.001 * i, 0.02, 0.5])


def frame(i: int, sides: tuple[float, ...] = (0.0,), shape: Any = None, hidden: bool = True) -> st.Frame:
    """Boxes (or `shape`) before a wall, with noise in depth and colour."""
    rng = np.random.default_rng(i)
    depth = np.full(CAMERA.shape, 0.9)
    color = rng.integers(60, 110, (*CAMERA.shape, 3))
    gone = hidden and HIDDEN[0] <= i - BEFORE < HIDDEN[1]
    for k, side in enumerate(() if gone else sides):
        T = pose(i, side)
        seen = (box_mesh() if shape is None else shape.to_mesh()).raycast(CAMERA, T)[0]
        on = (seen > 0) & (seen < depth)
        depth[on] = seen[on]
        color[on] = np.array([200, 60 + 60 * k, 40]) + rng.integers(-25, 25, (int(on.sum()), 3))
    noisy = (depth + rng.normal(0, 0.001, depth.shape)).astype(np.float32)
    return st.Frame(noisy, color.astype(np.uint8), timestamp=i / 30)


def mask_of(at: st.Frame) -> Any:
    return at.depth < 0.75


class Kind(NamedTuple):
    """A tracker, how it starts, and what it sees."""

    make: Callable[[], Any]
    place: Callable[[st.Frame], dict[str, Any]]
    frame: Callable[[int], st.Frame] = frame
    then: Callable[[Any], object] = lambda tracker: None  # before it travels


def at_pose(_: st.Frame) -> dict[str, Any]:
    return {"poses": [pose(0)]}


def without_depth(i: int) -> st.Frame:
    return st.Frame(None, frame(i, hidden=False).color, timestamp=i / 30)


def two(i: int) -> st.Frame:
    return frame(i, (-0.09, 0.09))


def add_one(tracker: Any) -> None:
    tracker.add(BOX, mask=np.arange(160 * 120).reshape(120, 160) % 160 > 90)
    tracker.set_pose(0, pose(BEFORE), np.diag([1e-4] * 6))


def other_camera(i: int) -> st.Frame:
    given = frame(i)
    moved = st.Camera(fx=131, fy=131, cx=79.5, cy=59.5, width=160, height=120)
    return st.Frame(given.depth, given.color, camera=moved, timestamp=given.timestamp)


def tracker(shapes: Any = BOX, mode: str = "auto", **options: Any) -> Callable[[], Any]:
    return lambda: st.Tracker(shapes, CAMERA, mode, device="cpu", threads=1, **options)


KINDS = {
    "depth": Kind(tracker(mode="depth"), at_pose),
    "colour": Kind(tracker(mode="rgbd"), at_pose),
    "outline": Kind(tracker(mode="rgbd", outline=True), at_pose),
    "rgb": Kind(tracker(mode="rgb"), at_pose, without_depth),
    "mask": Kind(tracker(), lambda at: {"masks": [mask_of(at)]}),
    "click": Kind(tracker(), lambda at: {"clicks": [(83, 64)]}),
    "sensor": Kind(tracker(sensor="kinect_v1", motion="constant_velocity"), at_pose),
    "free scale": Kind(tracker(scale="free"), at_pose),
    "several": Kind(tracker([BOX, BOX]), lambda _: {"poses": [pose(0, -0.09), pose(0, 0.09)]}, two),
    "added": Kind(tracker(mode="depth"), at_pose, then=add_one),
    "symmetric": Kind(
        tracker(CAN, symmetry=st.Symmetry(continuous=(([0, 0, 1], [0, 0, 0]),))),
        at_pose,
        lambda i: frame(i, shape=CAN),
    ),
    "primitive": Kind(
        tracker([st.Primitive("cylinder", voxels=32)]),
        lambda at: {"masks": [mask_of(at)]},
        lambda i: frame(i, shape=CAN),
    ),
    "another camera": Kind(tracker(), at_pose, other_camera),
    "not started": Kind(tracker(), at_pose),
}


def by_file(one: Any) -> Any:
    with TemporaryDirectory() as folder:
        one.save(Path(folder) / "one")
        return type(one).load(Path(folder) / "one")


WAYS: dict[str, Callable[[Any], Any]] = {
    "copy": copy.copy, "deepcopy": copy.deepcopy, "pickle": lambda one: pickle.loads(pickle.dumps(one)),
    "file": by_file,
}  # fmt: skip
FIELDS = (
    "poses", "covariances", "confidence", "twists", "inliers", "runner_up", "systematic", "unstated", "energy", "index",
    "status", "reason", "sensor",
)  # fmt: skip
CONTOUR_FIELDS = ("mask", "warp", "phi", "status", "reason", "confidence", "judgement", "evidence")


def bits(result: Any, fields: tuple[str, ...]) -> list[Any]:
    values = [getattr(result, name) for name in fields]
    return [value.tobytes() if isinstance(value, np.ndarray) else repr(value) for value in values]


@lru_cache(maxsize=1)
def travelled(name: str) -> tuple[list[list[Any]], dict[str, Any]]:
    """What the tracker says that goes on, and the copies that were made before."""
    kind = KINDS[name]
    one = kind.make()
    started = name != "not started"
    if started:
        one.start(kind.frame(0), **kind.place(kind.frame(0)))
        for i in range(1, BEFORE):
            one.track(kind.frame(i))
    kind.then(one)
    copies = {way: make(one) for way, make in WAYS.items()}
    return goes_on(one, kind, started), copies


def goes_on(one: Any, kind: Kind, started: bool) -> list[list[Any]]:
    first = [] if started else [one.start(kind.frame(0), **kind.place(kind.frame(0)))]
    results = first + [one.track(kind.frame(i)) for i in range(BEFORE, BEFORE + AFTER)]
    return [[*bits(result, FIELDS), *one.mode_used, repr(one.sizes), repr(one.scales)] for result in results]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", KINDS)
def test_a_tracker_that_travels_continues_with_the_same_bits(name: str, way: str) -> None:
    original, copies = travelled(name)
    again = goes_on(copies[way], KINDS[name], name != "not started")
    for i, (expected, got) in enumerate(zip(original, again, strict=True)):
        assert got == expected, f"frame {i} after the copy"


# -- contours
IMAGES = [painted(disc_mask(50 + 2 * i, 60, 22 + 3 * np.sin(0.4 * i)), 12, seed=i) for i in range(30)]
FAR = [painted(disc_mask(300, 300, 10), 12, seed=90 + i) for i in range(3)]  # lost
VIDEO = IMAGES[1:15] + FAR + IMAGES[15:]


def contour(memory: bool, **options: Any) -> Any:
    known = st.contour.ShapeMemory(capacity=32) if memory else None
    out = st.contour.ContourTracker(memory=known, burn_in=5, **options)
    out.start(IMAGES[0], mask=disc_mask(50, 60, 22))
    for image in VIDEO[:BEFORE]:
        out.track(image)
    return out


@pytest.mark.parametrize("way", ["copy", "deepcopy", "pickle"])
@pytest.mark.parametrize(
    "options",
    [{"memory": False}, {"memory": True}, {"memory": False, "warp": "affine", "confidence": "colors"}],
    ids=["plain", "memory", "affine"],
)
def test_a_contour_that_travels_continues_with_the_same_bits(options: dict[str, Any], way: str) -> None:
    one = contour(**options)
    other = WAYS[way](one)
    assert other.options == one.options
    results = [bits(one.track(image), CONTOUR_FIELDS) for image in VIDEO[BEFORE:]]
    assert len(results) >= AFTER
    assert [bits(other.track(image), CONTOUR_FIELDS) for image in VIDEO[BEFORE:]] == results


# -- states that no tracker wrote
def cores() -> dict[str, tuple[Any, Any]]:
    """Of each kind, one with a state and one to read it."""
    given = KINDS["several"]
    one, fresh = given.make(), given.make()
    one.start(given.frame(0), **given.place(given.frame(0)))
    one.track(given.frame(1))
    return {
        "tracker": (one._core, fresh._core),
        "contour": (contour(False)._core, st.contour.ContourTracker()._core),
    }


@pytest.mark.parametrize("name", ["tracker", "contour"])
def test_a_damaged_state_is_one_error_and_one_of_another_version_is_not_read(name: str) -> None:
    one, fresh = cores()[name]
    whole = one.state()
    assert fresh.set_state(whole)
    assert fresh.state() == whole
    assert not fresh.set_state(bytes(8) + whole[8:])
    rng = np.random.default_rng(0)
    for cut in [4, 8, 9, *rng.integers(10, len(whole), 20).tolist()]:
        with pytest.raises(ValueError, match="state: expected"):
            fresh.set_state(whole[:cut])
    with pytest.raises(ValueError, match="state: expected"):
        fresh.set_state(whole + b"1")
    refused = 0
    for _ in range(300):
        damaged = bytearray(whole)
        at = int(rng.integers(8, len(whole) - 8))
        damaged[at : at + 8] = rng.choice(
            [b"\xff" * 8, b"\x7f" * 8, bytes(8), bytes(rng.integers(0, 256, 8, np.uint8))]
        )
        try:
            fresh.set_state(bytes(damaged))
        except ValueError:
            refused += 1
    assert refused > 0


def test_a_state_with_more_objects_is_refused() -> None:
    given = KINDS["several"]
    state = given.make()._core.state()
    alone = KINDS["depth"].make()._core
    assert isinstance(alone, _core.Tracker)
    with pytest.raises(ValueError, match="state: expected"):
        alone.set_state(state)
