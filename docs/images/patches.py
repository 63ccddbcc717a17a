# SPDX-License-Identifier: MIT
"""The picture of docs/primitives.md: boards on a table as plane patches, one of them half behind another.

python -m docs.images.patches docs/images/patches.png
"""

import sys

import numpy as np
from PIL import Image

import sdftrack as st
from experiments.synth.patches import patch_scene
from experiments.synth.solids import ray_depth
from sdftrack.synth.noise import Kinect
from sdftrack.viz.primitives import draw_primitives

CAMERA = st.Camera(525, 525, 319.5, 239.5, 640, 480)
LARGER, WINDOW = 3, (175, 100, 435, 310)  # x0, y0, x1, y1
BOARDS = [  # width, height (m), place on the table from the first one (m), turn (rad)
    (0.20, 0.13, (0, 0), 0),
    (0.09, 0.16, (-0.2, 0.0), 0.5),
    (0.14, 0.17, (0.06, 0.17), 0.5),
]

rng = np.random.default_rng(5)
first = patch_scene("standing", {"width": BOARDS[0][0], "height": BOARDS[0][1]}, CAMERA, rng, (0.85, 0.86))
depth, cosine, (up, d) = first.depth.copy(), first.cosine.copy(), first.plane
rays = CAMERA.back_project(np.ones(CAMERA.shape, np.float32)).astype(float).reshape(-1, 3)
ahead = np.cross(up, [1.0, 0, 0])
for width, height, (x, y), turn in BOARDS[1:]:
    at = first.T_cam_obj[:3, 3] + x * np.array([1.0, 0, 0]) + y * ahead
    z = np.cos(turn) * first.T_cam_obj[:3, 2] + np.sin(turn) * np.cross(up, first.T_cam_obj[:3, 2])
    R = np.column_stack([np.cross(up, z), up, z])
    t = at - up * (at @ up + d) + up * height / 2
    hit, normals = ray_depth("plane", {"width": width, "height": height}, -R.T @ t, rays @ R)
    c = np.abs(np.einsum("ni,ni->n", normals @ R.T, rays)) / np.linalg.norm(rays, axis=1)
    nearer = hit.reshape(CAMERA.shape) < depth
    depth[nearer], cosine[nearer] = hit.reshape(CAMERA.shape)[nearer], c.reshape(CAMERA.shape)[nearer]
frame = st.Frame(Kinect()(depth, cosine, rng), camera=CAMERA)
fits = st.fit_primitives(frame, "plane")
for fit in fits:
    print(fit)
# Readings three times as large, lines drawn at that size: a picture that is enlarged afterwards is blurred.
large = st.Frame(np.repeat(np.repeat(frame.depth, LARGER, 0), LARGER, 1))
drawn = draw_primitives(large, fits, CAMERA.scaled(LARGER))
x0, y0, x1, y1 = (LARGER * v for v in WINDOW)
Image.fromarray(drawn[y0:y1, x0:x1]).quantize(128).save(sys.argv[1], optimize=True)
