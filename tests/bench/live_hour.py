# SPDX-License-Identifier: MIT
"""Memory of a long live run: an hour at 30 Hz (108,000 frames) at full speed, pages opened and closed 100 times.

    python tests/bench/live_hour.py [--frames 108000] [--pages 100]

Everything of `sdftrack live` runs: camera thread, tracker, page, streams, recorder without video. Prints the resident
memory after a warm-up and at the end.
"""

from __future__ import annotations

import argparse
import gc
import os
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

import sdftrack as st
from sdftrack.cli.live_files import LiveFiles
from sdftrack.cli.live_followers import TrackerFollower
from sdftrack.cli.live_run import Live
from sdftrack.cli.targets import Target
from sdftrack.live import LiveCamera
from sdftrack.live.replay import Replay
from sdftrack.live.streams import open_stream
from sdftrack.synth.duck import duck_mesh
from sdftrack.viz.viewer import Viewer

CAMERA = st.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
WARM_UP = 4000  # frames, and
WARM_UP_PAGES = 10  # the first page loads what draws


def memory_mb() -> float:
    """Resident memory of this process."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def there_and_back(count: int) -> Any:
    """A sequence that can be looped: back and forth."""
    duck = duck_mesh()
    walk = st.synth.random_walk(step_m=0.002, step_rad=0.01)
    seq = st.synth.sequence(duck, count, walk, 0.001, seed=2, camera=CAMERA, clutter="wall")
    order = [*range(count), *range(count - 2, 0, -1)]
    frames = list(seq)
    poses = np.stack([seq.ground_truth[i][0] for i in order])
    return st.Sequence([frames[i] for i in order], CAMERA, poses, {1: duck})


class Endless:
    """The frames of a looped camera, `count` of them."""

    def __init__(self, live: LiveCamera, count: int) -> None:
        self._live, self._count = live, count

    def __getattr__(self, name: str) -> Any:
        return getattr(self._live, name)

    def __iter__(self) -> Any:
        return (frame for frame, _ in zip(self._live, range(self._count), strict=False))


def look(viewer: Viewer, pages: int, done: threading.Event, seen: list[float]) -> None:
    """Open and close the page many times in Chromium."""
    import shutil

    from playwright.sync_api import sync_playwright

    opened = drawn = 0
    arguments = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=arguments)
        while not done.is_set() and opened < pages:
            page = chromium.new_page(viewport={"width": 640, "height": 480})
            page.goto(viewer.url)
            end = time.monotonic() + 20
            while not viewer.pages and time.monotonic() < end:
                page.wait_for_timeout(50)
            page.wait_for_timeout(300)
            drawn += viewer.pages > 0
            page.close()
            opened += 1
            if opened % WARM_UP_PAGES == 0:
                seen.append(memory_mb())
                print(f"{opened} pages: {seen[-1]:.1f} MB", flush=True)
        chromium.close()
    print(f"pages opened and closed: {opened}, of which {drawn} were served", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=108_000)
    parser.add_argument("--pages", type=int, default=100)
    given = parser.parse_args()
    seq = there_and_back(60)
    sdf = st.SDF.from_mesh(seq.models[1], voxels=80)
    target = Target("duck", Path("duck.ply"), seq.models[1], sdf, 1, 0)
    with tempfile.TemporaryDirectory() as folder:
        out, seen = Path(folder), list[float]()
        camera = LiveCamera(Replay(seq, float("inf"), loop=True))
        tracker = st.Tracker(sdf, camera.camera, names=["duck"])
        follower = TrackerFollower(tracker, [target], None)
        with (
            camera,
            Viewer(sdf, camera.camera, ["duck"], port=0) as viewer,
            open_stream("ws://localhost:0", ["duck"], camera.camera) as stream,
            open_stream("osc://localhost:9", ["duck"], camera.camera) as osc,
        ):
            recorder = lambda: st.Recorder(out / "r", camera.camera, sdf, False, live=True)  # noqa: E731
            files = LiveFiles(out, camera.camera)
            run = Live(Endless(camera, given.frames), follower, viewer, [stream, osc], recorder, files, True)
            follower.box(seq[0], 0, (100, 60, 120, 120))
            done = threading.Event()
            pages = threading.Thread(target=look, args=(viewer, given.pages, done, seen))
            step, began = run.step, time.monotonic()

            def counted(frame: Any) -> Any:
                result = step(frame)
                n = run.statistics.frames
                if n == WARM_UP:
                    pages.start()
                if n in (WARM_UP, 2 * WARM_UP) or n % 20_000 == 0:
                    print(f"{n} frames, {time.monotonic() - began:.0f} s: {memory_mb():.1f} MB", flush=True)
                return result

            run.step = counted  # type: ignore[method-assign]
            run.run()
            done.set()
            pages.join()
            final = memory_mb()
            print(run.statistics.line(time.monotonic() - began, camera))
        threads = [t.name for t in threading.enumerate()]
        first = seen[0] if seen else float("nan")
        print(f"growth after {WARM_UP_PAGES} pages: {final - first:.1f} MB; threads at the end: {threads}")


if __name__ == "__main__":
    main()
