# SPDX-License-Identifier: MIT
"""Writing of meshes, with vertex colours or a texture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sdftrack._internal.files import write_whole
from sdftrack._internal.validation import whole
from sdftrack.mesh.files import FORMATS
from sdftrack.mesh.texture import LARGEST, SMALLEST, Textured, textured

if TYPE_CHECKING:
    from sdftrack.mesh.mesh import Mesh

__all__ = ["TEXTURE_FORMATS", "files_beside", "write_mesh"]

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
