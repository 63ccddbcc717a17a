# SPDX-License-Identifier: MIT
"""The mapping from points of the depth camera to colour pixels, in two forms, with derivatives.

Projective: ``lambda x' = P (Z x) + q`` (thesis Eq. 3.25), stored as ``M = [P K | q]`` on points in metres, 12
parameters up to scale. Rigid: ``x' = pi(T_color_depth p)`` with a known colour camera, 6 numbers.
docs/math/color_to_depth.md, eq. 1, 11 and 12.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.array_equality import Compared
from sdftrack.camera import Camera

Array = NDArray[np.float64]


class _Mapped(Compared):
    """What both maps do, by the core's map."""

    depth: Camera

    @property
    def _core_map(self) -> Any:
        raise NotImplementedError

    def predict(self, p_cam: Array) -> tuple[Array, Array]:
        """Pixels (N, 2) of points (N, 3) and their derivatives by the unknowns (N, 2, n)."""
        px, J = self._core_map.predict(np.ascontiguousarray(p_cam, dtype=np.float64))
        return px, J

    def Pq(self) -> tuple[Array, Array]:
        """(P, q) of Eq. 3.25, with lambda the depth (m) in the colour camera; of a rigid map for ideal pixels."""
        P, q, _ = self._core_map.Pq(self.depth._core)
        return P, q

    def Pq_jacobian(self) -> Array:
        """(12, n) derivatives of (P row by row, q) by the unknowns, at fixed scale."""
        J: Array = self._core_map.Pq(self.depth._core)[2]
        return J


@dataclass(frozen=True, eq=False)
class ProjectiveMap(_Mapped):
    """``y = M (p, 1)``, pixel ``y_01 / y_2``; `M` is (3, 4), `depth` the depth camera."""

    M: Array
    depth: Camera
    unknowns = 12

    @property
    def _core_map(self) -> Any:
        return _core.DepthToColor.projective(self.M)


@dataclass(frozen=True, eq=False)
class RigidMap(_Mapped):
    """The colour camera at `T_color_depth`; unknowns (v, w): T <- exp(v, w) T, metres and radians."""

    T_color_depth: Array
    color: Camera
    depth: Camera
    unknowns = 6

    @property
    def _core_map(self) -> Any:
        return _core.DepthToColor.rigid(self.T_color_depth, self.color._core)
