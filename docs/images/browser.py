# SPDX-License-Identifier: MIT
"""Makes browser_result.png and browser_live.png beside this file: python docs/images/browser.py (needs Chromium)."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from playwright.sync_api import sync_playwright

import sdftrack as st
from sdftrack.viz.viewer import Viewer

HERE = Path(__file__).parent
GL = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
MAX_BYTES = 150_000


def save(page: Any, path: Path) -> None:
    """A picture of the page with a palette of 256 colours, without the notice that this browser draws in software."""
    page.wait_for_timeout(2500)
    notice = page.locator(".mantine-Notification-closeButton")
    if notice.count():
        notice.first.click()
    page.wait_for_timeout(1000)
    from PIL import Image

    image = cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR)
    for colors in (256, 128, 64, 32):
        Image.fromarray(image[..., ::-1]).quantize(colors).save(path, optimize=True)
        if path.stat().st_size < MAX_BYTES:
            return


def opened(viewer: Viewer, page: Any) -> None:
    page.goto(viewer.url)
    while not viewer.pages:
        page.wait_for_timeout(50)


def main() -> None:
    camera = st.Camera(420.0, 420.0, 319.5, 239.5, 640, 480)
    mesh = st.synth.duck_mesh()
    sequence = st.synth.sequence(mesh, 60, noise=0.001, clutter="objects", seed=4, camera=camera)
    shape = st.SDF.from_mesh(mesh, voxels=100)
    tracker = st.Tracker(shape, camera)
    results = [tracker.start(sequence[0], poses=[sequence.ground_truth[0][0]])]
    results += [tracker.track(sequence[i]) for i in range(1, len(sequence))]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=GL)
        page = browser.new_page(viewport={"width": 1200, "height": 620})
        with st.view(sequence, results, shape, names=["duck"], port=0) as viewer:
            opened(viewer, page)
            page.wait_for_timeout(1000)
            playback = viewer._at_close[0].__self__  # type: ignore[attr-defined]
            for i in range(41):
                playback.go_to(i)
                page.wait_for_timeout(30)
            playback._slider.value = 40
            save(page, HERE / "browser_result.png")
        with Viewer(shape, camera, ["duck"], port=0) as viewer:
            opened(viewer, page)
            viewer.show(sequence[0], results[0])
            page.wait_for_timeout(1000)
            (client,) = viewer._server.viser.get_clients().values()
            x, y, z = results[30].poses[0][:3, 3]
            client.camera.position = (x - 0.35, y - 0.25, z - 0.55)
            client.camera.look_at = (x - 0.05, y, z)
            for i in range(len(sequence)):
                viewer.show(sequence[i], results[i], latency_s=0.021, dropped=0)
                time.sleep(1 / 30)
            save(page, HERE / "browser_live.png")
        browser.close()


if __name__ == "__main__":
    main()
