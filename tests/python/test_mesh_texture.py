# SPDX-License-Identifier: MIT
"""Meshes with their colours in a picture: the files, read by another library, show the colours that were there."""

import numpy as np
import pytest
import trimesh

import sdftrack as st

SIZE = 256
RADIUS = 0.05
# A texel is 0.9 mm here, over which the colours change by 5 of 255; reading takes the nearest texel.
MEAN_OFF, MOST_OFF = 3.0, 16.0


def painted(voxels=40):
    """A ball whose colours are its places, red to the right, green to the front, blue upwards."""
    mesh = st.SDF.sphere(RADIUS, voxels=voxels).to_mesh()
    return st.Mesh(
        mesh.vertices, mesh.faces, colors_at(mesh.vertices), seen=np.arange(len(mesh.vertices)) % 3
    )


def colors_at(points):
    return np.clip(127.5 + points / RADIUS * 127.5, 0, 255).astype(np.uint8)


def sampled(loaded, count=5000):
    """Points on a mesh, and the texels that trimesh finds there."""
    rng = np.random.default_rng(0)
    face = rng.integers(len(loaded.faces), size=count)
    weight = rng.dirichlet([1, 1, 1], count)
    points = np.einsum("nk,nkx->nx", weight, loaded.vertices[loaded.faces[face]])
    uv = np.einsum("nk,nkx->nx", weight, loaded.visual.uv[loaded.faces[face]])
    material = loaded.visual.material
    picture = np.asarray(getattr(material, "baseColorTexture", None) or material.image)[..., :3]
    column = np.clip((uv[:, 0] * picture.shape[1]).astype(int), 0, picture.shape[1] - 1)
    row = np.clip(((1 - uv[:, 1]) * picture.shape[0]).astype(int), 0, picture.shape[0] - 1)
    return points, picture[row, column]


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply"])
def test_the_picture_shows_the_colours_that_the_vertices_had(tmp_path, suffix):
    mesh = painted()
    mesh.save(tmp_path / f"ball{suffix}", texture=SIZE)
    beside = {".glb": set(), ".obj": {"ball.mtl", "ball_texture.png"}, ".ply": {"ball_texture.png"}}[suffix]
    assert {p.name for p in tmp_path.iterdir()} == {f"ball{suffix}"} | beside
    loaded = trimesh.load(tmp_path / f"ball{suffix}", force="mesh", process=False)
    assert loaded.visual.kind == "texture"
    assert len(loaded.faces) == len(mesh.faces)
    points, colors = sampled(loaded)
    off = np.abs(colors.astype(float) - colors_at(points))
    assert off.mean() < MEAN_OFF
    assert np.percentile(off, 99.9) < MOST_OFF


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply"])
def test_it_loads_back_as_a_coloured_mesh_of_the_same_surface(tmp_path, suffix):
    mesh = painted()
    mesh.save(tmp_path / f"ball{suffix}", texture=SIZE)
    back = st.Mesh.load(tmp_path / f"ball{suffix}")
    np.testing.assert_allclose(
        np.sort(back.vertices[back.faces].mean(axis=1), axis=0),
        np.sort(mesh.vertices[mesh.faces].mean(axis=1), axis=0),
        atol=1e-6,
    )
    assert np.abs(back.colors.astype(float) - colors_at(back.vertices)).mean() < MEAN_OFF
    if suffix != ".obj":
        _, nearest = np.unique(np.round(mesh.vertices, 6), axis=0, return_index=True)
        _, again = np.unique(np.round(back.vertices, 6), axis=0, return_index=True)
        np.testing.assert_array_equal(back.seen[again], mesh.seen[nearest])
    assert st.SDF.from_mesh(back, voxels=40)([[0, 0, 0]])[0] < 0  # closed: seams are merged


def test_a_coarse_mesh_shows_the_colours_of_the_fine_one(tmp_path):
    fine = painted(voxels=100)
    stripes = np.where((np.arctan2(*fine.vertices[:, :2].T) * 12 / np.pi).astype(int)[:, None] % 2, 220, 30)
    fine = st.Mesh(fine.vertices, fine.faces, np.repeat(stripes, 3, axis=1).astype(np.uint8))
    coarse = fine.decimated(300)

    def wrong(mesh, **options):
        mesh.save(tmp_path / "b.glb", texture=512, **options)
        points, colors = sampled(trimesh.load(tmp_path / "b.glb", force="mesh", process=False))
        _, face, _ = fine._rays.closest(points)
        return np.abs(colors.astype(float) - fine.colors[fine.faces[face]].mean(axis=1)).mean()

    assert wrong(coarse, colors_from=fine) < 10
    assert wrong(coarse) > 40  # 300 faces hold no stripes
