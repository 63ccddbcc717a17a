# SPDX-License-Identifier: MIT
"""The picture of docs/reconstruction.md: what a camera sees of a duck, and the shape by then, red where it is guessed.

python docs/images/reconstruction.py docs/images/reconstruction.png
"""

import sys

import cv2
import numpy as np
from PIL import Image

import sdftrack as st
from sdftrack import geometry
from sdftrack.synth.objects import duck_mesh

FRAMES, SHOWN, SIZE = 60, (0, 9, 24, 59), 190  # once round; panels; pixels of a panel

duck = duck_mesh()
scale = 0.12 / np.ptp(duck.vertices, axis=0).max()
duck = st.Mesh(scale * (duck.vertices - duck.vertices.mean(axis=0)), duck.faces, duck.colors)
camera = st.Camera(400.0, 400.0, 159.5, 119.5, 320, 240)
axis = np.array([0.2, 1.0, 0.1]) / np.linalg.norm([0.2, 1.0, 0.1])
upright = geometry.pose((np.pi / 2, 0, 0), (0, 0, 0))
poses = [geometry.pose(2 * np.pi * i / FRAMES * axis, (0, 0, 0.4)) @ upright for i in range(FRAMES)]
seq = st.synth.sequence(
    duck, FRAMES, np.array(poses), 0.001, seed=4, camera=camera, clutter="wall", threads=1
)
star = st.Reconstructor(camera, voxels=128, threads=1)
columns = []
for i in range(FRAMES):
    result = star.track(seq[i]) if i else star.start(seq[0], mask=seq.masks(0)[0])
    if i not in SHOWN:
        continue
    mesh = star.mesh()
    often = np.clip(mesh.seen / 3, 0, 1)[:, None]
    tint = np.where(
        mesh.seen[:, None] > 0, (1 - often) * [240, 225, 220] + often * [90, 130, 180], [215, 60, 45]
    )
    # A quarter turn further: seen from a side that the camera will show later.
    aside = geometry.pose((0, np.pi / 2, 0), (0, 0, 0))
    T = result.pose.copy()
    T[:3, :3] = aside[:3, :3] @ T[:3, :3]
    views = []
    for colors in (mesh.colors, tint.astype(np.uint8)):
        depth, normals, rgb = st.Mesh(mesh.vertices, mesh.faces, colors).raycast(camera, T, threads=1)
        shade = 0.35 + 0.65 * np.clip(-normals[..., 2:], 0, 1)
        views.append(np.where(depth[..., None] > 0, rgb * shade, 255).astype(np.uint8))
    parts = [np.ascontiguousarray(v[40:200, 80:240]) for v in (seq[i].color, *views)]
    columns.append(np.vstack([cv2.resize(p, (SIZE, SIZE), interpolation=cv2.INTER_CUBIC) for p in parts]))
    print(i, str(result.status[0]), star.quality().summary)
Image.fromarray(np.hstack(columns)).quantize(80).save(sys.argv[1], optimize=True)
