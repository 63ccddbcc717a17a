# SPDX-License-Identifier: MIT
"""Occluders: a hand in front of the object, a board that hides it, and parsing of the `occluder` argument."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import within
from sdftrack.synth.bodies import SKIN, Occluder, Stage
from sdftrack.synth.grip import Grip
from sdftrack.synth.surroundings import Layer, box_mesh, hand_mesh, mesh_layer

HAND_GAP_M = 0.02
BOARD_RGB = (95, 110, 90)


@dataclass(frozen=True)
class Hand:
    """An open hand between camera and object that occludes `share` (0..0.8) of it, 2 cm in front, without contact."""

    share: float = 0.3

    def __post_init__(self) -> None:
        within(self.share, "occluder: a fraction", 0, 0.8)

    def ready(self, stage: Stage) -> Callable[[int, Any, Any], Layer]:
        """A function (frame, visible, depth) -> the hand's picture."""
        # As large as a hand, or larger where it has much to hide.
        mesh = hand_mesh(max(0.12, 1.1 * stage.body.diameter * self.share**0.5))
        return lambda i, visible, depth: self._layer(mesh, stage, i, visible, depth)

    def _layer(
        self, mesh: Any, stage: Stage, i: int, visible: NDArray[np.bool_], depth: NDArray[np.float32]
    ) -> Layer:
        """Pushed in from the side until it hides the wanted fraction of what is visible."""
        count = np.count_nonzero(visible)
        if not count:
            return Layer.empty(stage.camera)
        v, u = np.nonzero(visible)
        thickness = 0.2 * float(np.ptp(mesh.vertices[:, 0]))
        z = max(float(depth[visible].min()) - HAND_GAP_M - thickness, 0.15)
        K = stage.camera
        side = float(np.random.default_rng([stage.seed, 5]).uniform(0, 2 * np.pi)) + 0.5 * i / stage.fps
        inward = np.array([np.cos(side), np.sin(side), 0.0])
        T = np.eye(4)
        # The fingers (-y of the hand) point inward, the palm looks at the object.
        T[:3, :3] = np.column_stack([np.cross(-inward, [0, 0, 1]), -inward, [0, 0, 1]])
        centre = z * np.array([(u.mean() - K.cx) / K.fx, (v.mean() - K.cy) / K.fy, 1.0])
        reach = 2.0 * stage.body.diameter + 0.05
        low, high = -reach, reach  # how far the finger tips are past the middle of the object
        v0, u0 = v - v.min(), u - u.min()
        outline = K.cropped(int(u.min()), int(v.min()), int(u0.max()) + 1, int(v0.max()) + 1)
        for _ in range(12):
            push = 0.5 * (low + high)
            T[:3, 3] = centre + push * inward
            hidden = np.count_nonzero(mesh.raycast(outline, T)[0][v0, u0]) / count
            if abs(hidden - self.share) < 0.005:
                break
            if hidden < self.share:
                low = push
            else:
                high = push
        return mesh_layer(mesh, K, T, SKIN)


@dataclass(frozen=True)
class Cover:
    """A board that fully occludes the object in the frames `first` to `first + frames - 1`.

    It is `gap_m` in front of the nearest position of the object in these frames and the one after them, and large
    enough to cover all of these positions; `color` is its (r, g, b).
    """

    first: int
    frames: int = 15
    gap_m: float = 0.05
    color: tuple[int, int, int] = BOARD_RGB

    def __post_init__(self) -> None:
        if self.first < 0 or self.frames < 1 or not self.gap_m > 0:
            raise ValueError(
                "occluder: Cover(first, frames, gap_m): expected a frame, at least 1 and above 0, "
                f"got {self.first}, {self.frames}, {self.gap_m:g}"
            )

    def ready(self, stage: Stage) -> Callable[[int, Any, Any], Layer]:
        """A function (frame, visible, depth) -> the board's picture."""
        hidden = stage.poses[self.first : self.first + self.frames + 1]
        board, T = None, np.eye(4)
        if len(hidden):
            centres = hidden[:, :3, :3] @ stage.body.centre + hidden[:, :3, 3]
            radius = 0.5 * stage.body.diameter
            z = float(centres[:, 2].min()) - radius - self.gap_m
            if z < 0.1:
                raise ValueError(f"occluder: Cover needs 0.1 m before the object, got {z:.3f} m")
            # What hides a ball at distance Z is z / Z as large, at most z / (Z - radius) for its nearer side.
            edges = np.concatenate([centres[:, :2] - 1.1 * radius, centres[:, :2] + 1.1 * radius])
            distance = np.tile(centres[:, 2:], (2, 1))
            seen = np.concatenate([edges * z / distance, edges * z / (distance - radius)])
            low, high = seen.min(axis=0), seen.max(axis=0)
            board = box_mesh(np.array([*(high - low + 0.02), 0.01]))
            T[:3, 3] = [*(0.5 * (low + high)), z]

        def layer(i: int, visible: Any, depth: Any) -> Layer:
            if board is None or not self.first <= i < self.first + self.frames:
                return Layer.empty(stage.camera)
            return mesh_layer(board, stage.camera, T, self.color)

        return layer


def occluder_of(value: Any) -> Occluder | None:
    """An occluder from None, True, "hand", "grip", a fraction, or an object with `ready`."""
    if value is None or value is False:
        return None
    if hasattr(value, "ready") and not isinstance(value, type):
        return value
    if value is True or (isinstance(value, str) and value == "hand"):
        return Hand()
    if isinstance(value, str) and value == "grip":
        return Grip()
    try:
        share = float(value)
    except (TypeError, ValueError):
        share = np.nan
    if isinstance(value, str | type) or not 0 <= share <= 0.8:
        raise ValueError(
            'occluder: expected None, True, "hand", "grip", a fraction of 0 to 0.8, Hand(...), Grip(...) or '
            f"Cover(...), got {value!r}"
        )
    return Hand(share) if share > 0 else None
