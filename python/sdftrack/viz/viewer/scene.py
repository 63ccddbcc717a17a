# SPDX-License-Identifier: MIT
"""The page's 3-D view: where things stand, the image on a board, clicks on it, cloud, models and their errors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera
from sdftrack.viz.viewer.drawing import (
    History,
    Shown,
    cloud,
    cloud_step,
    ellipsoid,
    light_mesh,
    object_rgb,
    overlay,
    trail_segments,
    wxyz,
)

GAP = 0.06  # between the board and the scene, in widths of the board
FOV_RAD = math.radians(50)  # vertical, of the page's view
ASPECT = 1.3  # of the part of a page that shows the scene; a narrower one needs the mouse wheel
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Board:
    """The camera image as a rectangle that faces the camera, left of what the camera sees; camera frame, m."""

    center: tuple[float, float, float]
    width_m: float
    height_m: float
    width_px: int
    height_px: int

    def pixel(self, origin: Any, through: Any) -> tuple[float, float] | None:
        """Pixel (x, y) that a ray from `origin` through a point meets; None: it misses the board's plane."""
        # Pixels beyond the board's border are returned as they are.
        a, b = np.asarray(origin, np.float64), np.asarray(through, np.float64)
        step = b - a
        if abs(step[2]) < 1e-12:
            return None
        share = (self.center[2] - a[2]) / step[2]
        if share <= 0:
            return None
        hit = a + share * step - np.asarray(self.center)
        x = (hit[0] / self.width_m + 0.5) * self.width_px - 0.5
        y = (hit[1] / self.height_m + 0.5) * self.height_px - 0.5
        return float(x), float(y)

    def point(self, x_px: float, y_px: float, lift_m: float = 0.0) -> Array:
        """Point (3,) of a pixel, `lift_m` in front of the board; camera frame, m."""
        return np.array(
            [
                self.center[0] + ((x_px + 0.5) / self.width_px - 0.5) * self.width_m,
                self.center[1] + ((y_px + 0.5) / self.height_px - 0.5) * self.height_m,
                self.center[2] - lift_m,
            ]
        )

    def contains(self, x_px: float, y_px: float) -> bool:
        return -0.5 <= x_px < self.width_px - 0.5 and -0.5 <= y_px < self.height_px - 0.5


def scene_distance(depth: NDArray[np.float32] | None, poses: Array | None) -> float | None:
    """Distance (m) of what matters: the tracked objects, else the median of the depth; None: nothing is known."""
    if poses is not None:
        z = poses[:, 2, 3]
        z = z[np.isfinite(z) & (z > 0)]
        if z.size:
            return float(np.median(z))
    if depth is not None:
        sample = depth[::8, ::8]
        sample = sample[sample > 0]
        if sample.size:
            return float(np.median(sample))
    return None


def place_board(lens: Any, distance_m: float) -> Board:
    """A board as large as what the camera sees at this distance. `lens`: the depth camera."""
    width, height = int(lens.width), int(lens.height)
    width_m = distance_m * width / float(lens.K[0, 0])
    return Board((-(1 + GAP) * width_m, 0.0, distance_m), width_m, width_m * height / width, width, height)


def initial_view(board: Board) -> tuple[Array, Array]:
    """Position and look-at point (m, camera frame) of a view of board and scene."""
    middle = np.array([-(1 + GAP) * board.width_m / 2, 0.0, board.center[2]])
    wide = (2 + 3 * GAP) * board.width_m / (2 * math.tan(FOV_RAD / 2) * ASPECT)
    high = 1.1 * board.height_m / (2 * math.tan(FOV_RAD / 2))
    return middle - [0.0, 0.0, max(wide, high)], middle


LEAST_PX = 4  # a smaller drag is a trembling hand: no box
BOX_RGB = (255, 230, 60)
LIFT = 0.002  # of the drawn box before the board, in distances

Pixel = tuple[float, float]


class BoardPointer:
    """Listens to one node that shows the image; a drag draws its box while it lasts."""

    # viser gives rays for clicks and points on a plane for drags; both are met with the board's plane, so the view may
    # be turned as one likes.

    def __init__(
        self,
        viser: Any,
        node: Any,
        board: Board,
        on_click: Callable[[float, float], None],
        on_box: Callable[[float, float, float, float], None],
    ) -> None:
        self._viser, self._board, self._on_box = viser, board, on_box
        self._line: Any = None

        # Coroutines run in the order of the events; plain functions would run in a pool of threads.
        async def clicked(event: Any) -> None:
            pixel = board.pixel(event.ray_origin, np.add(event.ray_origin, event.ray_direction))
            if pixel is not None and board.contains(*pixel):
                on_click(*pixel)

        async def dragged(event: Any) -> None:
            eye = event.client.camera.position
            a, b = board.pixel(eye, event.start_position), board.pixel(eye, event.end_position)
            if a is not None and b is not None:
                self._drag(self._inside(a), self._inside(b), event.phase == "end")

        node.on_click(clicked)
        node.on_drag("left")(dragged)

    def _inside(self, pixel: Pixel) -> Pixel:
        x, y = pixel
        return min(max(x, 0.0), self._board.width_px - 1.0), min(max(y, 0.0), self._board.height_px - 1.0)

    def _drag(self, a: Pixel, b: Pixel, ended: bool) -> None:
        x, y = min(a[0], b[0]), min(a[1], b[1])
        w, h = abs(a[0] - b[0]), abs(a[1] - b[1])
        if ended:
            if self._line is not None:
                self._line.visible = False
            if min(w, h) >= LEAST_PX:
                self._on_box(x, y, w, h)
            return
        lift = LIFT * self._board.center[2]
        corners = [self._board.point(*p, lift) for p in ((x, y), (x + w, y), (x + w, y + h), (x, y + h))]
        segments = np.array([[corners[i], corners[(i + 1) % 4]] for i in range(4)], np.float32)
        if self._line is None:
            self._line = self._viser.scene.add_line_segments(
                "/selection", segments, BOX_RGB, thickness=2.0, thickness_units="screen"
            )
        else:
            self._line.points, self._line.visible = segments, True


MOVED = 3.0  # the stage is set again where the objects are farther or nearer by this factor
POINT = 0.6  # diameter of a point in distances of neighbours: models show between them
FAINT = 0.25  # opacity of a lost object, at its last good pose
JPEG_QUALITY = 85


class Scene:
    """Nodes of a viser scene, in the depth camera's frame (x right, y down, z forward; m)."""

    # Only the viewer's drawing thread calls `update`; nodes are made once and then changed, which keeps a page that is
    # open for hours as small as a new one.

    def __init__(
        self,
        viser: Any,
        on_click: Callable[[float, float], None],
        on_box: Callable[[float, float, float, float], None],
    ) -> None:
        self._viser, self._on_click, self._on_box = viser, on_click, on_box
        viser.scene.set_up_direction("-y")
        self.board: Board | None = None  # where the image stands; None before the first frame
        self._image: Any = None
        self._cloud: Any = None
        self._models: dict[int, tuple[Any, Any]] = {}  # k -> (what it shows, node)
        self._trails: dict[int, Any] = {}
        self._errors: dict[int, Any] = {}

    def update(
        self, shown: Shown, camera: Any, meshes: dict[int, Any], history: History, magnified: float
    ) -> Any:
        """Show a frame; returns the overlay, (H, W, 3) uint8 RGB."""
        picture = overlay(shown, camera)
        poses = None if shown.result is None else shown.result.poses
        distance = scene_distance(shown.frame.depth, poses)
        lens = depth_camera(camera)
        size = (picture.shape[1], picture.shape[0])
        points, colors = cloud(shown.frame, camera, distance or 1.0)
        new_models = self._new_models(shown, meshes)
        with self._viser.atomic():  # image, cloud and models of one frame appear together
            if self.board is None or self._misplaced(distance, size):
                self._set_stage(lens, distance or 1.0, picture)
            else:
                self._image.image = picture
            assert self.board is not None
            if self._cloud is None:
                gap_px = cloud_step(size[0] * size[1])
                self._cloud = self._viser.scene.add_point_cloud(
                    "/cloud", points, colors, point_size=POINT * gap_px * self.board.center[2] / float(lens.K[0, 0]),
                    precision="float32", point_shading="flat",
                )  # fmt: skip
            else:
                self._cloud.points, self._cloud.colors = points, colors
            for k, (key, mesh) in new_models.items():
                self._models[k] = (key, self._add_model(k, mesh))
            self._place_models(shown)
            self._place_trails(shown, history)
            self._place_errors(shown, magnified)
        return picture

    def _misplaced(self, distance: float | None, size: tuple[int, int]) -> bool:
        assert self.board is not None
        if size != (self.board.width_px, self.board.height_px):
            return True
        ratio = 1.0 if distance is None else distance / self.board.center[2]
        return not 1 / MOVED < ratio < MOVED

    def _set_stage(self, lens: Any, distance: float, picture: Any) -> None:
        """Board, frustum and view for a scene at this distance; pages that are open turn there."""
        self.board = board = place_board(lens, distance)
        self._image = self._viser.scene.add_image(
            "/image", picture, board.width_m, board.height_m, format="jpeg", jpeg_quality=JPEG_QUALITY,
            position=board.center, cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        BoardPointer(self._viser, self._image, board, self._on_click, self._on_box)
        self._viser.scene.add_camera_frustum(
            "/camera", 2 * math.atan(lens.height / (2 * float(lens.K[1, 1]))), lens.width / lens.height,
            scale=0.05 * distance, thickness=1.5, thickness_units="screen", color=(150, 150, 160),
        )  # fmt: skip
        position, look_at = initial_view(board)
        views = [self._viser.initial_camera, *(c.camera for c in self._viser.get_clients().values())]
        for view in views:
            view.fov, view.near, view.far = FOV_RAD, 0.01 * distance, 100 * distance
            view.position, view.look_at = position, look_at

    def _new_models(self, shown: Shown, meshes: dict[int, Any]) -> dict[int, tuple[Any, Any]]:
        """Meshes that the page does not show yet; made before the scene is locked, since that takes a while."""
        new = {}
        for k in range(shown.count):
            key = meshes.get(k, shown.shapes[k])
            if k not in self._models or self._models[k][0] is not key:
                new[k] = (key, light_mesh(key if k in meshes else key.to_mesh()))
        return new

    def _add_model(self, k: int, mesh: Any) -> Any:
        name = f"/object_{k}"
        if mesh.colors is not None and len(mesh.faces):
            return self._viser.scene.add_mesh_trimesh(name, mesh.to_trimesh())
        return self._viser.scene.add_mesh_simple(
            name, mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32), color=object_rgb(k),
            side="double",
        )  # fmt: skip

    def _place_models(self, shown: Shown) -> None:
        for k, (_, node) in self._models.items():
            if k >= shown.count or not np.isfinite(shown.result.poses[k]).all():
                node.visible = False
                continue
            T = shown.result.poses[k]
            known = str(shown.result.status[k]) in ("ok", "weak")
            node.position, node.wxyz, node.visible = T[:3, 3], wxyz(T[:3, :3]), True
            if hasattr(node, "opacity"):
                node.opacity = None if known else FAINT
            else:
                node.visible = known

    def _place_trails(self, shown: Shown, history: History) -> None:
        for k in range(max(shown.count, len(self._trails))):
            segments = trail_segments(list(history.positions(k)) if k < shown.count else [])
            if k in self._trails:
                self._trails[k].visible = len(segments) > 0
            if len(segments) and k in self._trails:
                self._trails[k].points = segments  # its one colour stays
            elif len(segments):
                self._trails[k] = self._viser.scene.add_line_segments(
                    f"/trail_{k}", segments, object_rgb(k), thickness=2.0, thickness_units="screen"
                )

    def _place_errors(self, shown: Shown, magnified: float) -> None:
        for k in range(max(shown.count, len(self._errors))):
            known = k < shown.count and str(shown.result.status[k]) in ("ok", "weak")
            shape = ellipsoid(shown.result.covariances[k]) if known else None
            if k in self._errors:
                self._errors[k].visible = shape is not None
            if shape is None:
                continue
            axes, R = shape
            if k not in self._errors:
                self._errors[k] = self._viser.scene.add_icosphere(
                    f"/error_{k}", 1.0, (255, 255, 255), opacity=0.45, cast_shadow=False, receive_shadow=False
                )
            node = self._errors[k]
            node.scale = tuple(float(max(magnified * a, 1e-6)) for a in axes)
            node.position, node.wxyz = shown.result.poses[k][:3, 3], wxyz(R)
