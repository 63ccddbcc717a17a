# SPDX-License-Identifier: MIT
"""Mesh files and their units: reading, and writing with vertex colours or a texture baked for an atlas."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.extras import need
from sdftrack._internal.files import write_whole
from sdftrack._internal.text_files import reason
from sdftrack._internal.validation import whole

if TYPE_CHECKING:
    from sdftrack.mesh.mesh import Mesh

UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
FORMATS = (".ply", ".obj", ".glb", ".stl")
HEADER_BYTES = 64 * 1024  # of a PLY, at most


def read_mesh(
    file: Path,
) -> tuple[NDArray[np.float64], NDArray[Any], NDArray[np.uint8] | None, NDArray[np.float32] | None]:
    """Vertices (V, 3) in the file's unit, faces (F, 3), and per-vertex colours and `seen` if present."""
    # FileNotFoundError; ValueError for a file that is not a mesh, is truncated, or has no triangle.
    import trimesh

    if not file.is_file():
        raise FileNotFoundError(f"mesh: no such file: {file}")
    try:
        if file.suffix.lower() == ".ply":
            check_ply_is_whole(file)
        loaded: Any = trimesh.load(str(file), force="mesh", process=False)
        vertices, faces = np.asarray(loaded.vertices, np.float64), np.asarray(loaded.faces)
    except Exception as error:
        raise ValueError(
            f"mesh: cannot read {file}: {reason(error)}; expected one of {', '.join(FORMATS)}"
        ) from error
    if len(faces) == 0:
        raise ValueError(f"mesh: {file} has no triangles ({len(vertices)} vertices); is it a point cloud?")
    return vertices, faces, vertex_colors(loaded), _vertex_seen(loaded)


def unit_scale(unit: str | None) -> float:
    """Metres per unit; None means metres."""
    if unit is None:
        return 1.0
    if unit not in UNITS:
        raise ValueError(f"unit: expected None or one of {', '.join(map(repr, UNITS))}, got {unit!r}")
    return UNITS[unit]


def vertex_colors(loaded: Any) -> NDArray[np.uint8] | None:
    """(V, 3) uint8 vertex colours read by trimesh; a texture is sampled at the vertices."""
    visual = getattr(loaded, "visual", None)
    try:
        if visual is None:
            return None
        if visual.kind == "texture":
            visual = visual.to_color()
        if visual.kind != "vertex":
            return None
        colors = np.asarray(visual.vertex_colors)
    except Exception:  # a texture image that is missing or broken: the shape is still good
        return None
    if colors.ndim != 2 or len(colors) != len(loaded.vertices):
        return None
    return np.ascontiguousarray(colors[:, :3], dtype=np.uint8)


def _vertex_seen(loaded: Any) -> NDArray[np.float32] | None:
    attributes = getattr(loaded, "vertex_attributes", {})
    seen = attributes.get("seen", attributes.get("_seen"))  # glTF wants names of one's own to begin so
    if seen is None:
        rows = loaded.metadata.get("_ply_raw", {}).get("vertex", {}).get("data")
        names = getattr(getattr(rows, "dtype", None), "names", None) or ()
        seen = rows["seen"] if "seen" in names else None
    if seen is None or np.size(seen) != len(loaded.vertices):
        return None
    return np.asarray(seen, np.float32).reshape(-1)  # a column, where it is of a .glb


def check_ply_is_whole(file: Path) -> None:
    """ValueError if an ASCII PLY has fewer lines than its header states: the reader would accept it."""
    with open(file, "rb") as stream:
        head = stream.read(HEADER_BYTES)
        end = re.search(rb"end_header[ \t]*\r?\n?", head)
        if not head.startswith(b"ply") or end is None or not re.search(rb"^format\s+ascii", head, re.M):
            return
        counts = [int(n) for n in re.findall(rb"^element\s+\S+\s+(\d+)", head[: end.start()], re.M)]
        stream.seek(end.end())
        lines = sum(1 for line in stream if line.strip())
    if lines < sum(counts):
        raise ValueError(f"truncated: its header states {sum(counts)} lines of data, found {lines}")


TEXTURE_FORMATS = (".ply", ".obj", ".glb")
WHITE, BLACK = [255, 255, 255, 255], [0, 0, 0, 255]


def write_mesh(mesh: Mesh, file: Path, texture: int | None, colors_from: Mesh | None) -> None:
    """Write the mesh, and with a texture the additional files; each completely or not at all, the mesh last."""
    suffix = file.suffix.lower()
    if suffix not in FORMATS:
        raise ValueError(f"path: expected a name ending in one of {', '.join(FORMATS)}, got {file.name!r}")
    if texture is None:
        if colors_from is not None:
            raise ValueError("colors_from: requires texture=, the side of the texture image in texels")
        data: Any = mesh.to_trimesh().export(file_type=suffix[1:])
        write_whole(file, data.encode() if isinstance(data, str) else data)
        return
    size = whole(texture, "texture", SMALLEST, LARGEST)
    if suffix not in TEXTURE_FORMATS:
        raise ValueError(
            f"path: expected one of {', '.join(TEXTURE_FORMATS)} with texture=, got {file.name!r}"
        )
    source = _source(mesh, colors_from)
    files = _textured_files(mesh, textured(mesh, size, source), file)
    for name, content in files.items():
        write_whole(file.with_name(name), content)


def files_beside(name: str) -> list[str]:
    """Names of the additional files of a mesh with a texture."""
    stem, suffix = Path(name).stem, Path(name).suffix.lower()
    picture = f"{stem}_texture.png"
    return {".ply": [picture], ".obj": [picture, f"{stem}.mtl"]}.get(suffix, [])


def _source(mesh: Mesh, colors_from: Mesh | None) -> Mesh:
    source = mesh if colors_from is None else colors_from
    if source.colors is None:
        raise ValueError("texture: expected a mesh with colours, got one without")
    if len(mesh.faces) == 0 or len(source.faces) == 0:
        raise ValueError("texture: expected a mesh with faces, got one without")
    return source


def _textured_files(mesh: Mesh, laid_out: Textured, file: Path) -> dict[str, bytes]:
    """Contents of the files, by name; the mesh's own file is the last, so it never refers to a missing file."""
    import trimesh
    from PIL import Image
    from trimesh.exchange.obj import export_obj
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial, SimpleMaterial

    suffix = file.suffix.lower()
    if suffix == ".ply":
        return _textured_ply(mesh, laid_out, file)
    picture = Image.fromarray(laid_out.image)
    material: Any
    if suffix == ".glb":
        material = PBRMaterial(baseColorTexture=picture, metallicFactor=0.0, roughnessFactor=1.0)
    else:
        material = SimpleMaterial(
            image=picture, diffuse=WHITE, ambient=WHITE, specular=BLACK, name=f"{file.stem}_texture"
        )
    out: Any = trimesh.Trimesh(
        laid_out.vertices, laid_out.faces, process=False, visual=TextureVisuals(uv=laid_out.uv, material=material)
    )  # fmt: skip
    if suffix == ".glb":
        if mesh.seen is not None:
            out.vertex_attributes["seen"] = mesh.seen[laid_out.copy_of]
        return {file.name: out.export(file_type="glb")}
    text, beside = export_obj(out, return_texture=True, mtl_name=f"{file.stem}.mtl")
    return {**beside, file.name: text.encode()}


def _textured_ply(mesh: Mesh, laid_out: Textured, file: Path) -> dict[str, bytes]:
    """PLY with texture coordinates, and also vertex colours for readers without texture support."""
    import cv2
    import trimesh

    colors = None if mesh.colors is None else mesh.colors[laid_out.copy_of]
    out: Any = trimesh.Trimesh(laid_out.vertices, laid_out.faces, process=False, vertex_colors=colors)
    if mesh.seen is not None:
        out.vertex_attributes["seen"] = mesh.seen[laid_out.copy_of]
    for name, column in zip("st", laid_out.uv.T, strict=True):
        out.vertex_attributes[name] = column.astype(np.float32)
    first, rest = out.export(file_type="ply").split(b"\nelement vertex", 1)
    picture = f"{file.stem}_texture.png"
    head = first + f"\ncomment TextureFile {picture}".encode()
    return {
        picture: cv2.imencode(".png", laid_out.image[..., ::-1])[1].tobytes(),
        file.name: head + b"\nelement vertex" + rest,
    }


# -- Texture atlas of a mesh: charts by xatlas, colours baked texel by texel


SMALLEST, LARGEST = 16, 8192  # texels along a side
FILLED = 0.75  # of the picture's side, that the surface would take as one square: with the gaps the picture is full
GAP_TEXELS = 4  # between charts, so that two texels about each border are its own
TEXELS_AT_ONCE = 2**20

Points = NDArray[np.float64]
Faces = NDArray[np.int32]


@dataclass(frozen=True)
class Textured:
    """A mesh with texture coordinates; a vertex on a chart border is duplicated for each chart."""

    vertices: Points
    faces: Faces
    uv: Points  # (V, 2), 0 to 1, to the right and upwards from the image's lower left corner
    image: NDArray[np.uint8]
    copy_of: NDArray[np.int64]  # index of the original vertex of each vertex


def textured(mesh: Mesh, size: int, colors_from: Mesh) -> Textured:
    """Unwrap `mesh` into charts, with a texture (`size` texels a side) of the nearest colours of `colors_from`."""
    # Every texel gets the colour of the nearest chart point, also between charts, so that filtering and mip-mapping
    # across chart borders do not introduce other colours.
    copy_of, faces, uv = _charts(mesh, size)
    flat = _core.MeshCaster(np.column_stack([uv, np.zeros(len(uv))]), faces)
    corner = mesh.vertices[copy_of][faces]
    own = colors_from is mesh
    assert colors_from.colors is not None
    colors, nearest = colors_from.colors.astype(np.float64), colors_from
    image = np.empty((size * size, 3), np.uint8)
    for first in range(0, size * size, TEXELS_AT_ONCE):
        texels = np.arange(first, min(first + TEXELS_AT_ONCE, size * size))
        # The first row of a picture is its uppermost, where v is 1.
        at = np.column_stack([texels % size + 0.5, size - texels // size - 0.5, np.zeros(len(texels))]) / size
        _, face, at = flat.closest(at)
        weight = _weights(at[:, :2], uv[faces[face]])
        if own:
            blended = np.einsum("nk,nkc->nc", weight, colors[copy_of[faces[face]]])
        else:
            points = np.einsum("nk,nkx->nx", weight, corner[face])
            _, other, there = nearest._rays.closest(points)
            ends = nearest.faces[other]
            blended = np.einsum("nk,nkc->nc", _weights(there, nearest.vertices[ends]), colors[ends])
        image[texels] = np.clip(np.round(blended), 0, 255)
    return Textured(mesh.vertices[copy_of], faces, uv, image.reshape(size, size, 3), copy_of)


def _charts(mesh: Mesh, size: int) -> tuple[NDArray[np.int64], Faces, Points]:
    """Original index of each chart vertex, the faces, and (V, 2) texture coordinates, 0..1."""
    xatlas = need("xatlas", "export")
    low, high = mesh.bounds
    unit = (mesh.vertices - low) / max(float((high - low).max()), 1e-12)
    a, b, c = np.moveaxis(unit[mesh.faces], 1, 0)
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    atlas, packing = xatlas.Atlas(), xatlas.PackOptions()
    packing.texels_per_unit = FILLED * size / np.sqrt(max(area, 1e-12))
    packing.padding = GAP_TEXELS
    atlas.add_mesh(unit.astype(np.float32), mesh.faces.astype(np.uint32))
    atlas.generate(xatlas.ChartOptions(), packing)
    copy_of, faces, uv = atlas.get_mesh(0)
    return copy_of.astype(np.int64), faces.astype(np.int32), np.clip(uv.astype(np.float64), 0, 1)


def _weights(points: Points, corners: Points) -> Points:
    """(N, 3) barycentric weights of points (N, D) in triangles with corners (N, 3, D); 1/3 each without area."""
    a, b, c = np.moveaxis(corners, 1, 0)
    u, v, p = b - a, c - a, points - a
    uu, uv, vv, pu, pv = (np.einsum("ni,ni->n", x, y) for x, y in ((u, u), (u, v), (v, v), (p, u), (p, v)))
    area = uu * vv - uv * uv
    with np.errstate(divide="ignore", invalid="ignore"):
        second, third = (vv * pu - uv * pv) / area, (uu * pv - uv * pu) / area
    weight: Any = np.clip(np.column_stack([1 - second - third, second, third]), 0, 1)
    weight[~(area > 0)] = 1 / 3
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))
