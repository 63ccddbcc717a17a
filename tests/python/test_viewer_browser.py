# SPDX-License-Identifier: MIT
"""The viewer's page in a real browser: what it shows, and what clicks and drags become."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import cv2
import numpy as np
import pytest
from viewer_scene import CAMERA, scene, wait_until

import sdftrack as st
from sdftrack.contour.drawing import COLORS
from sdftrack.io.frames import read_mask
from sdftrack.viz.viewer import Box, Click, Pause, Record, Save, Viewer
from sdftrack.viz.viewer.drawing import object_rgb

pytest.importorskip("viser", reason="viser is not installed: pip install 'sdftrack[viewer]'")
sync_api = pytest.importorskip(
    "playwright.sync_api", reason="playwright is not installed: pip install playwright"
)
CHROMIUM = shutil.which("chromium")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt-get install chromium"),
]

SOFTWARE_GL = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
MARK_RGB = (255, 0, 255)  # a colour that is nowhere else in the page
# One pixel of the page is about 0.75 of the image; the mark's centre is found to less than that.
CLICK_PX = 3.0


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE_GL)
        yield started
        started.close()


@pytest.fixture
def page(browser):
    opened = browser.new_page(viewport={"width": 1280, "height": 720})
    yield opened
    opened.close()


def pixels(page):
    """The page as it is shown, (H, W, 3) RGB."""
    image = cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR)
    return image[..., ::-1]


def marked(frame, *places):
    """The frame with a square of the mark's colour about each pixel (x, y)."""
    color = np.array(frame.color)
    for x, y in places:
        color[y - 6 : y + 7, x - 6 : x + 7] = MARK_RGB
    return frame.replace(color=color)


def marks(page, count):
    """Centres (x, y) of the marks in the page, in pixels of the page, from left to right."""
    found = []

    def all_there():
        page.wait_for_timeout(100)  # the browser draws while it waits
        image = pixels(page).astype(int)
        seen = (image[..., 0] > 170) & (image[..., 1] < 90) & (image[..., 2] > 170)
        number, _, stats, centers = cv2.connectedComponentsWithStats(seen.astype(np.uint8))
        # The board is left of the cloud, and its squares are whole.
        big = [i for i in range(1, number) if stats[i, cv2.CC_STAT_AREA] > 60]
        found[:] = sorted(tuple(centers[i]) for i in big)[:count]
        return len(found) == count

    wait_until(all_there, 40)
    return found


def shown(viewer, page, frame, result):
    """Give the frame, and let the page draw it."""
    before = viewer._drawer.drawn
    viewer.show(frame, result)
    until(page, lambda: viewer._drawer.drawn > before or viewer._drawer.error)
    assert viewer._drawer.error is None


def until(page, true, seconds=40):
    """`wait_until` that lets the page's events come."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "waited in vain"
        page.wait_for_timeout(50)


def opened(viewer, page):
    page.goto(viewer.url)
    until(page, lambda: viewer.pages == 1)


def test_the_page_shows_the_image_and_the_model_in_its_colour(page):
    sequence, sdf, results = scene()
    with Viewer(sdf, CAMERA, ["duck"], port=0) as viewer:
        opened(viewer, page)
        shown(viewer, page, marked(sequence[0], (40, 200)), results[0])
        marks(page, 1)  # the image
        blue = np.array(object_rgb(0)) / np.linalg.norm(object_rgb(0))

        def model_there():
            image = pixels(page)[:, 400:940].astype(float)  # right of the board, left of the panel
            length = np.linalg.norm(image, axis=2)
            alike = (image @ blue > 0.97 * length) & (length > 120)
            return alike.sum() > 150

        until(page, model_there)
        assert "duck" in page.inner_text("body")
        assert "ok" in page.inner_text("body")


def test_clicks_and_drags_are_pixels_of_the_image_and_start_a_tracker(page):
    sequence, sdf, results = scene()
    center = CAMERA.project(results[0].pose[None, :3, 3])[0]
    places = ((40, 60), (200, 200))
    with Viewer(sdf, CAMERA, ["duck"], port=0) as viewer:
        opened(viewer, page)
        shown(viewer, page, marked(sequence[0], *places), results[0])
        (ax, ay), (bx, by) = marks(page, 2)
        page.wait_for_timeout(500)

        page.mouse.click(ax, ay)
        until(page, lambda: viewer._requests)
        (click,) = viewer.requests()
        assert isinstance(click, Click)
        assert click.k == 0
        np.testing.assert_allclose((click.x_px, click.y_px), places[0], atol=CLICK_PX)

        # The place of the object's centre in the page, from the two marks.
        scale = (np.subtract((bx, by), (ax, ay))) / np.subtract(places[1], places[0])
        page.mouse.click(*(np.array((ax, ay)) + scale * (center - places[0])))
        until(page, lambda: viewer._requests)
        (click,) = viewer.requests()
        np.testing.assert_allclose((click.x_px, click.y_px), center, atol=CLICK_PX)
        tracker = st.Tracker(sdf, CAMERA)
        started = tracker.start(sequence[0], clicks=[(round(click.x_px), round(click.y_px))])
        assert str(started.status[0]) in ("ok", "weak")
        metres, _ = st.metrics.pose_error(started.pose, sequence.ground_truth[0][0])
        assert metres < 0.02

        page.mouse.move(ax, ay)
        page.mouse.down()
        page.mouse.move((ax + bx) / 2, (ay + by) / 2, steps=5)
        page.mouse.move(bx, by, steps=5)
        page.wait_for_timeout(300)
        page.mouse.up()
        until(page, lambda: viewer._requests)
        (box,) = viewer.requests()
        assert isinstance(box, Box)
        np.testing.assert_allclose((box.x, box.y), places[0], atol=CLICK_PX)
        np.testing.assert_allclose((box.w, box.h), np.subtract(places[1], places[0]), atol=2 * CLICK_PX)

        # A click beside the image asks for nothing.
        page.mouse.click(ax, 20)
        page.wait_for_timeout(500)
        assert viewer.requests() == []


@pytest.mark.skipif(os.name != "posix", reason="Ctrl-C is sent as a signal")
def test_a_box_dragged_on_the_page_starts_an_outline(page, tmp_path):
    """The whole command: the image with the outline on the page, started and started again, files at the end."""
    sequence, sdf, _ = scene()
    silhouette = sdf.silhouette(CAMERA, sequence.ground_truth[0][0])
    rows, columns = np.flatnonzero(silhouette.any(axis=1)), np.flatnonzero(silhouette.any(axis=0))
    places = ((columns[0] - 8, rows[0] - 8), (columns[-1] + 8, rows[-1] + 8))
    still = marked(sequence[0], *places)
    st.save_sequence(
        tmp_path / "still", st.Sequence([still.replace(timestamp=i / 5) for i in range(300)], CAMERA)
    )
    arguments = ["live", "--camera", f"replay:{tmp_path / 'still'}", "--contour", "--port", "0"]
    child = subprocess.Popen(
        [sys.executable, "-m", "sdftrack", *arguments, "--out", str(tmp_path / "out")],
        stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        page.goto(next(line.split()[1] for line in child.stderr if line.startswith("open http")))
        until(page, lambda: "drag a box around the object" in page.inner_text("body"))
        (ax, ay), (bx, by) = marks(page, 2)
        page.wait_for_timeout(500)
        for _ in range(2):
            page.mouse.move(ax, ay)
            page.mouse.down()
            page.mouse.move(bx, by, steps=5)
            page.wait_for_timeout(300)
            page.mouse.up()
            until(page, lambda: "object: started" in page.inner_text("body"))
            until(page, lambda: "object: ok" in page.inner_text("body"))
        green = np.array(COLORS["ok"])
        until(page, lambda: (np.abs(pixels(page).astype(int) - green).max(axis=2) < 60).sum() > 50)
    finally:
        child.send_signal(signal.SIGINT)
        said = child.communicate(timeout=30)
    assert child.returncode == 0, said
    rows_written = json.loads((tmp_path / "out/result.json").read_text())["frames"]
    last = read_mask(tmp_path / f"out/mask/{rows_written[-1]['frame']:06d}.png")
    assert st.metrics.iou(last, silhouette) > 0.7


def test_switches_and_the_button_become_requests(page):
    sequence, sdf, results = scene()
    with Viewer(sdf, CAMERA, port=0) as viewer:
        opened(viewer, page)
        shown(viewer, page, sequence[0], results[0])
        for label, wanted in (("pause", Pause(True)), ("record", Record(True)), ("pause", Pause(False))):
            page.get_by_label(label, exact=True).click(force=True)
            until(page, lambda: viewer._requests)
            assert viewer.requests() == [wanted]
        page.get_by_role("button", name="save").click()
        until(page, lambda: viewer._requests)
        assert viewer.requests() == [Save()]


def test_a_page_that_stays_open_does_not_grow(page):
    sequence, sdf, results = scene()
    with Viewer(sdf, CAMERA, port=0, max_hz=100) as viewer:
        opened(viewer, page)
        buffer = viewer._server.viser._websock_server._broadcast_buffer
        sizes = []
        for i in range(60):
            shown(viewer, page, sequence[i % 6], results[i % 6])
            sizes.append(len(buffer.message_from_id))
        assert sizes[-1] <= sizes[10] + 5
