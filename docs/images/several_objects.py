# SPDX-License-Identifier: MIT
"""The picture of docs/several_objects.md: two look-alikes that touch and hide each other, tracked together.

python -m docs.images.several_objects docs/images/several_objects.png
"""

import sys

import cv2
import numpy as np
from PIL import Image

import sdftrack as st
from experiments.synth.contact import Solid
from experiments.synth.several import meetings
from sdftrack.synth.objects import duck_mesh

SHOWN, MARGIN, SIZE = (6, 52), 50, 240  # frames; pixels around the objects; of a panel

mesh = duck_mesh()
mesh = st.Mesh(0.6 * mesh.vertices, mesh.faces)
solid = Solid.of(mesh, st.SDF.from_mesh(mesh, voxels=160, unit="m"))
scene = meetings(mesh, solid, SHOWN[-1] + 1, seed=1, color=True, threads=1)
shapes = [solid.sdf] * 2
tracker = st.Tracker(shapes, scene.camera, threads=1, membership=True)
panels = []
for i in range(len(scene)):
    frame = scene[i]
    result = tracker.track(frame) if i else tracker.start(frame, poses=list(scene.poses[0]))
    if i not in SHOWN:
        continue
    x, y = scene.camera.depth.project(solid.place(scene.poses[i])).mean(axis=0).astype(int)
    r = int(MARGIN + 0.5 * np.ptp(scene.camera.depth.project(solid.place(scene.poses[i])), axis=0).max())
    x, y = np.clip([x, y], r, [frame.depth.shape[1] - r, frame.depth.shape[0] - r])
    pair = [frame.color, st.draw(frame, result, shapes, scene.camera)]
    for picture in pair:
        part = np.ascontiguousarray(picture[y - r : y + r, x - r : x + r])
        panels.append(cv2.resize(part, (SIZE, SIZE), interpolation=cv2.INTER_CUBIC))
    print(i, [str(s) for s in result.status], np.round(scene.share[i], 2), f"{1e3 * scene.gaps[i]:.1f} mm")
Image.fromarray(np.hstack(panels)).quantize(96).save(sys.argv[1], optimize=True)
