# SPDX-License-Identifier: MIT
"""The 3-D view of the page: image board, cloud, models, trails, errors, the camera."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from sdftrack.camera import depth_camera
from sdftrack.viz.viewer.drawing import (
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
from sdftrack.viz.viewer.history import History
from sdftrack.viz.viewer.stage import FOV_RAD, Board, BoardPointer, initial_view, place_board, scene_distance

MOVED = 3.0  # the stage is set again where the objects are farther or nearer by this factor
POINT = 0.6  # diameter of a point in distances of neighbours: models show between them
FAINT = 0.25  # opacity of a lost object, at its last good pose
JPEG_QUALITY = 85


class Scene:
    """Nodes of a viser scene, in the depth camera's frame (x right, y down, z forward; m).

    Only the viewer's drawing thread calls `update`; nodes are made once and then changed, which keeps a page that is
    open for hours as small as a new one.
    """

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
