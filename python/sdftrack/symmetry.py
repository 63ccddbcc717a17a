# SPDX-License-Identifier: MIT
"""Symmetries of shapes: given by a data set or found in a distance field, and equivalence of poses under them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import positive, shown
from sdftrack.geometry import rigid

Array = NDArray[np.float64]
M_PER_MM = 1e-3


def _none() -> Array:
    return np.zeros((0, 4, 4))


@dataclass(frozen=True, eq=False)
class Symmetry:
    """The rigid motions that map an object's shape onto itself, in the object frame.

    Attributes
    ----------
    discrete : (n, 4, 4) float64
        Rigid motions, excluding the identity.
    continuous : tuple of (axis, point)
        Axes of rotational symmetry: a unit vector and a point on each axis, m.

    Examples
    --------
    >>> can = Symmetry(continuous=(([0, 0, 1], [0, 0, 0]),))
    >>> turned = np.diag([-1.0, -1.0, 1.0, 1.0])
    >>> bool(np.allclose(can.canonical(turned), np.eye(4)))
    True
    """

    discrete: Array = field(default_factory=_none)
    continuous: tuple[tuple[Any, Any], ...] = ()

    def __post_init__(self) -> None:
        motions = np.asarray(self.discrete, np.float64)
        if motions.size == 0:
            motions = _none()
        if motions.ndim != 3 or motions.shape[1:] != (4, 4):
            raise ValueError(f"discrete: expected shape (n, 4, 4), got {motions.shape}")
        object.__setattr__(
            self,
            "discrete",
            np.array([rigid(S, f"discrete[{i}]") for i, S in enumerate(motions)]).reshape(-1, 4, 4),
        )
        axes = []
        for i, (axis, point) in enumerate(self.continuous):
            a, p = np.asarray(axis, np.float64), np.asarray(point, np.float64)
            length = np.linalg.norm(a) if a.shape == (3,) else np.nan
            if p.shape != (3,) or not np.isfinite(p).all() or not (np.isfinite(length) and length > 0):
                raise ValueError(
                    f"continuous[{i}]: expected (axis, point), three numbers each, got {shown(axis)}, {shown(point)}"
                )
            axes.append((a / length, p))
        object.__setattr__(self, "continuous", tuple(axes))

    def enlarged(self, factor: float) -> Symmetry:
        """The same of the shape enlarged about the origin of its frame."""
        discrete = self.discrete.copy()
        discrete[:, :3, 3] *= factor
        return Symmetry(
            discrete, tuple((axis, factor * np.asarray(point)) for axis, point in self.continuous)
        )

    @classmethod
    def from_bop(cls, info: Mapping[str, Any]) -> Symmetry:
        """Create from an object's entry in BOP's ``models_info.json`` (mm)."""
        motions = []
        for i, values in enumerate(info.get("symmetries_discrete", ())):
            try:
                S = np.reshape(np.asarray(values, np.float64), (4, 4)).copy()
            except (TypeError, ValueError, OverflowError):
                raise ValueError(
                    f"symmetries_discrete[{i}]: expected 16 numbers, got {shown(values)}"
                ) from None
            S[:3, 3] *= M_PER_MM
            motions.append(S)
        axes = []
        for i, values in enumerate(info.get("symmetries_continuous", ())):
            try:
                axes.append(
                    (values["axis"], M_PER_MM * np.asarray(values.get("offset", (0, 0, 0)), np.float64))
                )
            except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
                raise ValueError(
                    f"symmetries_continuous[{i}]: expected axis and offset of three numbers each, got {shown(values)}"
                ) from None
        return cls(np.array(motions) if motions else _none(), tuple(axes))

    def __bool__(self) -> bool:
        return bool(len(self.discrete) or self.continuous)

    def motions(self, steps: int | None = None) -> Array:
        """All symmetry motions (n, 4, 4), the identity first; continuous ones sampled at `steps` equal rotations.

        None: as many as needed for the farthest point to move by at most 1 % of the diameter per step, as in BOP.
        """
        count = _core.SYMMETRY_STEPS if steps is None else int(steps)
        if count < 1:
            raise ValueError(f"steps: expected at least 1, got {steps}")
        return _core.symmetry_motions(*self._core_args, count)

    def canonical(self, T: ArrayLike, near: ArrayLike | None = None) -> Array:
        """Among all poses equivalent to `T`, the one whose rotation is nearest to that of `near` (None: the identity).

        Exact for a continuous symmetry about one axis; about several axes (a ball), the rotation of `near`.
        """
        return _core.canonical_pose(
            *self._core_args, rigid(T), np.eye(4) if near is None else rigid(near, "near")
        )

    @property
    def _core_args(self) -> tuple[Array, Array]:
        """(n, 4, 4) motions without the identity, (m, 2, 3) axes."""
        return np.ascontiguousarray(self.discrete), np.reshape(self.continuous, (-1, 2, 3)).astype(np.float64)

    def to_dict(self) -> dict[str, Any]:
        """Convert to an entry of ``models_info.json`` (mm)."""
        motions = self.discrete.copy()
        motions[:, :3, 3] /= M_PER_MM
        return {
            "symmetries_discrete": [S.ravel().tolist() for S in motions],
            "symmetries_continuous": [
                {"axis": a.tolist(), "offset": (p / M_PER_MM).tolist()} for a, p in self.continuous
            ],
        }


def _turn(axis: Array, point: Array, angle: float) -> Array:
    S: Array = np.array(_core.rotation_exp((angle * np.asarray(axis)).tolist()))
    S[:3, 3] = point - S[:3, :3] @ point
    return S


def find_symmetries(sdf: Any, tolerance: float = 1.5) -> Symmetry:
    """Find the rotations that map a shape onto itself, from its distance field alone.

    Axes through the centroid of the surface, distributed over all directions, are tested with rotations by 1/2, 1/3,
    1/4, 1/5 and 1/6 of a full turn. The best are refined until the rotated surface coincides with itself, and their
    products are tested too. An axis is continuous if every rotation about it fits. Colours are ignored.

    Parameters
    ----------
    sdf : SDF
    tolerance : float
        In voxels: 98 % of the rotated surface must lie within this distance of the surface.

    Examples
    --------
    >>> from sdftrack import SDF
    >>> len(find_symmetries(SDF.box((0.1, 0.08, 0.06), voxels=40)).discrete)
    3
    """
    return _Search(sdf, tolerance).found()


class _Search:
    FOLDS = (2, 3, 4, 5, 6)
    DIRECTIONS, COARSE, BEST = 600, 150, 8
    APART = np.cos(np.deg2rad(10.0))  # of two axes
    SAME = np.deg2rad(25.0)  # of two rotations: those of a finite group are 60 degrees apart or more
    MAX_ROTATIONS = 60  # rotations of an icosahedron

    def __init__(self, sdf: Any, tolerance: float) -> None:
        self.sdf, self.limit = sdf, positive(tolerance, "tolerance") * sdf.voxel_size
        self.points = sdf.surface_samples(1500)[0].astype(np.float64)
        if not len(self.points):
            raise ValueError("sdf: expected a surface, got values of one sign only")
        self.centre = self.points.mean(axis=0)

    def found(self) -> Symmetry:
        good = [S for fold in self.FOLDS for S in self._of_fold(fold)]
        axes: list[Array] = []
        for S in good:
            a = _unit(np.array(_core.rotation_log(np.ascontiguousarray(S))))
            turns = (_turn(a, self.centre, angle) for angle in (0.4, 1.0, 1.9, 2.7))
            if all(abs(a @ b) < self.APART for b in axes) and all(map(self._fits, turns)):
                axes.append(a)
        if len(axes) > 1:
            across = _unit(axes[1] - (axes[0] @ axes[1]) * axes[0])
            return Symmetry(continuous=((axes[0], self.centre), (across, self.centre)))
        if axes:
            flips = [S for S in good if S[:3, :3] @ axes[0] @ axes[0] < -self.APART]
            return Symmetry(np.array(flips[:1]) if flips else _none(), ((axes[0], self.centre),))
        return Symmetry(self._closed(good))

    def _fits(self, S: Array) -> bool:
        away = np.abs(self.sdf(self.points @ S[:3, :3].T + S[:3, 3]))
        return bool(np.quantile(away, 0.98) < self.limit)

    def _of_fold(self, fold: int) -> list[Array]:
        """Refined rotations by 1/`fold` of a full turn that fit."""
        some = self.points[:: max(1, len(self.points) // self.COARSE)]
        axes = _half_sphere(self.DIRECTIONS)
        axes = np.concatenate([np.linalg.eigh(np.cov((self.points - self.centre).T))[1].T, np.eye(3), axes])
        turns = [_turn(a, self.centre, 2 * np.pi / fold) for a in axes]
        moved = np.concatenate([some @ S[:3, :3].T + S[:3, 3] for S in turns])
        away = np.abs(self.sdf(moved)).reshape(len(turns), -1).mean(axis=1)
        picked: list[int] = []
        for i in np.argsort(away):
            if all(abs(axes[i] @ axes[k]) < self.APART for k in picked):
                picked.append(int(i))
            if len(picked) == self.BEST:
                break
        refined = [self._refined(turns[i]) for i in picked]
        return [S for S in refined if np.linalg.norm(_core.rotation_log(S)) > self.SAME and self._fits(S)]

    def _refined(self, S: Array) -> Array:
        """The nearest motion that maps the surface onto itself, by Gauss-Newton on the moved points' distances."""
        some = self.points[::3]
        for _ in range(8):
            p = some @ S[:3, :3].T + S[:3, 3]
            r, g = self.sdf(p), self.sdf.gradient(p)
            J = np.concatenate([np.cross(p - self.centre, g), g], axis=1)
            weight = 1 / np.maximum(1, np.abs(r) / (2 * self.sdf.voxel_size))
            H = (J * weight[:, None]).T @ J
            step = np.linalg.lstsq(H + 1e-6 * np.diag(np.diag(H)), -(J * weight[:, None]).T @ r, rcond=None)[
                0
            ]
            D = _turn(step[:3], self.centre, 1.0)
            D[:3, 3] += step[3:]
            S = D @ S
        return S

    def _closed(self, good: list[Array]) -> Array:
        """The group generated by the rotations; each member is verified on the shape."""
        group: list[Array] = [np.eye(4)]

        def new(S: Array) -> bool:
            # Of a rotation by an angle the trace is 1 + 2 cos.
            return all(np.trace(G[:3, :3].T @ S[:3, :3]) < 1 + 2 * np.cos(self.SAME) for G in group)

        for S in good:
            if len(group) < self.MAX_ROTATIONS and new(S):
                group.append(S)
        at = 0
        while at < len(group) and len(group) < self.MAX_ROTATIONS:
            for other in list(group):
                S = rigid(self._refined(group[at] @ other))
                if len(group) < self.MAX_ROTATIONS and new(S) and self._fits(S):
                    group.append(S)
            at += 1
        return np.array(group[1:]).reshape(-1, 4, 4)


def _unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v))


def _half_sphere(count: int) -> Array:
    """Directions spread evenly (a Fibonacci lattice), one of each opposite pair."""
    i = np.arange(count) + 0.5
    z, angle = 1 - i / count, np.pi * (1 + np.sqrt(5)) * i
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
