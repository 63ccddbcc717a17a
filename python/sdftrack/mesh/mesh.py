# SPDX-License-Identifier: MIT
"""Triangle meshes: load, save, exact rendering."""

from __future__ import annotations

import functools
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.array_equality import same
from sdftrack._internal.rotations import rigid_pose
from sdftrack._internal.text_files import named
from sdftrack._internal.validation import detached, numbers, of_kind, whole
from sdftrack.device import device_number
from sdftrack.mesh.files import read_mesh, unit_scale

if TYPE_CHECKING:
    import trimesh


class Mesh:
    """Triangle mesh in metres, object frame.

    Parameters
    ----------
    vertices : (V, 3) array
        Metres. Kept as read-only float64.
    faces : (F, 3) array of integers
        Vertex indices, counter-clockwise seen from outside. Kept as read-only int32.
    colors : (V, 3) uint8, optional
        RGB per vertex.
    seen : (V,) float32, optional
        For a reconstruction: number of observations of each vertex, in equivalent frontal views; 0: guessed.

    Raises
    ------
    TypeError
        Faces that are not integers, colours that are not uint8.
    ValueError
        Wrong shapes, an index out of range. Non-finite coordinates are accepted, so that a damaged file can be
        inspected; `SDF.from_mesh` and `raycast` reject them.

    Examples
    --------
    >>> tetrahedron = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> len(tetrahedron.faces)
    4
    """

    __slots__ = ("_caster", "colors", "faces", "seen", "vertices")
    __hash__ = None  # type: ignore[assignment]

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    colors: NDArray[np.uint8] | None
    seen: NDArray[np.float32] | None
    _caster: _core.MeshCaster | None

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        colors: ArrayLike | None = None,
        *,
        seen: ArrayLike | None = None,
    ) -> None:
        v = _rows(np.array(detached(vertices), dtype=np.float64), "vertices")
        f = np.asarray(detached(faces))
        if f.size and not np.issubdtype(f.dtype, np.integer):
            raise TypeError(f"faces: expected integers, got {f.dtype}; convert with faces.astype(np.int32)")
        f = _rows(f, "faces")
        if f.size and (f.min() < 0 or f.max() >= len(v)):
            raise ValueError(f"faces: expected vertex indices 0..{len(v) - 1}, got {f.min()}..{f.max()}")
        c = None
        if colors is not None:
            c = np.array(colors)
            if c.dtype != np.uint8:
                raise TypeError(
                    f"colors: expected uint8 RGB per vertex, got {c.dtype}; scale to 0..255 first"
                )
            if c.shape != (len(v), 3):
                raise ValueError(f"colors: expected shape ({len(v)}, 3), one per vertex, got {c.shape}")
        _freeze(self, "vertices", np.ascontiguousarray(v))
        _freeze(self, "faces", np.array(f, dtype=np.int32, order="C"))
        _freeze(self, "colors", None if c is None else np.ascontiguousarray(c))
        views = None if seen is None else np.array(seen, dtype=np.float32)
        if views is not None and views.shape != (len(v),):
            raise ValueError(f"seen: expected shape ({len(v)},), one per vertex, got {views.shape}")
        _freeze(self, "seen", views)
        object.__setattr__(self, "_caster", None)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"Mesh is read-only; make a new one: Mesh(vertices, faces, colors) ({name})")

    @classmethod
    def load(cls, path: str | os.PathLike[str], unit: str | None = None) -> Mesh:
        """Read a .ply, .obj, .glb or .stl file (or another that trimesh knows).

        Parameters
        ----------
        path : path
        unit : "m", "mm", "cm", "in" or None
            Unit of the file; None means metres.

        Returns
        -------
        Mesh
            In metres, with vertex colours if the file has them (a texture is sampled at the vertices), and `seen` if a
            .ply or .glb has it.

        Raises
        ------
        FileNotFoundError, ValueError
            No such file; a file that is not a mesh, is truncated, or has no triangle.
        """
        scale = unit_scale(unit)
        vertices, faces, colors, seen = read_mesh(Path(path))
        with named(path):
            return cls(vertices * scale, faces, colors, seen=seen)

    def save(
        self, path: str | os.PathLike[str], *, texture: int | None = None, colors_from: Mesh | None = None
    ) -> None:
        """Write .ply, .obj, .glb or .stl (metres); each file completely or not at all.

        Vertex colours are stored in .ply, .obj and .glb, `seen` in .ply and .glb.

        Parameters
        ----------
        path : path
        texture : int, optional
            Side of a texture image in texels (16 to 8192); .obj, .ply and .glb store texture coordinates. The texture
            is embedded in a .glb, and otherwise written to NAME_texture.png (with NAME.mtl for .obj) before the mesh:
            use different names for a .ply and an .obj of different meshes. Requires the extra ``sdftrack[export]``.
            Vertices on texture seams are duplicated.
        colors_from : Mesh, optional
            With `texture`: mesh from which colours are taken, at the nearest points. None: this mesh. A simplified mesh
            can thus show the colours of the full one.

        Raises
        ------
        ImportError
            `texture` without xatlas.
        ValueError
            Unknown format, or one without texture support; a texture for a mesh without colours.

        Examples
        --------
        >>> mesh.decimated(5000).save("object.glb", texture=1024, colors_from=mesh)  # doctest: +SKIP
        """
        from sdftrack.mesh.files import write_mesh

        if colors_from is not None:
            of_kind(colors_from, Mesh, "colors_from")
        write_mesh(self, Path(path), texture, colors_from)

    def to_trimesh(self) -> trimesh.Trimesh:
        """The same mesh as a `trimesh.Trimesh`, vertices in the same order."""
        import trimesh

        mesh = trimesh.Trimesh(
            self.vertices.copy(), self.faces.copy(), vertex_colors=None if self.colors is None else self.colors.copy(),
            process=False,
        )  # fmt: skip
        if self.seen is not None:
            mesh.vertex_attributes["seen"] = self.seen.copy()
        return mesh

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) float64: lowest and highest corner, m."""
        if len(self.vertices) == 0:
            raise ValueError("mesh: no vertices, so no bounds")
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def transformed(self, T: ArrayLike) -> Mesh:
        """The mesh transformed by a rigid 4x4: p -> T p."""
        M = rigid_pose(T, "T")
        return Mesh(self.vertices @ M[:3, :3].T + M[:3, 3], self.faces, self.colors, seen=self.seen)

    def decimated(self, faces: int) -> Mesh:
        """Simplify to at most this many faces by quadric error. Requires the extra ``sdftrack[export]``.

        A closed surface stays closed. Colours are averaged over the merged vertices (over observed ones, if any);
        `seen` is their median, so that mostly guessed surface remains guessed.

        Parameters
        ----------
        faces : int
            At least 4. A mesh that already has no more faces is returned unchanged.

        Raises
        ------
        ImportError
            The package fast-simplification is missing.
        ValueError
            Fewer than 4; a surface that cannot be represented by so few faces (closed, if this one is); non-finite
            vertices.

        Examples
        --------
        >>> mesh.decimated(5000).save("object.glb")  # doctest: +SKIP
        """
        from sdftrack.mesh import decimate

        count = whole(faces, "faces", decimate.MIN_FACES)
        if len(self.faces) <= count:
            return self
        vertices, triangles, into = decimate.decimate(self.vertices, self.faces, count)
        colors = seen = None
        if self.colors is not None:
            mean = decimate.weighted_mean_of_merged(self.colors, self.seen, into, len(vertices))
            colors = np.clip(np.round(mean), 0, 255).astype(np.uint8)
        if self.seen is not None:
            seen = decimate.median_of_merged(self.seen, into, len(vertices))
        return Mesh(vertices, triangles, colors, seen=seen)

    def raycast(
        self, camera: Any, T_cam_obj: ArrayLike, threads: int = 0, *, device: str = "cpu"
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint8] | None]:
        """Depth, normals and colours as a noise-free camera would see them.

        Exact ray-triangle casting through every pixel centre, including lens distortion. Both sides of a face are
        visible.

        Parameters
        ----------
        camera : Camera or RGBDCamera (its depth camera)
        T_cam_obj : (4, 4) float64
            Maps object points (m) to the camera frame.
        threads : int
            0: all cores. The result does not depend on it.
        device : {"cpu", "cuda", "cuda:N", "auto"}
            The images are the same. A GPU keeps the last mesh, so that further images of it are not delayed by its
            transfer. "auto" selects a GPU if its self-test has passed.

        Returns
        -------
        depth : (H, W) float32
            z in metres, 0 where no face is hit.
        normals : (H, W, 3) float32
            Unit normal of the face, camera frame, towards the camera; 0 where no face is hit.
        colors : (H, W, 3) uint8 or None
            Interpolated vertex colours; 0 where no face is hit. None for a mesh without colours.
        """
        if len(self.faces) == 0:
            raise ValueError("mesh: expected at least one face to render, got none")
        T, number = numbers(T_cam_obj, "T_cam_obj"), device_number(device)
        return self._rays.raycast(core_camera(camera), T, self.colors, threads, number)

    @property
    def _rays(self) -> _core.MeshCaster:
        caster = self._caster
        if caster is None:
            caster = _core.MeshCaster(self.vertices, self.faces)
            object.__setattr__(self, "_caster", caster)
        return caster

    def __reduce__(self) -> tuple[Any, ...]:
        return functools.partial(Mesh, seen=self.seen), (self.vertices, self.faces, self.colors)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Mesh):
            return NotImplemented
        return all(same(getattr(self, n), getattr(other, n)) for n in ("vertices", "faces", "colors", "seen"))

    def __repr__(self) -> str:
        size = (
            " x ".join(f"{s:.3f}" for s in np.ptp(self.vertices, axis=0)) + " m"
            if len(self.vertices)
            else "empty"
        )
        colored = ", colored" if self.colors is not None else ""
        return f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces, {size}{colored})"

    def _repr_png_(self) -> bytes:
        from sdftrack.mesh.shaded_picture import shaded_picture

        low, high = self.bounds
        return shaded_picture(lambda camera, T: self.raycast(camera, T)[:2], low, high)


def core_camera(camera: Any) -> _core.Camera:
    """The core's camera of a Camera, or of an RGBDCamera's depth image."""
    if isinstance(camera, _core.Camera):
        return camera
    inner = getattr(getattr(camera, "depth", camera), "_core", None)
    if not isinstance(inner, _core.Camera):
        raise TypeError(f"camera: expected a Camera or RGBDCamera, got {type(camera).__name__}")
    return inner


def _rows(a: NDArray[Any], name: str) -> NDArray[Any]:
    if a.size == 0:
        return a.reshape(0, 3)
    if a.ndim != 2 or a.shape[1] != 3:
        raise ValueError(f"{name}: expected shape (N, 3), got {a.shape}")
    return a


def _freeze(mesh: Mesh, name: str, a: NDArray[Any] | None) -> None:
    if a is not None:
        a.setflags(write=False)
    object.__setattr__(mesh, name, a)
