# SPDX-License-Identifier: MIT
"""A table taken out of a frame, found and masked, on one thread. Changing these numbers breaks comparisons.

640 x 480 pixels at 525 px, a table 0.6 m below a camera that looks down by 45 degrees, three boxes on it, the noise of
a structured-light sensor.
"""

from collections.abc import Callable

from harness import benchmark

import sdftrack as st
from sdftrack.reproduce.scenes.table_scenes import made_scene


def removing(**given: object) -> Callable[[], object]:
    scene = made_scene()
    return lambda: st.remove_plane(scene.frame, scene.camera, **given)  # type: ignore[arg-type]


@benchmark("planes/remove_plane", unit="frame")
def remove_plane() -> Callable[[], object]:
    return removing()


@benchmark("planes/remove_plane_from_a_pixel", unit="frame")
def remove_plane_from_a_pixel() -> Callable[[], object]:
    return removing(start_px=(320, 440))


@benchmark("planes/remove_plane_bent", unit="frame")
def remove_plane_bent() -> Callable[[], object]:
    return removing(method="bent")


@benchmark("planes/remove_plane_printed", unit="frame")
def remove_plane_printed() -> Callable[[], object]:
    return removing(method="printed")


@benchmark("planes/plane_angles", unit="frame")
def plane_angles() -> Callable[[], object]:
    seq = st.synth.corner(1, "kinect")
    frame = seq[0]
    return lambda: st.metrics.plane_angles(frame, seq.camera)
