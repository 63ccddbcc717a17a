# SPDX-License-Identifier: MIT
"""Meshes with fewer faces: closed as before, as near to the surface as can be, their colours and views carried."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack.mesh import decimate

RADIUS = 0.05


def ball(voxels=64):
    mesh = st.SDF.sphere(RADIUS, voxels=voxels).to_mesh()
    upper = mesh.vertices[:, 2] > 0
    colors = np.where(upper[:, None], np.uint8([200, 40, 40]), np.uint8([40, 40, 200])).astype(np.uint8)
    return st.Mesh(mesh.vertices, mesh.faces, colors, seen=np.where(upper, 5.0, 0.0))


def rough(seed, voxels=48):
    """A closed surface with noise, thin parts and a hole through it."""
    rod = st.SDF.cylinder(0.004, 0.1, voxels=voxels)
    ring = st.SDF.sphere(0.03, voxels=voxels)
    shape = st.smooth_union(ring, rod, radius=0.004)
    noise = (
        np.random.default_rng(seed).normal(0, 0.2 * shape.voxel_size, shape.values.shape).astype(np.float32)
    )
    mesh = st.SDF(shape.values + noise, shape.voxel_size, shape.origin).to_mesh()
    # the largest of its bodies
    return max(mesh.to_trimesh().split(only_watertight=True), key=lambda part: len(part.faces))


@pytest.mark.parametrize("faces", [2000, 500, 60, 4])
def test_a_closed_mesh_stays_closed_and_has_no_more_faces_than_asked_for(faces):
    mesh = ball()
    fewer = mesh.decimated(faces)
    assert 0.5 * faces <= len(fewer.faces) <= faces < len(mesh.faces)
    assert fewer.to_trimesh().is_watertight
    assert fewer.to_trimesh().volume > 0
    assert np.array_equal(np.unique(fewer.faces), np.arange(len(fewer.vertices)))


@pytest.mark.parametrize("seed", range(4))
def test_thin_and_noisy_surfaces_stay_closed_too(seed):
    part = rough(seed)
    mesh = st.Mesh(part.vertices, part.faces)
    assert mesh.to_trimesh().is_watertight
    for faces in (1000, 300, 150, 100, 80, 60, 40, 30, 20):
        fewer = mesh.decimated(faces)
        assert len(fewer.faces) <= faces
        assert fewer.to_trimesh().is_watertight, faces


def test_the_error_is_a_small_part_of_a_voxel():
    mesh = ball()
    voxel = 0.1 / 64
    fewer = mesh.decimated(1500)
    rng = np.random.default_rng(0)
    weights = rng.dirichlet([1, 1, 1], 4000)
    corners = fewer.vertices[fewer.faces[rng.integers(len(fewer.faces), size=4000)]]
    off = np.abs(np.linalg.norm(np.einsum("nk,nkx->nx", weights, corners), axis=1) - RADIUS)
    assert off.mean() < 0.1 * voxel
    assert off.max() < 0.5 * voxel


def test_colours_and_views_of_merged_vertices_are_carried():
    fewer = ball().decimated(600)
    assert fewer.colors is not None
    assert fewer.seen is not None
    up, down = fewer.vertices[:, 2] > 0.01, fewer.vertices[:, 2] < -0.01  # by an edge's length
    np.testing.assert_array_equal(np.unique(fewer.colors[up], axis=0), [[200, 40, 40]])
    np.testing.assert_array_equal(np.unique(fewer.colors[down], axis=0), [[40, 40, 200]])
    assert set(np.unique(fewer.seen)) == {0.0, 5.0}  # no half seen ones
    assert (fewer.seen[down] == 0).all()
    assert ball().decimated(600) == fewer  # the same bits again


def test_parts_that_fold_flat_are_taken_out():
    # A tetrahedron with a flap of two faces on one of its edges: what the library leaves of a thin part.
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [2, 2, 2]])
    solid = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    faces = np.array([*solid, [0, 1, 4], [1, 0, 4]], np.int32)
    assert not decimate.is_closed(faces)
    kept, triangles, into = decimate._without_flat_parts(points, faces, np.array([0, 1, 2, 3, 4, 4]))
    assert decimate.is_closed(triangles)
    np.testing.assert_array_equal(kept, points[:4])
    np.testing.assert_array_equal(into, [0, 1, 2, 3, -1, -1])


def test_an_open_mesh_stays_open_where_it_was():
    mesh = ball()
    half = mesh.faces[(mesh.vertices[mesh.faces][:, :, 2] > 0).all(axis=1)]
    used, faces = np.unique(half, return_inverse=True)
    cap = st.Mesh(mesh.vertices[used], faces.reshape(-1, 3).astype(np.int32))
    fewer = cap.decimated(400)
    assert len(fewer.faces) <= 400
    assert fewer.vertices[:, 2].min() < 0.004
    np.testing.assert_allclose(fewer.to_trimesh().area, cap.to_trimesh().area, rtol=0.01)


def test_few_faces_come_back_as_they_are():
    mesh = ball()
    assert mesh.decimated(len(mesh.faces)) is mesh
