# SPDX-License-Identifier: MIT
"""Time of fitting primitives to 5,000 points, and to a frame with a mask: ``python tests/bench/primitives.py``.

Least and median of 15; CPU time of one thread. Of a frame also without finding the table and the object's pixels; with
SDFTRACK_DATA also objects of recorded scenes."""

import os
import platform
import time
from pathlib import Path

import numpy as np

import sdftrack as st
from sdftrack.evaluation.tables import text_table
from sdftrack.primitives.kinds import SOLIDS
from sdftrack.primitives.segmentation import SegmentedFrame
from sdftrack.primitives.solver import FitRequest, solve
from sdftrack.synth.noise import Kinect
from sdftrack.synth.solids import KINDS, random_solid, standing_scene

CAMERA = st.Camera(525, 525, 319.5, 239.5, 640, 480)
POINTS, TURNS = 5000, 15


def cloud(kind):
    """What a camera sees of a solid, 1 mm of noise along the rays; 5,000 points, m."""
    rng = np.random.default_rng(5)
    scene = standing_scene(kind, random_solid(kind, rng), CAMERA, rng, (0.6, 0.65))
    points = CAMERA.back_project(scene.depth)[scene.mask].astype(np.float64)
    points = points[rng.permutation(len(points))[:POINTS]]
    return points * (1 + rng.normal(0, 0.001, (len(points), 1)) / points[:, 2:])


def milliseconds(work):
    times = []
    for _ in range(TURNS):
        begin = time.thread_time()
        work()
        times.append(1e3 * (time.thread_time() - begin))
    return [f"{min(times):.1f}", f"{np.median(times):.1f}"]


rows = []
for kind in KINDS:
    points = cloud(kind)
    own = milliseconds(lambda p=points, k=kind: st.fit_primitive(p, k, threads=1))
    rows.append(
        [kind, str(len(points)), *own, *milliseconds(lambda p=points: st.fit_primitive(p, "auto", threads=1))]
    )
print(
    text_table(
        f"{platform.processor() or platform.machine()}",
        ["kind", "points", "ms", "median", "auto ms", "median"],
        rows,
    )
)


def masked_frames():
    """(name, frame, mask): a solid of each kind with a Kinect's noise, and objects of OSD."""
    for kind in KINDS:
        rng = np.random.default_rng(5)
        scene = standing_scene(kind, random_solid(kind, rng), CAMERA, rng, (0.6, 0.65))
        yield kind, st.Frame(Kinect()(scene.depth, scene.cosine, rng), camera=CAMERA), scene.mask
    folder = Path(os.environ.get("SDFTRACK_DATA", "")) / "osd"
    if (folder / "camera.json").is_file():
        from experiments.primitives.kinect_objects import objects_of

        for name, number in (("00", 2), ("22", 3), ("33", 2), ("43", 2)):
            frame, masks = objects_of(folder, name)
            yield f"learn{name} {number}", frame, masks[number]


def fits_alone(frame, mask):
    seen = SegmentedFrame.of(frame, frame.camera, "auto", mask)
    view = seen.view(seen.labels(mask, False))
    requests = [FitRequest(kind, None, 0, "exact", 1) for kind in (*SOLIDS, "auto")]
    return [milliseconds(lambda r=r: solve(view, r))[0] for r in requests]


rows = []
for name, frame, mask in masked_frames():
    auto = milliseconds(lambda f=frame, m=mask: st.fit_primitive(f, "auto", mask=m, threads=1))[0]
    rows.append([name, str(np.count_nonzero(mask)), *fits_alone(frame, mask), auto])
print(
    text_table(
        "A frame, 640 x 480, with a mask: ms, the fit alone, least of 15; all: with the table and the mask",
        ["object", "pixels", *SOLIDS, "auto", "all of auto"],
        rows,
    )
)
