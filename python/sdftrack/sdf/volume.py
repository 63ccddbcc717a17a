# SPDX-License-Identifier: MIT
"""The signed distance volume."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal import saved_file
from sdftrack._internal.array_equality import same
from sdftrack._internal.rotations import rigid_pose
from sdftrack._internal.validation import number, numbers, one_of, shown, whole
from sdftrack.device import device_number
from sdftrack.geometry import inverse
from sdftrack.mesh import Mesh, core_camera, unit_scale
from sdftrack.sdf.from_mesh import MeshReport, distances_of_mesh, mesh_of
from sdftrack.sdf.grid import (
    MAX_ORIGIN,
    MAX_VOXEL,
    MIN_VOXEL,
    distances_of_solid,
    resample,
    shape_zyx,
    three_lengths,
    voxels_between,
)

if TYPE_CHECKING:
    import trimesh

FILE = saved_file.FileKind("sdftrack.SDF", 1, "SDF.save")
MOST_SAMPLES = 10_000_000  # of 24 bytes each
COLOR_REACH_VOXELS = 3.0  # from the surface


class SDF:
    """Signed distance volume: metres, negative inside.

    Parameters
    ----------
    values : (nz, ny, nx) float32
        Signed distance (m) at voxel centres; kept as a read-only copy. At least 2 voxels along each axis.
    voxel_size : float
        m.
    origin : (3,) array
        Object coordinates (x, y, z) of the centre of voxel [0, 0, 0], m.
    colors : (nz, ny, nx, 4) uint8, optional
        RGBA of the surface, stored in nearby voxels; alpha 0: unknown. See :meth:`colored`.

    Attributes
    ----------
    report : MeshReport or None
        Report of `from_mesh`; None for other sources. Not compared, not saved.

    Examples
    --------
    >>> ball = SDF.sphere(0.05, voxels=40)
    >>> abs(float(ball([[0.1, 0.0, 0.0]])[0]) - 0.05) < 1e-3
    True
    """

    __slots__ = ("_colors", "_id", "_origin", "_values", "_voxel_size", "report")
    __hash__ = None  # type: ignore[assignment]

    def __init__(
        self, values: ArrayLike, voxel_size: float, origin: ArrayLike, colors: ArrayLike | None = None
    ) -> None:
        v = checked_values(values, "values")
        size = number(voxel_size, "voxel_size")
        if not MIN_VOXEL <= size <= MAX_VOXEL:
            raise ValueError(
                f"voxel_size: expected a positive number of metres, from {MIN_VOXEL:g} to {MAX_VOXEL:g}, "
                f"got {voxel_size}"
            )
        o = numbers(origin, "origin").copy()
        if o.shape != (3,) or not (np.abs(o) <= MAX_ORIGIN).all():
            raise ValueError(
                f"origin: expected three finite numbers (x, y, z) in metres, at most {MAX_ORIGIN:g}, "
                f"got {shown(origin)}"
            )
        rgba = None if colors is None else _checked_colors(colors, v.shape)
        self._set(np.array(v, order="C"), size, o, rgba)

    def _set(
        self,
        values: NDArray[np.float32],
        voxel_size: float,
        origin: NDArray[np.float64],
        colors: NDArray[np.uint8] | None,
    ) -> None:
        for array in (values, origin, colors):
            if array is not None:
                array.setflags(write=False)
        self._values, self._voxel_size, self._origin, self._colors = values, voxel_size, origin, colors
        self._id = _core.new_volume_id()  # by which a GPU knows the values
        self.report: MeshReport | None = None

    @classmethod
    def _own(
        cls,
        values: NDArray[np.float32],
        voxel_size: float,
        origin: ArrayLike,
        colors: NDArray[np.uint8] | None = None,
    ) -> SDF:
        """Create without copy or validation, for arrays just created by the core."""
        sdf = cls.__new__(cls)
        sdf._set(values, float(voxel_size), np.array(origin, dtype=np.float64), colors)
        return sdf

    # ---- sources ----

    @classmethod
    def from_mesh(
        cls,
        mesh: str | os.PathLike[str] | Mesh | trimesh.Trimesh | tuple[ArrayLike, ArrayLike],
        voxels: int = 200,
        padding: float | None = None,
        *,
        unit: Literal["m", "mm", "cm", "in"] | None = None,
        holes: Literal["error", "close"] = "error",
        color: bool = False,
        threads: int = 0,
    ) -> SDF:
        """Signed distance volume of a mesh (docs/math/mesh_to_sdf.md).

        Within 6 voxels of the surface the distance to the nearest triangle is exact; farther away it is computed by
        fast sweeping. The sign is given by the winding number.

        Parameters
        ----------
        mesh : path, Mesh, trimesh.Trimesh or (vertices, faces)
        voxels : int
            Number of voxels along the longest side, including padding.
        padding : float, optional
            Free space on each face, a fraction of the longest side. None: 0.1 and at least 25 mm. Never less
            than 2 voxels.
        unit : "m", "mm", "cm" or "in", optional
            Unit of the mesh. None: metres, and a longest side over 3 m or under 3 mm is an error.
        holes : "error" or "close"
            Treatment of an open mesh: raise an error, or close it by the generalised winding number. A mesh whose gaps
            are narrower than a voxel is closed in both cases, with a warning.
        color : bool
            Also use the colours of the mesh's vertices, see :meth:`colored`.
        threads : int
            0: all cores. The result does not depend on it.

        Returns
        -------
        SDF
            With `report`.

        Raises
        ------
        FileNotFoundError, TypeError
            No such file; not a mesh.
        ValueError
            Empty or open mesh, non-finite coordinates, a size that suggests another unit, too few voxels (shortest side
            under 4).

        Warns
        -----
        UserWarning
            Parts thinner than 2 voxels (with the number of voxels to use). Repairs: flipped faces and inside-out parts
            (re-oriented), double-sided faces (one side kept), unused non-finite vertices (removed), self-intersections
            (outside where the winding number is below 1/2).
        """
        one_of(holes, ("error", "close"), "holes")
        mesh = mesh_of(mesh)
        values, voxel_size, origin, report = distances_of_mesh(
            mesh, voxels, padding, unit, holes, color, threads
        )
        sdf = cls._own(values, voxel_size, origin)
        if color:
            sdf = sdf.colored(mesh, unit=unit, threads=threads)
        sdf.report = report
        return sdf

    @classmethod
    def sphere(cls, radius: float, *, voxels: int = 200, padding: float | None = None) -> SDF:
        """Ball of the given radius (m), centre at the origin."""
        return cls._own(*distances_of_solid("sphere", [radius], np.full(3, radius), voxels, padding))

    @classmethod
    def box(cls, size: ArrayLike, *, voxels: int = 200, padding: float | None = None) -> SDF:
        """Box with full edges `size` = (x, y, z), m, centre at the origin."""
        edges = three_lengths(size, "size")
        return cls._own(*distances_of_solid("box", list(edges), edges / 2, voxels, padding))

    @classmethod
    def cylinder(
        cls, radius: float, height: float, *, voxels: int = 200, padding: float | None = None
    ) -> SDF:
        """Cylinder, axis along z, origin at mid-height; m."""
        half = np.array([radius, radius, height / 2])
        return cls._own(*distances_of_solid("cylinder", [radius, height], half, voxels, padding))

    @classmethod
    def cone(cls, radius: float, height: float, *, voxels: int = 200, padding: float | None = None) -> SDF:
        """Cone, axis along z, apex at +height / 2, base of `radius` at -height / 2; m."""
        half = np.array([radius, radius, height / 2])
        return cls._own(*distances_of_solid("cone", [radius, height], half, voxels, padding))

    @classmethod
    def ellipsoid(cls, radii: ArrayLike, *, voxels: int = 200, padding: float | None = None) -> SDF:
        """Ellipsoid with semi-axes `radii` = (x, y, z), m; the exact distance, not a scaled sphere's."""
        r = three_lengths(radii, "radii")
        return cls._own(*distances_of_solid("ellipsoid", list(r), r, voxels, padding))

    # ---- what it is ----

    @property
    def values(self) -> NDArray[np.float32]:
        """(nz, ny, nx) float32, m, read-only."""
        return self._values

    @property
    def voxel_size(self) -> float:
        """Metres."""
        return self._voxel_size

    @property
    def origin(self) -> NDArray[np.float64]:
        """(3,) float64: object coordinates (x, y, z) of the centre of voxel [0, 0, 0], m, read-only."""
        return self._origin

    @property
    def colors(self) -> NDArray[np.uint8] | None:
        """(nz, ny, nx, 4) uint8: RGBA of the surface in nearby voxels, alpha 0 elsewhere; None without colours."""
        return self._colors

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) float64: lowest and highest voxel centre, m."""
        return np.stack(
            [self._origin, self._origin + self._voxel_size * (np.array(self._values.shape[::-1]) - 1)]
        )

    def __call__(self, points: ArrayLike) -> NDArray[np.float64]:
        """Signed distance (m) at points (..., 3), m, object frame; trilinear.

        Outside the volume it is extrapolated as phi(q) + |p - q|, with q the nearest point of the volume.
        """
        return self._sampled(points)[0]

    def gradient(self, points: ArrayLike) -> NDArray[np.float64]:
        """Gradient of the same interpolant at points (..., 3): (..., 3), dimensionless, exact within each cell."""
        return self._sampled(points)[1]

    def _sampled(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        p = numbers(points, "points")
        if p.ndim == 0 or p.shape[-1] != 3:
            raise ValueError(f"points: expected shape (..., 3), got {p.shape}")
        if not np.isfinite(p).all():
            raise ValueError("points: expected finite coordinates")
        flat = np.ascontiguousarray(p.reshape(-1, 3))
        phi, gradient = _core.sample_sdf(*self._core_args, flat)
        return phi.reshape(p.shape[:-1]), gradient.reshape(p.shape)

    @property
    def _core_args(self) -> tuple[NDArray[np.float32], float, list[float]]:
        return self._values, self._voxel_size, [float(x) for x in self._origin]

    # ---- made from it ----

    def transformed(self, T: ArrayLike) -> SDF:
        """The shape transformed by a rigid 4x4 (p -> T p), resampled on the transformed volume's box, without colours.

        A pure translation only moves the origin.
        """
        M = rigid_pose(T, "T")
        if np.array_equal(M[:3, :3], np.eye(3)):
            return SDF._own(self._values, self._voxel_size, self._origin + M[:3, 3], self._colors)
        low, high = self.bounds
        corners = np.array(
            [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
        )
        moved = corners @ M[:3, :3].T + M[:3, 3]
        low, high = moved.min(axis=0), moved.max(axis=0)
        n = voxels_between(low, high, self._voxel_size, [self], "T")
        shape, origin = shape_zyx(n), (low + high) / 2 - (n - 1) * self._voxel_size / 2
        return SDF._own(resample(self, shape, self._voxel_size, origin, inverse(M)), self._voxel_size, origin)

    def colored(
        self,
        mesh: str | os.PathLike[str] | Mesh | trimesh.Trimesh,
        *,
        unit: Literal["m", "mm", "cm", "in"] | None = None,
        threads: int = 0,
    ) -> SDF:
        """The shape with the colours of a mesh, which let a tracker resolve rotations that the shape does not.

        Each voxel within 3 voxels of the mesh gets the colour of the nearest point, interpolated between the vertices
        of the face. Detail between vertices (a texture) is lost: use a mesh with vertex spacing similar to the voxel
        size.

        Raises ValueError if the mesh has no vertex colours, or is not near the surface.
        """
        m = mesh_of(mesh)
        if m.colors is None:
            raise ValueError("mesh: expected colours at its vertices, got none")
        reach = COLOR_REACH_VOXELS * self._voxel_size
        vertices, rgb = m.vertices * unit_scale(unit), np.ascontiguousarray(m.colors)
        rgba = _core.paint(vertices, m.faces, rgb, *self._core_args, reach, threads)
        if not rgba[..., 3].any():
            raise ValueError(
                "mesh: no part of it is near the surface of this shape; is it in another unit or frame? pass unit='mm'"
            )
        return SDF._own(self._values, self._voxel_size, self._origin, rgba)

    def cropped(self, margin_voxels: int = 16) -> SDF:
        """The shape in the smallest volume that contains it with a margin, for smaller files.

        Raises ValueError if nothing is inside.
        """
        part = part_inside(self._values, whole(margin_voxels, "margin_voxels", 0))
        if part is None:
            raise ValueError("cropped: expected a shape, got a volume that is outside everywhere")
        low = np.array([along.start for along in part])
        colors = None if self._colors is None else np.ascontiguousarray(self._colors[part])
        origin = self._origin + self._voxel_size * low[::-1]
        return SDF._own(np.ascontiguousarray(self._values[part]), self._voxel_size, origin, colors)

    def redistanced(self, threads: int = 0, *, device: str = "cpu") -> SDF:
        """Distance field with the same zero set: restores |gradient| = 1 after blending or evolution.

        `threads`, `device` as of `render`. Raises ValueError if the field has only one sign.
        """
        return SDF._own(
            _core.redistance(self._values, self._voxel_size, threads, device_number(device)),
            self._voxel_size,
            self._origin,
            self._colors,
        )

    def to_mesh(self, *, device: str = "cpu") -> Mesh:
        """Surface mesh by marching cubes, faces outwards, m, object frame.

        Where a face of a cell has two corners inside that lie opposite each other, the surface separates them.

        Parameters
        ----------
        device : {"cpu", "cuda", "cuda:N", "auto"}
            The mesh is the same.

        Raises
        ------
        ValueError
            No surface: all values have one sign.
        """
        number = device_number(device)
        if not (self._values.min() < 0 < self._values.max()):
            raise ValueError("sdf: no surface (all values have one sign)")
        voxels, faces = _core.zero_mesh(self._values, 0, number)
        return Mesh(voxels * self._voxel_size + self._origin, faces)

    def surface_samples(self, count: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Points (N, 3) float32, m, evenly distributed over the surface, and outward unit normals; deterministic.

        At most `count`, which is at most ten million.
        """
        return _core.surface_samples(*self._core_args, whole(count, "count", 0, MOST_SAMPLES))

    def render(
        self, camera: Any, T_cam_obj: ArrayLike, threads: int = 0, *, device: str = "cpu"
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Depth and normals as a noise-free camera would see them.

        Parameters
        ----------
        camera : Camera or RGBDCamera (its depth camera)
        T_cam_obj : (4, 4) float64
            Maps object points (m) to the camera frame.
        threads : int
            0: all cores. The result does not depend on it.
        device : {"cpu", "cuda", "cuda:N", "auto"}
            The images are the same. A GPU keeps the last eight volumes, so that further images of one are not delayed
            by its transfer. "auto" selects a GPU if its self-test has passed.

        Returns
        -------
        depth : (H, W) float32
            z in metres, 0 where nothing is hit.
        normals : (H, W, 3) float32
            Unit gradient of the field at the hit, camera frame; 0 where nothing is hit.
        """
        T, number = numbers(T_cam_obj, "T_cam_obj"), device_number(device)
        return _core.render_sdf(*self._core_args, core_camera(camera), T, threads, number, self._id)

    def silhouette(
        self, camera: Any, T_cam_obj: ArrayLike, threads: int = 0, *, device: str = "cpu"
    ) -> NDArray[np.bool_]:
        """(H, W) bool: the pixels whose ray hits the shape. Arguments as of `render`."""
        return self.render(camera, T_cam_obj, threads, device=device)[0] > 0

    # ---- kept ----

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write an .npz file (values, voxel_size, origin, and colors if present), completely or not at all."""
        arrays = {"values": self._values, "voxel_size": np.array(self._voxel_size), "origin": self._origin}
        colors = {} if self._colors is None else {"colors": self._colors}
        saved_file.write(path, FILE, {**arrays, **colors}, compress=True)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> SDF:
        """Load a file written by `save`, or ``numpy.savez``. FileNotFoundError; ValueError for an invalid file."""

        def volume(data: Any) -> SDF:
            return cls(data["values"], float(data["voxel_size"]), data["origin"], data.get("colors"))

        return saved_file.read(path, FILE, volume, plain=("values", "voxel_size", "origin", "colors"))

    def __reduce__(self) -> tuple[Any, ...]:
        return (SDF, (self._values, self._voxel_size, self._origin, self._colors))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, SDF):
            return NotImplemented
        return same(self.__reduce__()[1], other.__reduce__()[1])

    def __repr__(self) -> str:
        nz, ny, nx = self._values.shape
        coloured = ", coloured" if self._colors is not None else ""
        return f"SDF({nx} x {ny} x {nz} voxels of {1e3 * self._voxel_size:.3g} mm{coloured})"

    def _repr_png_(self) -> bytes:
        from sdftrack.mesh.shaded_picture import shaded_picture

        low, high = self.bounds
        return shaded_picture(self.render, low, high)


def checked_values(values: ArrayLike, name: str) -> NDArray[np.float32]:
    """Finite float32 [z, y, x], C-contiguous, or an error that names the argument."""
    v = np.asarray(values)
    if v.dtype != np.float32:
        raise TypeError(f"{name}: expected float32, got {v.dtype}; convert with {name}.astype(np.float32)")
    if v.ndim != 3 or min(v.shape) < 2:
        raise ValueError(f"{name}: expected shape [z, y, x] with at least 2 voxels an axis, got {v.shape}")
    if not np.isfinite(v).all():
        raise ValueError(f"{name}: expected finite numbers, got NaN or infinity; fill or crop them first")
    return np.ascontiguousarray(v)


def _checked_colors(colors: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    rgba = np.array(colors, order="C")
    if rgba.dtype != np.uint8:
        raise TypeError(f"colors: expected uint8, got {rgba.dtype}")
    if rgba.shape != (*shape, 4):
        raise ValueError(f"colors: expected RGBA beside the values, {(*shape, 4)}, got {rgba.shape}")
    return rgba


def shape_list(shapes: SDF | Sequence[SDF]) -> list[SDF]:
    """One or more shapes as a list."""
    several = isinstance(shapes, (list, tuple))
    many: list[Any] = list(shapes) if isinstance(shapes, (list, tuple)) else [shapes]
    if not many:
        raise ValueError("shapes: expected at least one SDF, got none")
    for k, shape in enumerate(many):
        if not isinstance(shape, SDF):
            name = f"shapes[{k}]" if several else "shapes"
            raise TypeError(
                f"{name}: expected an SDF, got {type(shape).__name__}; make one with SDF.from_mesh"
            )
    return many


def part_inside(values: NDArray[np.float32], margin: int) -> tuple[slice, slice, slice] | None:
    """The smallest part (z, y, x) of a field with all that is inside, and `margin` voxels around it; None: nothing."""
    inside = values <= 0
    layers = [np.flatnonzero(inside.any(axis=others)) for others in ((1, 2), (0, 2), (0, 1))]
    if not len(layers[0]):
        return None
    z, y, x = (
        slice(max(int(at[0]) - margin, 0), min(int(at[-1]) + 1 + margin, n))
        for at, n in zip(layers, values.shape, strict=True)
    )
    return z, y, x
