# SPDX-License-Identifier: MIT
"""Results for symmetric objects: among all equivalent poses, the one nearest to the previous pose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import of_kind
from sdftrack.imaging.pose_hint import Place
from sdftrack.symmetry import Symmetry

Array = NDArray[np.float64]
FOLLOWED = ("ok", "weak")
ADVICE = "make one with st.find_symmetries(sdf)"


class CanonicalPoses:
    """Symmetries of a tracker's objects, and the last reported pose of each."""

    def __init__(self, symmetry: Any, shapes: Sequence[Any], mode: str) -> None:
        count = len(shapes)
        given = [symmetry] * count if symmetry is None or isinstance(symmetry, Symmetry) else list(symmetry)
        if len(given) != count:
            raise ValueError(f"symmetry: expected one or None per shape ({count}), got {len(given)}")
        for k, one in enumerate(given):
            if one is not None:
                of_kind(one, Symmetry, f"symmetry[{k}]", ADVICE)
        self.symmetries: list[Symmetry | None] = given
        colored = [mode != "depth" and shape.colors is not None for shape in shapes]
        self._used = [s if s and not c else None for s, c in zip(given, colored, strict=True)]
        self.last: list[Array | None] = [None] * count  # reported poses; none of them is written to

    def declare(self, core: Any) -> None:
        """Declare to the core which poses are equivalent."""
        for k, symmetry in enumerate(self._used):
            if symmetry is not None:
                core.set_symmetries(k, np.ascontiguousarray(symmetry.motions()[1:]))

    def resize(self, k: int, factor: float) -> None:
        """Object k is larger by a factor; the core's motions have grown already."""
        for symmetries in (self.symmetries, self._used):
            symmetry = symmetries[k]
            if symmetry is not None:
                symmetries[k] = symmetry.enlarged(factor)

    def begin(self, places: Sequence[Place]) -> None:
        """Forget all reported poses; the first result will be near the given pose, if any."""
        self.last = [
            np.asarray(p) if isinstance(p, np.ndarray) and p.dtype == np.float64 else None for p in places
        ]

    def set_pose(self, k: int, T: Array) -> None:
        """Set the pose of object k."""
        self.last[k] = T

    def add(self) -> None:
        """Add an object without symmetry."""
        for values in (self.symmetries, self._used, self.last):
            values.append(None)  # type: ignore[attr-defined]

    def remove(self, k: int) -> None:
        """Remove object k."""
        for values in (self.symmetries, self._used, self.last):
            del values[k]  # type: ignore[attr-defined]

    def applied(self, found: dict[str, Any]) -> dict[str, Any]:
        """Map the core's poses, covariances and twists to the equivalents nearest to the previous poses."""
        if not any(self._used):
            return found
        poses, covariances, unstated, twists = (
            found[n].copy() for n in ("poses", "covariances", "unstated", "twists")
        )
        for k, symmetry in enumerate(self._used):
            if symmetry is None or not np.isfinite(poses[k]).all():
                continue
            near = self.last[k]
            if found["status"][k] in FOLLOWED:
                told = symmetry.canonical(poses[k], near=near)
                offset = told[:3, 3] - poses[k][:3, 3]
                poses[k], covariances[k] = told, moved_covariance(covariances[k], offset)
                unstated[k] = moved_covariance(unstated[k], offset)
                twists[k][:3] += np.cross(twists[k][3:], offset)
                self.last[k] = told
            elif near is not None:
                poses[k] = near
        return {**found, "poses": poses, "covariances": covariances, "unstated": unstated, "twists": twists}


def moved_covariance(covariance: Array, offset: Array) -> Array:
    """Covariance of (x, y, z, rx, ry, rz) about an origin displaced by `offset` (m, camera axes)."""
    x, y, z = offset
    J = np.eye(6)
    J[:3, 3:] = -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    moved: Array = J @ covariance @ J.T
    return moved
