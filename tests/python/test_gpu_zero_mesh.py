# SPDX-License-Identifier: MIT
"""Marching cubes on a GPU. Skips, and says so, where the build or the machine has no CUDA."""

import numpy as np
import pytest
from gpu_marks import on_gpu
from marching_cubes import marching_cubes, turned
from scipy.ndimage import gaussian_filter

import sdftrack as st
from sdftrack.sdf.zero_mesh import zero_mesh

GPU = 0
PLACE_ATOL = 1e-6  # voxels


def noise(*shape):
    return np.random.default_rng(3).normal(size=shape).astype(np.float32)


def smooth(*shape):
    return (10 * gaussian_filter(noise(*shape), 2.0)).astype(np.float32)


def in_voxels(shape):
    return np.ascontiguousarray(shape.values / shape.voxel_size, dtype=np.float32)


FIELDS = {
    "a ball": lambda: in_voxels(st.SDF.sphere(0.05, voxels=16)),
    "a box": lambda: in_voxels(st.SDF.box((0.05, 0.04, 0.03), voxels=16)),
    "a smooth field": lambda: smooth(14, 15, 16),
}
ODD_FIELDS = {
    "noise": lambda: noise(9, 10, 12),
    "zeros": lambda: np.round(noise(6, 9, 7)),
    "two voxels an axis": lambda: noise(2, 2, 2),
    "a slice": lambda: noise(2, 17, 9),
}


def sides_of(faces):
    """How often each directed side occurs, by both ends."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(ends, axis=0, return_counts=True)


def assert_closed(faces):
    """Each side of a face is that of one other, in the opposite direction."""
    sides, times = sides_of(faces)
    assert (times == 1).all()
    np.testing.assert_array_equal(np.unique(sides[:, ::-1], axis=0), sides)


def euler_number(vertices, faces):
    assert len(np.unique(faces)) == len(vertices)
    return len(vertices) - len(sides_of(faces)[0]) // 2 + len(faces)


def volume_of(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def in_order(points):
    return points[np.lexsort(np.round(points, 4).T)]


@on_gpu
@pytest.mark.parametrize("name", [*FIELDS, *ODD_FIELDS])
def test_the_gpu_marches_as_the_slow_form_does(name):
    phi = (FIELDS | ODD_FIELDS)[name]()
    edges, triangles = marching_cubes(phi)
    vertices, faces = zero_mesh(phi, GPU)
    assert (vertices.dtype, faces.dtype, len(vertices)) == (np.float64, np.int32, len(edges))
    named = {e: k for k, e in enumerate(in_blocks(edges))}
    np.testing.assert_allclose(vertices, [edges[e] for e in named], rtol=0, atol=1e-12)
    assert {turned(t) for t in faces.tolist()} == {turned(tuple(named[e] for e in t)) for t in triangles}
    assert len(faces) == len(triangles)


def in_blocks(edges, side=8):
    """Edges by the block of voxels, then by the voxel, then by the axis."""

    def place(edge):
        axis, x, y, z = edge
        return z // side, y // side, x // side, z, y, x, axis

    return sorted(edges, key=place)


@on_gpu
@pytest.mark.parametrize("name", FIELDS)
def test_vertices_are_where_the_cpu_has_them(name):
    phi = FIELDS[name]()
    (cpu, _), (gpu, _) = zero_mesh(phi), zero_mesh(phi, GPU)
    on_edges = cpu[
        (np.abs(cpu - np.round(cpu)) < 1e-7).sum(axis=1) >= 2
    ]  # scikit-image has some within cells
    assert len(on_edges) > 0.99 * len(cpu)
    np.testing.assert_allclose(in_order(gpu), in_order(on_edges), rtol=0, atol=PLACE_ATOL)


@on_gpu
@pytest.mark.parametrize("make", [lambda: noise(8, 13, 20), lambda: smooth(30, 20, 9)])
def test_any_surface_is_closed(make):
    phi = np.pad(make(), 1, constant_values=1.0)
    vertices, faces = zero_mesh(phi, GPU)
    assert_closed(faces)
    assert volume_of(vertices, faces) > 0  # faces outwards


@on_gpu
def test_a_ball_is_that_of_the_cpu():
    phi = in_voxels(st.SDF.sphere(0.05, voxels=24))
    cpu, gpu = zero_mesh(phi), zero_mesh(phi, GPU)
    for vertices, faces in (cpu, gpu):
        assert_closed(faces)
        assert euler_number(vertices, faces) == 2
    assert len(gpu[1]) == len(cpu[1])
    # The same polygons, cut into triangles in another way: far less than what the ball has beyond them.
    ball = 4 / 3 * np.pi * (0.05 / st.SDF.sphere(0.05, voxels=24).voxel_size) ** 3
    assert abs(volume_of(*gpu) - volume_of(*cpu)) < 0.05 * abs(volume_of(*cpu) - ball)


@on_gpu
def test_a_box_of_plane_faces_has_the_volume_of_the_cpu():
    phi = in_voxels(st.SDF.box((0.05, 0.04, 0.03), voxels=24))
    assert volume_of(*zero_mesh(phi, GPU)) == pytest.approx(volume_of(*zero_mesh(phi)), rel=1e-6)


@on_gpu
def test_a_voxel_without_a_number_is_inside_as_on_the_cpu():
    phi = in_voxels(st.SDF.sphere(0.05, voxels=16))
    phi[3, 3, 3] = np.nan  # outside of the ball
    (cpu, _), (gpu, faces) = zero_mesh(phi), zero_mesh(phi, GPU)
    known = np.isfinite(gpu).all(axis=1)
    assert (~known).sum() == 6  # the edges around it
    np.testing.assert_allclose(
        in_order(gpu[known]), in_order(cpu[np.isfinite(cpu).all(axis=1)]), rtol=0, atol=PLACE_ATOL
    )
    assert_closed(faces)


@on_gpu
def test_a_shape_has_the_mesh_of_the_cpu():
    shape = st.SDF.cylinder(0.03, 0.08, voxels=24)
    cpu, gpu = shape.to_mesh(), shape.to_mesh(device="cuda")
    np.testing.assert_allclose(in_order(gpu.vertices * 1e3), in_order(cpu.vertices * 1e3), rtol=0, atol=1e-5)
    np.testing.assert_allclose(gpu.bounds, cpu.bounds, rtol=0, atol=1e-8)


@on_gpu
@pytest.mark.parametrize("value", [-1.0, 1.0])
def test_a_field_of_one_sign_has_no_mesh(value):
    values = np.full((9, 9, 9), value, np.float32)
    with pytest.raises(ValueError, match="no surface"):
        st.SDF(values, 0.01, np.zeros(3)).to_mesh(device="cuda")
    vertices, faces = zero_mesh(values, GPU)
    assert (vertices.shape, faces.shape) == ((0, 3), (0, 3))
