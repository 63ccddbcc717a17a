# SPDX-License-Identifier: MIT
"""Signed distance volumes: from meshes and formulas, sampled, moved, joined, rendered, saved."""

from __future__ import annotations

import io
import os
import warnings
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack.checks import number, numbers
from sdftrack.io.files import write_whole
from sdftrack.mesh import Mesh, core_camera, unit_scale, vertex_colors

if TYPE_CHECKING:
    import trimesh

__all__ = ["SDF", "MeshReport", "smooth_union", "union"]

MIN_PADDING = 0.025  # m; a hand at 1 m/s moves 33 mm between two frames
LARGEST, SMALLEST = 3.0, 3e-3  # m; a side beyond these is more likely a wrong unit than an object
THIN_FRACTION = 0.02  # of the surface: less than that is the rim of an edge, more is a wall
MAX_VOXELS = 1200  # along one side
COLOR_REACH_VOXELS = 3.0  # from the surface

Shape3 = tuple[int, int, int]


@dataclass(frozen=True)
class MeshReport:
    """What a mesh was like before it became a distance field; all of it after merging equal vertices.

    Attributes
    ----------
    watertight : bool
        Every edge is used as often one way as the other, so there is an inside.
    merged_vertices, degenerate_faces, duplicate_faces, flipped_faces : int
        Repaired: equal vertices merged, faces without area or given twice dropped, faces turned against their
        neighbours turned back.
    open_edges, non_manifold_edges : int
        Edges in one face only, in more than two.
    parts : int
        Connected pieces.
    volume : float
        m^3; of an open mesh, meaningless.
    thinnest : float
        m; all but the thinnest 2 % of the surface have at least this much material behind them.
    """

    watertight: bool
    merged_vertices: int
    degenerate_faces: int
    duplicate_faces: int
    flipped_faces: int
    open_edges: int
    non_manifold_edges: int
    parts: int
    volume: float
    thinnest: float


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
        RGBA of the surface, on the voxels beside it; alpha 0: not known. See :meth:`colored`.

    Attributes
    ----------
    report : MeshReport or None
        What `from_mesh` found; None for other sources. Not part of a comparison, not saved.

    Examples
    --------
    >>> ball = SDF.sphere(0.05, voxels=40)
    >>> abs(float(ball([[0.1, 0.0, 0.0]])[0]) - 0.05) < 1e-3
    True
    """

    __slots__ = ("_colors", "_origin", "_values", "_voxel_size", "report")
    __hash__ = None  # type: ignore[assignment]

    def __init__(
        self, values: ArrayLike, voxel_size: float, origin: ArrayLike, colors: ArrayLike | None = None
    ) -> None:
        v = np.asarray(values)
        if v.dtype != np.float32:
            raise TypeError(
                f"values: expected float32, got {v.dtype}; convert with values.astype(np.float32)"
            )
        if v.ndim != 3 or min(v.shape) < 2:
            raise ValueError(
                f"values: expected shape [z, y, x] with at least 2 voxels an axis, got {v.shape}"
            )
        size = number(voxel_size, "voxel_size")
        if not (np.isfinite(size) and size > 0):
            raise ValueError(f"voxel_size: expected a positive number of metres, got {voxel_size}")
        o = numbers(origin, "origin").copy()
        if o.shape != (3,) or not np.isfinite(o).all():
            raise ValueError(f"origin: expected three finite numbers (x, y, z) in metres, got {origin!r}")
        if not np.isfinite(v).all():
            raise ValueError(
                "values: expected finite distances, got NaN or infinity; fill or crop them first"
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
        self.report: MeshReport | None = None

    @classmethod
    def _own(
        cls,
        values: NDArray[np.float32],
        voxel_size: float,
        origin: ArrayLike,
        colors: NDArray[np.uint8] | None = None,
    ) -> SDF:
        """Without copy or check: for arrays that the core has just made."""
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

        Within 6 voxels of the surface the distance to the nearest triangle, exactly; farther out by fast
        sweeping. The sign is the winding number's.

        Parameters
        ----------
        mesh : path, Mesh, trimesh.Trimesh or (vertices, faces)
        voxels : int
            Along the longest side, padding included.
        padding : float, optional
            Free space on each face, a fraction of the longest side. None: 0.1 and at least 25 mm. Never less
            than 2 voxels.
        unit : "m", "mm", "cm" or "in", optional
            Unit of the mesh. None: metres, and a longest side over 3 m or under 3 mm is an error.
        holes : "error" or "close"
            What to do with an open mesh: refuse it, or let the generalised winding number close it.
        color : bool
            Take the colours of the mesh's vertices too, see :meth:`colored`.
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
            Empty, open or inside-out mesh, coordinates that are not finite, a size that hints at another unit,
            too few voxels (the shortest side under 4).

        Warns
        -----
        UserWarning
            Parts thinner than 2 voxels (with the number of voxels to use); flipped faces that were turned.
        """
        if holes not in ("error", "close"):
            raise ValueError(f"holes: expected 'error' or 'close', got {holes!r}")
        mesh = _mesh_of(mesh)
        if color and mesh.colors is None:
            raise ValueError("mesh: expected colours at its vertices (color=True), got none")
        vertices, faces = mesh.vertices * unit_scale(unit), mesh.faces
        _check_coordinates(vertices, faces)
        vertices, faces, found = _core.clean_mesh(vertices, faces, THIN_FRACTION)
        if len(faces) == 0:
            raise ValueError("mesh: expected at least one triangle with an area, got none")
        watertight = found.pop("unbalanced_edges") == 0
        report = MeshReport(watertight=watertight, **found)
        used = vertices[np.unique(faces)]
        low, high = used.min(axis=0), used.max(axis=0)
        _check_size(high - low, unit)
        voxel_size, shape, origin = _grid(low, high, voxels, padding)
        _check_voxels(high - low, voxel_size, voxels)
        if not watertight and holes == "error":
            raise ValueError(
                f"mesh: expected a closed surface, got {_openness(report)}; close it in a mesh editor, or pass "
                "holes='close' to let the winding number close it"
            )
        if watertight and report.volume < 0:
            raise ValueError(
                "mesh: it is inside out (its faces point inwards, its volume is negative); turn them: "
                "faces[:, ::-1]"
            )
        if watertight:
            values, inside_out = _core.mesh_to_sdf(
                vertices, faces, shape, voxel_size, list(origin), threads=threads
            )
            if inside_out:
                raise ValueError(
                    f"mesh: one of its {report.parts} parts is inside out ({inside_out} voxels lie inside faces "
                    "that point inwards); turn the faces of that part"
                )
        else:
            values = _core.open_mesh_to_sdf(vertices, faces, shape, voxel_size, list(origin), threads=threads)
        if not (values < 0).any():
            thin = (
                f"{_use(_needed(report, voxel_size, voxels)).rstrip(',')}, or "
                if report.thinnest < 2 * voxel_size
                else ""
            )
            raise ValueError(
                f"mesh: no voxel lies inside it, it encloses nothing at {1e3 * voxel_size:.2g} mm a voxel; {thin}"
                "check that it encloses a volume and that its faces point outwards"
            )
        _warn(report, voxel_size, voxels)
        sdf = cls._own(values, voxel_size, origin)
        if color:
            sdf = sdf.colored(mesh, unit=unit, threads=threads)
        sdf.report = report
        return sdf

    @classmethod
    def sphere(cls, radius: float, *, voxels: int = 200, padding: float | None = None) -> SDF:
        """Ball of the given radius (m), centre at the origin."""
        return cls._primitive("sphere", [radius], np.full(3, radius), voxels, padding)

    @classmethod
    def box(cls, size: ArrayLike, *, voxels: int = 200, padding: float | None = None) -> SDF:
        """Box with full edges `size` = (x, y, z), m, centre at the origin."""
        edges = _three(size, "size")
        return cls._primitive("box", list(edges), edges / 2, voxels, padding)

    @classmethod
    def cylinder(
        cls, radius: float, height: float, *, voxels: int = 200, padding: float | None = None
    ) -> SDF:
        """Cylinder, axis along z, origin at mid-height; m."""
        half = np.array([radius, radius, height / 2])
        return cls._primitive("cylinder", [radius, height], half, voxels, padding)

    @classmethod
    def cone(cls, radius: float, height: float, *, voxels: int = 200, padding: float | None = None) -> SDF:
        """Cone, axis along z, apex at +height / 2, base of `radius` at -height / 2; m."""
        half = np.array([radius, radius, height / 2])
        return cls._primitive("cone", [radius, height], half, voxels, padding)

    @classmethod
    def ellipsoid(cls, radii: ArrayLike, *, voxels: int = 200, padding: float | None = None) -> SDF:
        """Ellipsoid with semi-axes `radii` = (x, y, z), m; the exact distance, not a scaled sphere's."""
        r = _three(radii, "radii")
        return cls._primitive("ellipsoid", list(r), r, voxels, padding)

    @classmethod
    def _primitive(
        cls, kind: str, size: list[float], half: NDArray[np.float64], voxels: int, padding: float | None
    ) -> SDF:
        lengths = [number(s, kind) for s in size]
        if not all(np.isfinite(s) and s > 0 for s in lengths):
            raise ValueError(f"{kind}: expected positive lengths in metres, got {lengths}")
        voxel_size, shape, origin = _grid(-half, half, voxels, padding)
        return cls._own(
            _core.primitive_sdf(kind, lengths, shape, voxel_size, list(origin)), voxel_size, origin
        )

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
        """(nz, ny, nx, 4) uint8: RGBA of the surface on the voxels beside it, alpha 0 elsewhere; None without."""
        return self._colors

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) float64: lowest and highest voxel centre, m."""
        return np.stack(
            [self._origin, self._origin + self._voxel_size * (np.array(self._values.shape[::-1]) - 1)]
        )

    def __call__(self, points: ArrayLike) -> NDArray[np.float64]:
        """Signed distance (m) at points (..., 3), m, object frame; trilinear.

        Outside the box it goes on as phi(q) + |p - q|, q the nearest point of the box.
        """
        return self._sampled(points)[0]

    def gradient(self, points: ArrayLike) -> NDArray[np.float64]:
        """Gradient of the same interpolant at points (..., 3): (..., 3), without unit, exact in each cell."""
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
        """The shape moved by a rigid 4x4 (p -> T p), resampled on the box of the moved volume, without colours.

        A pure translation moves the origin and nothing else.
        """
        M = _core.nearest_rigid(numbers(T, "T"), "T")
        if np.array_equal(M[:3, :3], np.eye(3)):
            return SDF._own(self._values, self._voxel_size, self._origin + M[:3, 3], self._colors)
        low, high = self.bounds
        corners = np.array(
            [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
        )
        moved = corners @ M[:3, :3].T + M[:3, 3]
        low, high = moved.min(axis=0), moved.max(axis=0)
        n = np.ceil((high - low) / self._voxel_size - 1e-6).astype(int) + 1
        shape, origin = _shape3(n), (low + high) / 2 - (n - 1) * self._voxel_size / 2
        return SDF._own(
            _resample(self, shape, self._voxel_size, origin, _inverse(M)), self._voxel_size, origin
        )

    def colored(
        self,
        mesh: str | os.PathLike[str] | Mesh | trimesh.Trimesh,
        *,
        unit: Literal["m", "mm", "cm", "in"] | None = None,
        threads: int = 0,
    ) -> SDF:
        """The same shape with the colours of a mesh, with which a tracker sees turns that the shape does not show.

        Each voxel within 3 voxels of the mesh takes the colour of its nearest point, mixed from the vertices of the
        face. Detail between vertices (a texture) is lost: give the mesh vertices as close as the voxels.

        Raises ValueError when the mesh has no colours at its vertices, or lies elsewhere.
        """
        m = _mesh_of(mesh)
        if m.colors is None:
            raise ValueError("mesh: expected colours at its vertices, got none")
        reach = COLOR_REACH_VOXELS * self._voxel_size
        vertices, rgb = m.vertices * unit_scale(unit), np.ascontiguousarray(m.colors)
        rgba = _core.paint(vertices, m.faces, rgb, *self._core_args, reach, threads)
        if not rgba[..., 3].any():
            raise ValueError(
                "mesh: no part of it lies at the surface of this shape; is it in another unit or frame? pass unit='mm'"
            )
        return SDF._own(self._values, self._voxel_size, self._origin, rgba)

    def redistanced(self, threads: int = 0) -> SDF:
        """The distance field with the same zero set: |gradient| = 1 again, after blending or evolving.

        Raises ValueError when the field has one sign only.
        """
        return SDF._own(
            _core.redistance(self._values, self._voxel_size, threads),
            self._voxel_size,
            self._origin,
            self._colors,
        )

    def to_mesh(self) -> Mesh:
        """Its surface by marching cubes, faces outwards, m, object frame. ValueError without a surface."""
        from skimage.measure import marching_cubes

        if not (self._values.min() < 0 < self._values.max()):
            raise ValueError("sdf: no surface (all values have one sign)")
        zyx, faces, _, _ = marching_cubes(self._values.copy(), 0.0, gradient_direction="ascent")
        vertices = zyx[:, ::-1].astype(np.float64) * self._voxel_size + self._origin
        return Mesh(vertices, faces.astype(np.int32))

    def surface_samples(self, count: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Points (N, 3) float32, m, evenly spread over the surface, and unit normals outwards; always the same."""
        return _core.surface_samples(*self._core_args, int(count))

    def render(
        self, camera: Any, T_cam_obj: ArrayLike, threads: int = 0
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Depth and normals as a noise-free camera would see them.

        Parameters
        ----------
        camera : Camera or RGBDCamera (its depth camera)
        T_cam_obj : (4, 4) float64
            Maps object points (m) to the camera frame.
        threads : int
            0: all cores. The result does not depend on it.

        Returns
        -------
        depth : (H, W) float32
            z in metres, 0 where nothing is hit.
        normals : (H, W, 3) float32
            Unit gradient of the field at the hit, camera frame; 0 where nothing is hit.
        """
        T = numbers(T_cam_obj, "T_cam_obj")
        return _core.render_sdf(*self._core_args, core_camera(camera), T, threads)

    def silhouette(self, camera: Any, T_cam_obj: ArrayLike, threads: int = 0) -> NDArray[np.bool_]:
        """(H, W) bool: the pixels whose ray hits the shape."""
        return self.render(camera, T_cam_obj, threads)[0] > 0

    # ---- kept ----

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write an .npz (values, voxel_size, origin, and colors where there are any), whole or not at all."""
        data = io.BytesIO()
        arrays: dict[str, Any] = {
            "values": self._values, "voxel_size": self._voxel_size, "origin": self._origin
        }  # fmt: skip
        if self._colors is not None:
            arrays["colors"] = self._colors
        np.savez_compressed(data, **arrays)
        write_whole(Path(path), data.getvalue())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> SDF:
        """Read what `save` wrote. FileNotFoundError; ValueError for another or a broken file."""
        file = Path(path)
        if not file.is_file():
            raise FileNotFoundError(f"sdf: no such file: {file}")
        try:
            with np.load(io.BytesIO(file.read_bytes()), allow_pickle=False) as data:
                return cls(data["values"], float(data["voxel_size"]), data["origin"], data.get("colors"))
        except (OSError, EOFError, KeyError, ValueError, TypeError, IndexError, zipfile.BadZipFile) as error:
            raise ValueError(
                f"sdf: cannot read {file}: {error}; expected an .npz written by SDF.save"
            ) from error

    def __reduce__(self) -> tuple[Any, ...]:
        return (SDF, (self._values, self._voxel_size, self._origin, self._colors))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, SDF):
            return NotImplemented
        same = (
            self._voxel_size == other._voxel_size
            and np.array_equal(self._origin, other._origin)
            and np.array_equal(self._values, other._values)
        )
        if self._colors is None or other._colors is None:
            return same and self._colors is other._colors
        return same and np.array_equal(self._colors, other._colors)

    def __repr__(self) -> str:
        nz, ny, nx = self._values.shape
        coloured = ", coloured" if self._colors is not None else ""
        return f"SDF({nx} x {ny} x {nz} voxels of {1e3 * self._voxel_size:.3g} mm{coloured})"

    def _repr_png_(self) -> bytes:
        from sdftrack._picture import shaded_picture

        low, high = self.bounds
        return shaded_picture(self.render, low, high)


def union(*shapes: SDF) -> SDF:
    """Union of shapes in one object frame, on a common grid of the finest voxel, as a distance field.

    Outside, the smaller of two distances is the distance; inside an overlap it is not, so the result is
    re-distanced.
    """
    grid = _common_grid(shapes)
    return SDF._own(np.minimum.reduce([_resample(s, *grid) for s in shapes]), grid[1], grid[2]).redistanced()


def smooth_union(*shapes: SDF, radius: float = 0.01) -> SDF:
    """Union whose concave creases are rounded over about `radius` (m): soft minimum, then re-distanced.

    -log(sum exp(-a phi_k)) / a with a = 4 log(2) / radius, so that where two surfaces meet the new one lies
    radius / 4 outside.
    """
    if not (np.isfinite(radius) and radius > 0):
        raise ValueError(f"radius: expected a positive number of metres, got {radius}")
    grid = _common_grid(shapes)
    a = np.float32(4 * np.log(2) / radius)
    joined = -a * _resample(shapes[0], *grid)
    for shape in shapes[1:]:
        joined = np.logaddexp(joined, -a * _resample(shape, *grid))
    return SDF._own(np.asarray(-joined / a, np.float32), grid[1], grid[2]).redistanced()


def _common_grid(shapes: tuple[SDF, ...]) -> tuple[Shape3, float, NDArray[np.float64]]:
    if not shapes or not all(isinstance(s, SDF) for s in shapes):
        raise TypeError("shapes: expected one or more SDF")
    voxel_size = min(s.voxel_size for s in shapes)
    bounds = np.array([s.bounds for s in shapes])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    n = np.ceil((high - low) / voxel_size - 1e-6).astype(int) + 1
    if n.max() > MAX_VOXELS:
        raise ValueError(f"shapes: their common box needs {n.max()} voxels a side, at most {MAX_VOXELS}")
    return _shape3(n), voxel_size, low


def _resample(
    sdf: SDF,
    shape: Shape3,
    voxel_size: float,
    origin: NDArray[np.float64],
    T: NDArray[np.float64] | None = None,
) -> NDArray[np.float32]:
    """Values of `sdf` at T (grid point), slice by slice."""
    nz, ny, nx = shape
    out = np.empty(shape, np.float32)
    xy = np.zeros((ny, nx, 3))
    xy[..., 0] = origin[0] + voxel_size * np.arange(nx)
    xy[..., 1] = origin[1] + voxel_size * np.arange(ny)[:, None]
    for iz in range(nz):
        xy[..., 2] = origin[2] + voxel_size * iz
        points = xy if T is None else xy @ T[:3, :3].T + T[:3, 3]
        out[iz] = sdf(points)
    return out


def _inverse(T: NDArray[np.float64]) -> NDArray[np.float64]:
    out = np.eye(4)
    out[:3, :3] = T[:3, :3].T
    out[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return out


def _shape3(n_xyz: NDArray[Any]) -> Shape3:
    return int(n_xyz[2]), int(n_xyz[1]), int(n_xyz[0])


def _three(a: ArrayLike, name: str) -> NDArray[np.float64]:
    v = numbers(a, name)
    if v.shape != (3,):
        raise ValueError(f"{name}: expected three numbers (x, y, z) in metres, got {a!r}")
    return v


def _grid(
    low: NDArray[np.float64], high: NDArray[np.float64], voxels: int, padding: float | None
) -> tuple[float, Shape3, NDArray[np.float64]]:
    """Voxel size, shape [z, y, x] and origin of the grid round a box."""
    if number(voxels, "voxels") != int(voxels) or not 8 <= voxels <= MAX_VOXELS:
        raise ValueError(
            f"voxels: expected a whole number from 8 to {MAX_VOXELS} along the longest side, got {voxels}"
        )
    if padding is not None and not (np.isfinite(number(padding, "padding")) and padding >= 0):
        raise ValueError(f"padding: expected a fraction of the longest side, 0 or more, got {padding}")
    longest = float((high - low).max())
    pad = max(0.1 * longest, MIN_PADDING) if padding is None else padding * longest
    pad = max(pad, 2 * longest / (voxels - 5))  # at least 2 voxels: (voxels - 1) h = longest + 4 h
    voxel_size = (longest + 2 * pad) / (voxels - 1)
    n = np.minimum(np.ceil((high - low + 2 * pad) / voxel_size - 1e-6).astype(int) + 1, voxels)
    return voxel_size, _shape3(n), (low + high) / 2 - (n - 1) * voxel_size / 2


def _checked_colors(colors: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    rgba = np.array(colors, order="C")
    if rgba.dtype != np.uint8:
        raise TypeError(f"colors: expected uint8, got {rgba.dtype}")
    if rgba.shape != (*shape, 4):
        raise ValueError(f"colors: expected RGBA beside the values, {(*shape, 4)}, got {rgba.shape}")
    return rgba


def _mesh_of(mesh: Any) -> Mesh:
    if isinstance(mesh, (str, os.PathLike)):
        mesh = Mesh.load(mesh)
    elif isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        mesh = Mesh(mesh[0], mesh[1])
    elif not isinstance(mesh, Mesh):
        if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
            raise TypeError(
                f"mesh: expected a path, Mesh, trimesh.Trimesh or (vertices, faces), got {type(mesh).__name__}"
            )
        mesh = Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces), vertex_colors(mesh))
    return mesh


def _check_coordinates(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> None:
    if len(vertices) == 0 or len(faces) == 0:
        raise ValueError(
            f"mesh: it is empty ({len(vertices)} vertices, {len(faces)} faces); expected triangles"
        )
    bad = np.count_nonzero(~np.isfinite(vertices).all(axis=1))
    if bad:
        raise ValueError(
            f"mesh: {bad} of {len(vertices)} vertices are NaN or infinite; repair or remove them"
        )


def _check_size(extent: NDArray[np.float64], unit: str | None) -> None:
    side = float(extent.max())
    if SMALLEST <= side <= LARGEST:
        return
    if unit is None:
        hint = (
            "is it in mm? pass unit='mm'"
            if side > LARGEST
            else "in which unit is it? pass unit='m' if this is meant"
        )
        raise ValueError(
            f"mesh: its longest side is {side:.4g} m, expected 3 mm to 3 m; {hint} (or 'cm', 'in')"
        )


def _check_voxels(extent: NDArray[np.float64], voxel_size: float, voxels: int) -> None:
    shortest = float(extent.min())
    if shortest < 4 * voxel_size:
        if shortest <= 0:
            raise ValueError("mesh: it is flat (no extent along one axis); expected a solid")
        need = _use(_enough(voxels, 4 * voxel_size / shortest))
        raise ValueError(
            f"voxels: the shortest side of the object, {1e3 * shortest:.3g} mm, is under 4 voxels of "
            f"{1e3 * voxel_size:.3g} mm; {need} or less padding"
        )


def _enough(voxels: int, factor: float) -> int:
    """`voxels` times a factor, rounded up to a ten."""
    return int(np.ceil(((voxels - 1) * factor + 1) / 10) * 10)


def _use(voxels: int) -> str:
    if voxels > MAX_VOXELS:
        return (
            f"it would take {voxels} voxels, at most {MAX_VOXELS} are possible: thicken it in a mesh editor,"
        )
    return f"use voxels={voxels}"


def _needed(report: MeshReport, voxel_size: float, voxels: int) -> int:
    return _enough(voxels, 2 * voxel_size / max(report.thinnest, 1e-6))


def _openness(report: MeshReport) -> str:
    kinds = [f"{report.open_edges} open edges"] if report.open_edges else []
    kinds += (
        [f"{report.non_manifold_edges} edges in more than two faces"] if report.non_manifold_edges else []
    )
    return " and ".join(kinds) or "faces of opposite orientation"


def _warn(report: MeshReport, voxel_size: float, voxels: int) -> None:
    if report.flipped_faces:
        warnings.warn(
            f"mesh: {report.flipped_faces} faces pointed against their neighbours and were turned",
            stacklevel=3,
        )
    if report.thinnest < 2 * voxel_size:
        need = _use(_needed(report, voxel_size, voxels)).rstrip(",")
        warnings.warn(
            f"mesh: parts of it, {1e3 * report.thinnest:.2g} mm and less, are thinner than 2 voxels of "
            f"{1e3 * voxel_size:.2g} mm, and their surfaces will be off; {need}",
            stacklevel=3,
        )
