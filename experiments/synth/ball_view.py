# SPDX-License-Identifier: MIT
"""How one camera sees the ball, its wand, the hand and the wall: depth at pixel centres, colour over whole pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.synth.bodies import SKIN
from sdftrack.synth.grip import Capsules, cast
from sdftrack.synth.surroundings import background

Array = NDArray[np.float64]
Image = NDArray[np.float32]
WALL_M = 2.0
FINER = 5  # sub-pixels along each axis where the ball is: its outline is then right to 0.02 px
MOMENTS = 7  # of an exposure
LAMP = np.array([-0.5, -0.7, -0.5]) / np.linalg.norm([-0.5, -0.7, -0.5])  # towards the lamp, depth camera
WAND_RADIUS_M, WAND_LENGTH_M = 0.004, 0.30
WOOD = (150, 125, 90)


@dataclass(frozen=True)
class Props:
    """The ball and what else is in the scene."""

    radius_m: float
    color: tuple[int, int, int]
    wand: bool
    hand: bool
    clutter: bool
    seed: int
    gloss: float


class BallView:
    """A camera in the scene; `T_eye_cam` maps the depth camera's frame to its own."""

    def __init__(self, camera: Camera, T_eye_cam: Array, props: Props) -> None:
        self.camera, self._T, self._props = camera, T_eye_cam, props
        scene = background(camera, "wall", WALL_M - 0.5, np.random.default_rng([props.seed, 13]))
        if props.clutter:
            things, colors = _clutter(props)
            self._put(scene.depth, scene.cosine, scene.color, things.moved(T_eye_cam), colors)
        self._back = scene

    def depth(self, center_cam: Array) -> tuple[Image, Image]:
        """Depth (m) and cosine of incidence with the ball at `center_cam` (depth camera's frame)."""
        depth, cosine, _ = self._without_ball(center_cam)
        rows, columns = self._window(center_cam[None])
        part = self.camera.rays[rows, columns].astype(np.float64)
        z, normal, ray = _sphere(part, self._eye(center_cam), self._props.radius_m)
        nearer = (z > 0) & ((depth[rows, columns] == 0) | (z < depth[rows, columns]))
        depth[rows, columns][nearer] = z[nearer]
        along = -np.einsum("...k,...k", normal, ray) / np.linalg.norm(ray, axis=-1)
        cosine[rows, columns][nearer] = along[nearer]
        return depth, cosine

    def color(self, at: Callable[[float], Array], taken_s: float, exposure_s: float) -> Image:
        """(h, w, 3) float32 grey values of light gathered while the shutter is open, centred at `taken_s`."""
        moments = [taken_s]
        if exposure_s > 0:
            moments = [taken_s + exposure_s * ((k + 0.5) / MOMENTS - 0.5) for k in range(MOMENTS)]
        rows, columns = self._window(np.array([at(t) for t in moments]))
        _, _, image = self._without_ball(at(taken_s))
        out = image.astype(np.float32)
        if out[rows, columns].size:
            out[rows, columns] = np.mean([self._fine(at(t), rows, columns) for t in moments], axis=0)
        return out

    def _fine(self, center_cam: Array, rows: slice, columns: slice) -> Array:
        """The window's pixels as means over FINER x FINER rays."""
        h, w = rows.stop - rows.start, columns.stop - columns.start
        eye = self.camera.cropped(columns.start, rows.start, w, h).scaled(FINER)
        image = np.repeat(np.repeat(self._back.color[rows, columns], FINER, 0), FINER, 1).astype(np.float64)
        depth = np.repeat(np.repeat(self._back.depth[rows, columns], FINER, 0), FINER, 1)
        cosine = np.ones_like(depth)
        stick, colors = self._stick(center_cam)
        if len(stick):
            self._put(depth, cosine, image, stick.moved(self._T), colors, eye)
        z, normal, ray = _sphere(eye.rays.astype(np.float64), self._eye(center_cam), self._props.radius_m)
        nearer = (z > 0) & ((depth == 0) | (z < depth))
        image[nearer] = self._lit(normal, ray)[nearer]
        means: Array = image.reshape(h, FINER, w, FINER, 3).mean(axis=(1, 3))
        return means

    def _lit(self, normal: Array, ray: Array) -> Array:
        """Matt ball in lamp and room light, and a highlight."""
        lamp = self._T[:3, :3] @ LAMP
        matt = 0.4 + 0.6 * np.clip(normal @ lamp, 0, 1)
        half = lamp - ray / np.linalg.norm(ray, axis=-1, keepdims=True)
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        shine = self._props.gloss * 255 * np.clip(np.einsum("...k,...k", normal, half), 0, 1) ** 60
        lit: Array = np.minimum(matt[..., None] * np.array(self._props.color) + shine[..., None], 255)
        return lit

    def _without_ball(self, center_cam: Array) -> tuple[Image, Image, NDArray[np.uint8]]:
        scene = self._back.copy()
        stick, colors = self._stick(center_cam)
        if len(stick):
            self._put(scene.depth, scene.cosine, scene.color, stick.moved(self._T), colors)
        return scene.depth, scene.cosine, scene.color

    def _stick(self, center_cam: Array) -> tuple[Capsules, Array]:
        """Wand from the ball's middle downwards and a little towards the person, hand and forearm at its end."""
        down = np.array([0.25, 0.93, 0.28])
        c, p = np.asarray(center_cam, dtype=float), self._props
        end = c + WAND_LENGTH_M * down
        parts = []
        if p.wand:
            parts.append((c, end, WAND_RADIUS_M, WOOD))
        if p.hand:
            side = np.array([0.93, -0.25, 0.0])
            parts += [
                (end - 0.03 * side, end + 0.03 * side, 0.028, SKIN),
                (end, end + np.array([0.12, 0.25, 0.25]), 0.036, SKIN),
            ]
        if not parts:
            return Capsules(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)), np.zeros((0, 3))
        a, b, r, colors = (np.array([part[k] for part in parts], dtype=float) for k in range(4))
        return Capsules(a, b, r), colors

    def _put(
        self,
        depth: Image,
        cosine: Image,
        color: NDArray,
        things: Capsules,
        colors: Array,
        eye: Camera | None = None,
    ) -> None:
        hits = cast(things, self.camera if eye is None else eye)
        if not len(hits.pixel):
            return
        order = np.argsort(-hits.depth, kind="stable")  # far ones first, near ones over them
        pixel, k, z, c = (v[order] for v in (hits.pixel, hits.capsule, hits.depth, hits.cosine))
        under = depth.reshape(-1)[pixel]
        shown = (under == 0) | (z < under)
        pixel, k, z, c = pixel[shown], k[shown], z[shown], c[shown]
        depth.reshape(-1)[pixel], cosine.reshape(-1)[pixel] = z, c
        color.reshape(-1, 3)[pixel] = colors[k] * (0.55 + 0.45 * c[:, None])

    def _eye(self, center_cam: Array) -> Array:
        p: Array = self._T[:3, :3] @ center_cam + self._T[:3, 3]
        return p

    def _window(self, centers_cam: Array) -> tuple[slice, slice]:
        """Rows and columns that hold the ball at all the places, and a margin."""
        p = centers_cam @ self._T[:3, :3].T + self._T[:3, 3]
        px, camera = self.camera.project(p), self.camera
        reach = 1.25 * max(camera.fx, camera.fy) * self._props.radius_m / p[:, 2].min() + 4
        low = np.floor(px.min(axis=0) - reach).astype(int)
        high = np.ceil(px.max(axis=0) + reach).astype(int) + 1
        x0, x1 = np.clip([low[0], high[0]], 0, camera.width)
        y0, y1 = np.clip([low[1], high[1]], 0, camera.height)
        return slice(int(y0), int(y1)), slice(int(x0), int(x1))


def _sphere(rays: Array, center: Array, radius_m: float) -> tuple[Array, Array, Array]:
    """Depth (0: not met), outward normal and ray (z = 1) of each pixel with a ball."""
    ray = np.concatenate([rays, np.ones_like(rays[..., :1])], axis=-1)
    rr, rc = np.einsum("...k,...k", ray, ray), ray @ center
    inside = rc * rc - rr * (center @ center - radius_m**2)
    z = np.where(inside > 0, (rc - np.sqrt(np.maximum(inside, 0))) / rr, 0)
    normal = (z[..., None] * ray - center) / radius_m
    return z, normal, ray


def _clutter(props: Props) -> tuple[Capsules, Array]:
    """Rods of many colours before the wall; none has the ball's."""
    rng = np.random.default_rng([props.seed, 14])
    a = np.column_stack([rng.uniform(-0.9, 0.9, 12), rng.uniform(-0.7, 0.7, 12), rng.uniform(1.75, 1.85, 12)])
    b = a + rng.normal(size=(12, 3)) * (0.12, 0.12, 0.02)
    colors = rng.uniform(40, 200, (12, 3))
    unit = np.array(props.color) / np.linalg.norm(props.color)
    alike = colors @ unit / np.linalg.norm(colors, axis=1) > 0.93
    colors[alike] = colors[alike][:, ::-1]
    alike = colors @ unit / np.linalg.norm(colors, axis=1) > 0.93
    colors[alike] = 120
    return Capsules(a, b, rng.uniform(0.03, 0.06, 12)), colors
