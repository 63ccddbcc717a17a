# SPDX-License-Identifier: MIT
"""Views of a reconstructed mesh: four sides in one image, a turntable; unobserved surface is tinted."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack.camera import Camera
from sdftrack.mesh import Mesh

Picture = NDArray[np.uint8]
Array = NDArray[np.float64]
SIDES = (("as first seen", 0), ("from the right", 90), ("from behind", 180), ("from the left", 270))
PAPER_RGB, INK_RGB = (250, 250, 248), (60, 62, 68)
PLAIN_RGB = (206, 200, 190)  # of a mesh that no colour image has coloured
UNSEEN_RGB, TINT = np.array([150, 96, 214], np.float32), 0.7
LAMP = np.array([-0.35, -0.55, -0.76], np.float32)  # towards the lamp, at the viewer's upper left
FOCAL = 2.4  # in picture widths: a long lens, so that all sides look of one size
FILLED = 0.92  # of the picture's width by the body's largest circle
CAPTION_PX = 26
SOFT_PX = 1.5


def four_sides(
    mesh: Mesh, T_cam_obj: ArrayLike, size_px: int = 420, threads: int = 0, *, min_seen: float = 0.0
) -> Picture:
    """The mesh from the first viewpoint and from three more, a quarter turn apart, as one RGB picture."""
    # It is rotated about the vertical axis of the image in which it has the pose `T_cam_obj`. Surface with
    # ``mesh.seen`` below `min_seen` is tinted violet, with a caption.
    tinted = _tinted(mesh, min_seen)
    guessed = 0.0 if mesh.seen is None else float(_unseen(mesh.seen, min_seen).mean())
    height = size_px + CAPTION_PX * (2 if guessed > 0 else 1)
    out = np.full((height, size_px * len(SIDES), 3), PAPER_RGB, np.uint8)
    for n, (caption, degrees) in enumerate(SIDES):
        left = n * size_px
        out[:size_px, left : left + size_px] = _view(tinted, T_cam_obj, np.deg2rad(degrees), size_px, threads)
        _write(out, caption, left + size_px // 2, size_px + CAPTION_PX // 2, INK_RGB)
    if guessed > 0:
        colour = tuple(int(c) for c in UNSEEN_RGB)
        text = f"violet: not observed, guessed ({100 * guessed:.0f} % of the surface)"
        _write(out, text, out.shape[1] // 2, size_px + 3 * CAPTION_PX // 2, colour)
    return out


def turning(
    mesh: Mesh,
    T_cam_obj: ArrayLike,
    pictures: int = 90,
    size_px: int = 400,
    threads: int = 0,
    *,
    min_seen: float = 0.0,
) -> Iterator[Picture]:
    """Images (size_px, size_px, 3) of one full turn, to be played in a loop; the rest as in `four_sides`."""
    tinted = _tinted(mesh, min_seen)
    for angle in np.linspace(0, 2 * np.pi, pictures, endpoint=False):
        yield _view(tinted, T_cam_obj, float(angle), size_px, threads)


def _unseen(seen: NDArray[np.float32], min_seen: float) -> NDArray[np.bool_]:
    return (seen <= 0) | (seen < min_seen)


def _tinted(mesh: Mesh, min_seen: float) -> Mesh:
    """The mesh with its display colours."""
    colored = mesh.colors is not None and bool(mesh.colors.any())  # all black: no colour image was there
    shown = np.array(mesh.colors if colored else np.broadcast_to(PLAIN_RGB, mesh.vertices.shape), np.float32)
    if mesh.seen is not None:
        unseen = _unseen(mesh.seen, min_seen)
        shown[unseen] += TINT * (UNSEEN_RGB - shown[unseen])
    return Mesh(mesh.vertices, mesh.faces, shown.astype(np.uint8))


def _view(mesh: Mesh, T_cam_obj: ArrayLike, angle_rad: float, size_px: int, threads: int) -> Picture:
    """The mesh centred in a square image, rotated about the vertical axis of its first image."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    R = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ np.asarray(T_cam_obj, np.float64)[:3, :3]
    middle = 0.5 * mesh.bounds.sum(axis=0)
    radius = float(np.linalg.norm(mesh.vertices - middle, axis=1).max())
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, -R @ middle
    T[2, 3] += 2 * FOCAL * radius / FILLED
    centre = 0.5 * (size_px - 1)
    camera = Camera(FOCAL * size_px, FOCAL * size_px, centre, centre, size_px, size_px)
    depth, normals, colors = mesh.raycast(camera, T, threads=threads)
    assert colors is not None
    hit = depth > 0
    shade = 0.42 + 0.62 * np.clip(_softened(normals) @ LAMP, 0, 1)
    out = np.full(colors.shape, PAPER_RGB, np.uint8)
    out[hit] = np.clip(colors[hit] * shade[hit, None], 0, 255).astype(np.uint8)
    return out


def _softened(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """Smoothed normals, without steps between triangles that are due to the voxels."""
    import cv2

    soft = cv2.GaussianBlur(normals, (0, 0), SOFT_PX)
    length = np.linalg.norm(soft, axis=2, keepdims=True)
    return soft / np.maximum(length, 1e-6)


def _write(picture: Picture, text: str, middle: int, y: int, colour: tuple[int, ...]) -> None:
    import cv2

    font, scale = cv2.FONT_HERSHEY_SIMPLEX, 0.5
    (width, height), _ = cv2.getTextSize(text, font, scale, 1)
    cv2.putText(picture, text, (middle - width // 2, y + height // 2), font, scale, colour, 1, cv2.LINE_AA)
