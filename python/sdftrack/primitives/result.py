# SPDX-License-Identifier: MIT
"""The kinds of primitives, and the result of fitting one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.array_equality import Compared
from sdftrack.mesh import Mesh
from sdftrack.results import Status
from sdftrack.sdf import SDF
from sdftrack.sdf.grid import MAX_VOXELS, distances_of_solid, grid_round


@dataclass(frozen=True)
class Kind:
    """One kind."""

    name: str
    sizes: tuple[
        str, ...
    ]  # names of its lengths, m, then its exponents; the order of the covariance's columns
    size_axes: tuple[
        int, ...
    ]  # of each length, the axis along which the centre is uncertain if the length is; -1: an exponent
    extent: tuple[
        tuple[int, float], ...
    ]  # along x, y, z: index of the length (-1: none), its share on either side
    unknowns: int  # that a view can determine: a ball has no orientation, a round body no turn about its axis
    has_inside: bool  # and so a distance volume
    in_auto: bool  # whether kind="auto" compares it

    @property
    def member(self) -> _core.PrimitiveKind:
        """The member in the core."""
        return _core.PrimitiveKind.__members__[self.name]

    @property
    def is_length(self) -> NDArray[np.bool_]:
        """Which sizes are lengths; the others are exponents."""
        return np.array(self.size_axes) >= 0

    def half_extent(self, lengths: list[float]) -> list[float]:
        """Distance from the centre to the farthest point along x, y and z, m."""
        return [lengths[i] * half if i >= 0 else 0.0 for i, half in self.extent]


TABLE = {kind["name"]: Kind(**kind) for kind in _core.primitive_kinds()}
KINDS = tuple(TABLE)
SOLIDS = tuple(name for name, kind in TABLE.items() if kind.in_auto)
SIZES = {name: kind.sizes for name, kind in TABLE.items()}
FREE = {name: kind.unknowns for name, kind in TABLE.items()}


@dataclass(frozen=True, eq=False)
class PrimitiveFit(Compared):
    """A primitive's pose and size, and their uncertainty.

    Attributes
    ----------
    kind : {"sphere", "cylinder", "cone", "box", "ellipsoid", "plane", "superquadric"}
    T_cam_obj : (4, 4) float64
        Maps object to camera (for points: to their frame), m. Origin at the centre, axis along z, a cone's apex at +z,
        a patch's normal along z and towards the camera.
    size : dict of str to float
        Lengths, m: ``radius`` of a sphere; ``radius`` and ``height`` of a cylinder or cone; the full edges ``x``,
        ``y``, ``z`` of a box; the radii ``rx``, ``ry``, ``rz`` of an ellipsoid, both in descending order unless an
        initial value has named the axes; ``width`` (along x) and
        ``height`` (along y) of a plane patch, in either order. Of a superquadric the half axes ``rx`` >= ``ry``, ``rz``
        and the exponents ``e1``, ``e2``, without unit: |x / rx|^(2 / e2) + |y / ry|^(2 / e2) to the power e2 / e1, plus
        |z / rz|^(2 / e1), is 1.
    covariance : (6 + n, 6 + n) float64
        First the pose, (x, y, z, rx, ry, rz) in m and rad about the origin in camera axes as in `TrackResult`, then
        the n sizes in the order of `size`. A length that is not bounded has infinite variance, and its value is a
        lower bound given by the observation; so has an exponent that is not determined. Unobservable rotations have
        (pi rad)^2.
    rms : float
        RMS distance (m) of the measurements within 3 mm of the surface (more beyond 1 m: depth noise grows with the
        square).
    inliers : float
        Fraction of those measurements.
    status : Status
        ``"ok"``; ``"weak"``: a length is not bounded, or less than 60 % of the measurements are on the surface;
        ``"lost"``: less than 20 %.
    reason : str
        Reason for a status other than ``"ok"``.
    scores : dict of str to float
        Score of each kind that was tested, 0..1, best first: its probability among them (by a Bayesian information
        criterion) times the fraction of measurements on its surface and, for a frame, the fraction of silhouette pixels
        explained to within a pixel. Two kinds that a view does not distinguish have similar scores. For a single kind,
        only the fractions.
    per_frame : tuple of PrimitiveFit
        For several frames, the fits that contribute to the size; else empty.
    skipped : dict of int to str
        For several frames, the excluded ones and the reasons, by frame index from 0.
    """

    kind: str
    T_cam_obj: NDArray[np.float64]
    size: dict[str, float]
    covariance: NDArray[np.float64]
    rms: float
    inliers: float
    status: Status
    reason: str = ""
    scores: dict[str, float] = field(default_factory=dict)
    per_frame: tuple[PrimitiveFit, ...] = ()
    skipped: dict[int, str] = field(default_factory=dict)

    @cached_property
    def sdf(self) -> SDF:
        """Distance volume (100 voxels along the longest side) for tracking.

        ValueError for a plane patch, which has no inside: see `plate`.
        """
        if not TABLE[self.kind].has_inside:
            raise ValueError(
                "sdf: expected a solid, got a plane patch, which has no inside and so no signed distance; track "
                "fit.plate() in its place"
            )
        return volume_of(self.kind, self.size)

    def plate(self, voxels: int = 100) -> SDF:
        """Distance volume of a plate whose front is this plane patch, in the same frame, for tracking.

        Its sides slope inwards, so that it is hidden behind the patch in every view within 60 degrees of the normal.

        Parameters
        ----------
        voxels : int
            Number of voxels along the longest side.

        Raises
        ------
        ValueError
            The fit is of another kind.

        >>> tracker = st.Tracker(fit.plate(), camera)  # doctest: +SKIP
        """
        if self.kind != "plane":
            raise ValueError(f"plate: expected a fit of kind 'plane', got '{self.kind}'; use fit.sdf")
        return volume_of(self.kind, self.size, voxels)

    def to_mesh(self) -> Mesh:
        """Surface mesh, object frame, m: by marching cubes of `sdf` for a solid, two triangles for a plane patch."""
        if TABLE[self.kind].has_inside:
            return self.sdf.to_mesh()
        x, y = self.size["width"] / 2, self.size["height"] / 2
        return Mesh([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]], [[0, 1, 2], [0, 2, 3]])

    @property
    def bounded(self) -> dict[str, bool]:
        """Which sizes are bounded by the measurements."""
        return dict(zip(self.size, np.isfinite(np.diag(self.covariance)[6:]).tolist(), strict=True))

    @property
    def ok(self) -> bool:
        """Whether the status is ``"ok"``."""
        return self.status is Status.OK

    def sizes_in_words(self, sd: NDArray[np.float64] | None = None) -> str:
        """Lengths in mm and exponents, with their standard deviations if given."""
        words = []
        for i, (name, value) in enumerate(self.size.items()):
            scale, digits, unit = (1e3, 1, " mm") if TABLE[self.kind].is_length[i] else (1.0, 2, "")
            spread = "" if sd is None else f" +- {scale * sd[i]:.{digits}f}"
            words.append(f"{name} {scale * value:.{digits}f}{spread}{unit}")
        return ", ".join(words)

    def __repr__(self) -> str:
        sizes = self.sizes_in_words(np.sqrt(np.diag(self.covariance)[6:]))
        return f"PrimitiveFit({self.kind}: {sizes}; rms {1e3 * self.rms:.1f} mm, {self.status.value})"

    def to_dict(self) -> dict[str, object]:
        """Convert to lists and numbers for JSON; None for non-finite values."""
        finite = [[float(v) if np.isfinite(v) else None for v in row] for row in self.covariance]
        return {
            "kind": self.kind,
            "T_cam_obj": self.T_cam_obj.tolist(),
            "size": dict(self.size),
            "bounded": self.bounded,
            "covariance": finite,
            "rms": self.rms if np.isfinite(self.rms) else None,
            "inliers": self.inliers,
            "status": self.status.value,
            "reason": self.reason,
            "scores": dict(self.scores),
            "skipped": {str(i): why for i, why in self.skipped.items()},
        }


def with_size(fit: PrimitiveFit, size: NDArray[np.float64], covariance: NDArray[np.float64]) -> PrimitiveFit:
    """The fit with other lengths, m, that do not depend on its pose, and their covariance."""
    whole = fit.covariance.copy()
    whole[6:, :] = whole[:, 6:] = 0
    whole[6:, 6:] = covariance
    return replace(fit, size=dict(zip(fit.size, size.tolist(), strict=True)), covariance=whole)


def volume_of(kind: str, size: dict[str, float], voxels: int = 100) -> SDF:
    """Distance volume of a solid with these lengths (m); for a plane patch that of a plate behind it."""
    known = TABLE[kind]
    lengths = [size[name] for name in known.sizes]
    if not known.has_inside:
        return plate_of(lengths[0], lengths[1], voxels)
    half = np.array(known.half_extent(lengths))
    return SDF(*distances_of_solid(kind, lengths, half, voxels, None))


# -- Proxy volume for a plane patch: a plate hidden behind it


TAN_HIDDEN = math.sqrt(3)  # of 60 degrees: views within that see no side of the plate
DEPTH = 0.8  # of the depth at which its sides would meet: the farther its back, the fewer measurements are drawn to it
MIN_VOXELS = 5  # along the depth, else the volume has no inside to speak of


def plate_of(width: float, height: float, voxels: int) -> SDF:
    """A frustum (m) whose front is the rectangle at z = 0, with at least this many voxels along its longest side."""
    depth = DEPTH * min(width, height) / (2 * TAN_HIDDEN)
    vertices, faces = _frustum(width, height, depth, depth * TAN_HIDDEN)
    voxels = max(voxels, min(MAX_VOXELS, math.ceil(MIN_VOXELS * max(width, height) / depth)))
    voxel_size, shape, origin = grid_round(vertices.min(axis=0), vertices.max(axis=0), voxels, None)
    values, _ = _core.mesh_to_sdf(vertices, faces, shape, voxel_size, list(origin))
    return SDF(values, voxel_size, origin)


def _frustum(
    width: float, height: float, depth: float, inset: float
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
    front = np.column_stack([corners * [width, height], np.zeros(4)])
    back = np.column_stack([corners * [width - 2 * inset, height - 2 * inset], np.full(4, -depth)])
    faces = [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]]
    for i in range(4):
        j = (i + 1) % 4
        faces += [[i, i + 4, j], [j, i + 4, j + 4]]
    return np.concatenate([front, back]), np.array(faces, np.int32)
