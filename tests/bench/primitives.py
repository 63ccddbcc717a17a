# SPDX-License-Identifier: MIT
"""Time of fitting primitives to 5,000 points: ``python tests/bench/primitives.py``.

Least and median of 15; CPU time of one thread."""

import platform
import time

import numpy as np

import sdftrack as st
from sdftrack.evaluation.tables import text_table
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
