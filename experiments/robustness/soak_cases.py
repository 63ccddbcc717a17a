# SPDX-License-Identifier: MIT
"""The long runs: every class that keeps something from one call to the next, and what one step of it is."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

import sdftrack as st
from experiments.robustness.soak_scene import CAMERA, FRAMES, box, following, frames, poses, there_and_back
from experiments.synth.blob import BlobVideo, blob_video
from experiments.synth.functions import cross_data

Step = Callable[[int], Any]  # what is called with 0, 1, 2, ...
PLACES = (-0.14, 0.0, 0.14)  # of three objects, m
SMALL = 0.7  # of the size of the one object
GONE = 29  # every so many frames show the wall alone
STAY = 20  # steps from an object that is added to the next one; it stays for half of them
SAMPLES = 500  # of the function that is learned

CASES: dict[str, Callable[[ExitStack], Step]] = {}


def case(name: str) -> Callable[[Callable[[ExitStack], Step]], Callable[[ExitStack], Step]]:
    def register(function: Callable[[ExitStack], Step]) -> Callable[[ExitStack], Step]:
        CASES[name] = function
        return function

    return register


def tracker_of(mode: str, places: tuple[float, ...] = (0.0,), scale: float = 1.0, **options: Any) -> Any:
    seen = frames(places, scale)
    tracker = st.Tracker([box(scale)] * len(places), CAMERA, mode=mode, threads=1, **options)
    tracker.start(seen[0], poses=[poses(place)[0] for place in places])
    return tracker, seen


@case("Tracker, depth")
def _depth(stack: ExitStack) -> Step:
    return following(*tracker_of("depth"))


@case("Tracker, depth, four threads")
def _threads(stack: ExitStack) -> Step:
    seen = frames()
    tracker = st.Tracker(box(), CAMERA, mode="depth", threads=4)
    tracker.start(seen[0], poses=[poses()[0]])
    return following(tracker, seen)


@case("Tracker, depth and colour")
def _rgbd(stack: ExitStack) -> Step:
    return following(*tracker_of("rgbd"))


@case("Tracker, colour")
def _rgb(stack: ExitStack) -> Step:
    return following(*tracker_of("rgb"))


@case("Tracker, three objects, depth and colour, membership")
def _several(stack: ExitStack) -> Step:
    return following(*tracker_of("rgbd", PLACES, SMALL, membership=True))


@case("Tracker, lost and found")
def _lost(stack: ExitStack) -> Step:
    tracker, seen = tracker_of("depth")
    wall = st.Frame(np.full(CAMERA.shape, 1.2, np.float32))
    return lambda k: tracker.track(seen[there_and_back(k)] if k % GONE else wall)


@case("Tracker, objects that come and go")
def _come_and_go(stack: ExitStack) -> Step:
    tracker, seen = tracker_of("depth", PLACES[1:], SMALL)
    shape = box(SMALL)

    def step(k: int) -> Any:
        if k % STAY == STAY // 2:
            tracker.remove(2)
        elif k % STAY == 0:
            own = st.SDF(shape.values, shape.voxel_size, shape.origin)
            tracker.add(own, pose=poses(PLACES[0])[there_and_back(k)])
        return tracker.track(seen[there_and_back(k)])

    return step


@case("Tracker, poses set from outside")
def _set_pose(stack: ExitStack) -> Step:
    tracker, seen = tracker_of("depth")

    def step(k: int) -> Any:
        i = there_and_back(k)
        tracker.set_pose(0, poses()[i])
        return tracker.track(seen[i])

    return step


@case("Reconstructor")
def _reconstructor(stack: ExitStack) -> Step:
    seen = frames()
    mask = box().render(CAMERA, poses()[0])[0] > 0
    star = st.Reconstructor(CAMERA, voxels=32, threads=1)
    star.start(seen[0], mask=mask)
    return following(star, seen)


def video() -> BlobVideo:
    return blob_video(frames=FRAMES, size=(64, 48))


@case("ContourTracker")
def _contour(stack: ExitStack) -> Step:
    blob = video()
    tracker = st.contour.ContourTracker()
    tracker.start(blob.images[0], mask=blob.masks[0])
    return lambda k: tracker.track(blob.images[there_and_back(k)])


@case("ContourTracker with a memory")
def _contour_memory(stack: ExitStack) -> Step:
    blob = video()
    tracker = st.contour.ContourTracker(memory=st.contour.ShapeMemory(size=32))
    tracker.start(blob.images[0], mask=blob.masks[0])
    return lambda k: tracker.track(blob.images[there_and_back(k)])


@case("ShapeMemory, of silhouettes")
def _remembered(stack: ExitStack) -> Step:
    return _memory(st.contour.ShapeMemory(size=32))


@case("ShapeMemory, by regression")
def _printed(stack: ExitStack) -> Step:
    return _memory(st.contour.ShapeMemory(size=32, rule="printed"))


def _memory(memory: Any) -> Step:
    masks = [st.contour.align(mask, 32)[0] for mask in video().masks]
    for mask in masks:
        memory.learn(mask)
    return lambda k: memory.observe(masks[there_and_back(k)])


@case("LWPR")
def _lwpr(stack: ExitStack) -> Step:
    x, y = cross_data(0, SAMPLES)
    model = st.LWPR(threads=1)

    def step(k: int) -> Any:
        i = k % SAMPLES
        model.update(x[i : i + 1], y[i : i + 1])
        return model.predict(x[i : i + 1])

    return step


@case("superpixels.Video")
def _superpixels(stack: ExitStack) -> Step:
    images = video().images
    cut = st.superpixels.Video(n_segments=30, threads=2)
    return lambda k: cut.next(images[there_and_back(k)])


@case("LiveMotion")
def _motion(stack: ExitStack) -> Step:
    live = st.motion.LiveMotion()
    return lambda k: live.add(k / 30, (0.3 * np.sin(k / 20), 0.0, 0.8))


def _results() -> tuple[list[st.Frame], list[Any]]:
    tracker, seen = tracker_of("depth")
    return seen, [tracker.track(frame) for frame in seen]


@case("Recorder without video")
def _recorder(stack: ExitStack) -> Step:
    seen, results = _results()
    folder = stack.enter_context(tempfile.TemporaryDirectory())
    recorder = stack.enter_context(st.Recorder(Path(folder) / "out", CAMERA, box(), video=False, live=True))

    def step(k: int) -> Any:
        i = there_and_back(k)
        recorder.add(seen[i].replace(index=k, timestamp=k / 30), results[i])

    return step


@case("LiveCamera of a replay")
def _camera(stack: ExitStack) -> Step:
    from sdftrack.live import LiveCamera
    from sdftrack.live.replay import Replay

    recording = st.Sequence(frames(), CAMERA, poses(), {})
    camera = stack.enter_context(LiveCamera(Replay(recording, float("inf"), loop=True)))
    return lambda k: camera.next()


@case("Viewer without a page")
def _viewer(stack: ExitStack) -> Step:
    from sdftrack.viz.viewer import Viewer

    seen, results = _results()
    viewer = stack.enter_context(Viewer(box(), CAMERA, ["box"], port=0))
    return lambda k: viewer.show(seen[there_and_back(k)], results[there_and_back(k)])


@case("stream ws:// without a client")
def _websocket(stack: ExitStack) -> Step:
    return _stream(stack, "ws://localhost:0")


@case("stream osc://")
def _osc(stack: ExitStack) -> Step:
    return _stream(stack, "osc://localhost:9")


def _stream(stack: ExitStack, address: str) -> Step:
    from sdftrack.live.streams import open_stream

    seen, results = _results()
    stream = stack.enter_context(open_stream(address, ["box"], CAMERA))
    return lambda k: stream.send(seen[there_and_back(k)], results[there_and_back(k)])
