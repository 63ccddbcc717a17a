# SPDX-License-Identifier: MIT
"""The picture of docs/primitives.md: solids of unknown size on a table, found one after another.

python -m docs.images.primitives docs/images/primitives.png
"""

import sys

import numpy as np
from PIL import Image

import sdftrack as st
from experiments.synth.solids import ray_depth, standing_scene
from sdftrack.synth.noise import Kinect
from sdftrack.viz.primitives import draw_primitives

CAMERA = st.Camera(525, 525, 319.5, 239.5, 640, 480)
LARGER, WINDOW = 3, (190, 110, 510, 290)  # x0, y0, x1, y1
SOLIDS = [  # kind, size (m), place on the table from the first one (m)
    ("box", {"x": 0.12, "y": 0.07, "z": 0.16}, (0, 0)),
    ("cylinder", {"radius": 0.033, "height": 0.12}, (0.17, -0.02)),
    ("sphere", {"radius": 0.045}, (-0.17, -0.03)),
    ("cone", {"radius": 0.05, "height": 0.13}, (0.05, -0.17)),
    ("ellipsoid", {"rx": 0.06, "ry": 0.04, "rz": 0.03}, (-0.1, -0.18)),
]

rng = np.random.default_rng(7)
first = standing_scene(SOLIDS[0][0], SOLIDS[0][1], CAMERA, rng, (0.85, 0.86))
depth, cosine, (up, d) = first.depth.copy(), first.cosine.copy(), first.plane
right = np.cross(up, [0, 0, -1.0])
right /= np.linalg.norm(right)
ahead = np.cross(right, up)
rays = CAMERA.back_project(np.ones(CAMERA.shape, np.float32)).astype(float).reshape(-1, 3)
for kind, size, (x, y) in SOLIDS[1:]:
    height = size.get("height", 2 * size.get("rz", size.get("radius", 0)))
    at = first.T_cam_obj[:3, 3] - x * right + y * ahead
    T = first.T_cam_obj.copy()
    T[:3, 3] = at - up * (at @ up + d) + up * height / 2
    z, normals = ray_depth(kind, size, -T[:3, :3].T @ T[:3, 3], rays @ T[:3, :3])
    c = np.abs(np.einsum("ni,ni->n", normals @ T[:3, :3].T, rays)) / np.linalg.norm(rays, axis=1)
    nearer = z.reshape(CAMERA.shape) < depth
    depth[nearer], cosine[nearer] = z.reshape(CAMERA.shape)[nearer], c.reshape(CAMERA.shape)[nearer]
frame = st.Frame(Kinect()(depth, cosine, rng), camera=CAMERA)
fits = st.fit_primitives(frame)
for fit in fits:
    print(fit)
# Readings three times as large, lines drawn at that size: a picture that is enlarged afterwards is blurred.
large = st.Frame(np.repeat(np.repeat(frame.depth, LARGER, 0), LARGER, 1))
drawn = draw_primitives(large, fits, CAMERA.scaled(LARGER))
x0, y0, x1, y1 = (LARGER * v for v in WINDOW)
Image.fromarray(drawn[y0:y1, x0:x1]).quantize(128).save(sys.argv[1], optimize=True)
