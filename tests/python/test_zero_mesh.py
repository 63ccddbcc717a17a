# SPDX-License-Identifier: MIT
"""Marching cubes on the CPU and a GPU; the latter skips, and says so, where the build or the machine has no CUDA."""

import numpy as np
import pytest
from gpu_marks import MARKS
from levelset_scene import zero_crossings
from scipy.ndimage import gaussian_filter

import sdftrack as st
from sdftrack import _core

DEVICES = pytest.mark.parametrize("device", [-1, pytest.param(0, marks=MARKS)], ids=["cpu", "gpu"])


def zero_mesh(phi, device=-1):
    return _core.zero_mesh(phi, 0, device)


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
    "noise": lambda: noise(14, 13, 15),  # every case of a cell, and most pairs of cells side by side
    "zeros": lambda: np.round(noise(6, 9, 7)),
    "two voxels an axis": lambda: noise(2, 2, 2),
    "a slice": lambda: noise(2, 17, 9),
}


def assert_closed(faces):
    """Each side of a face is that of one other, in the opposite direction."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    sides, times = np.unique(ends, axis=0, return_counts=True)
    assert (times == 1).all()
    np.testing.assert_array_equal(np.unique(sides[:, ::-1], axis=0), sides)


def volume_of(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@DEVICES
@pytest.mark.parametrize("name", [*FIELDS, *ODD_FIELDS])
def test_there_is_a_vertex_where_an_edge_is_cut_and_all_have_faces(name, device):
    phi = (FIELDS | ODD_FIELDS)[name]()
    vertices, faces = zero_mesh(phi, device)
    assert (vertices.dtype, faces.dtype) == (np.float64, np.int32)
    cuts = zero_crossings(-phi.astype(np.float64), 1, (0, 0, 0))  # a voxel at 0 is inside
    np.testing.assert_allclose(in_order(vertices), in_order(cuts), rtol=0, atol=1e-8)
    np.testing.assert_array_equal(np.unique(faces), np.arange(len(vertices)))
    for ours, cpus in zip((vertices, faces), zero_mesh(phi), strict=True):
        np.testing.assert_array_equal(ours, cpus)


def in_order(points):
    return points[np.lexsort(np.round(points, 9).T)]


@DEVICES
@pytest.mark.parametrize("make", [lambda: noise(8, 13, 20), lambda: smooth(30, 20, 9)])
def test_any_surface_is_closed(make, device):
    phi = np.pad(make(), 1, constant_values=1.0)
    vertices, faces = zero_mesh(phi, device)
    assert_closed(faces)
    assert volume_of(vertices, faces) > 0  # faces outwards


@DEVICES
def test_a_voxel_without_a_number_is_inside(device):
    phi = in_voxels(st.SDF.sphere(0.05, voxels=16))
    phi[3, 3, 3] = np.nan  # outside of the ball
    vertices, faces = zero_mesh(phi, device)
    assert (~np.isfinite(vertices).all(axis=1)).sum() == 6  # the edges around it
    assert_closed(faces)


@DEVICES
@pytest.mark.parametrize("value", [-1.0, 1.0])
def test_a_field_of_one_sign_has_no_mesh(value, device):
    values = np.full((9, 9, 9), value, np.float32)
    with pytest.raises(ValueError, match="no surface"):
        st.SDF(values, 0.01, np.zeros(3)).to_mesh(device="cpu" if device < 0 else "cuda")
    vertices, faces = zero_mesh(values, device)
    assert (vertices.shape, faces.shape) == ((0, 3), (0, 3))
