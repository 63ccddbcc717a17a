# SPDX-License-Identifier: MIT
import copy
import pickle

import numpy as np
import pytest
import tracking_scene

import sdftrack as st
from sdftrack import _core
from sdftrack.mesh import Mesh

POSITION_ATOL = 1e-6  # float32 files of a 0.1 m object: 1e-8 m, .obj text 1e-8, with room
DEPTH_ATOL = 1e-6  # float32 depth near 0.5 m: half a unit in the last place is 3e-8 m


def box_mesh(size=(0.08, 0.05, 0.1), colors=False):
    mesh = tracking_scene.box_mesh(np.array(size))
    rgb = (np.arange(24).reshape(8, 3) * 10).astype(np.uint8) if colors else None
    return Mesh(mesh.vertices, mesh.faces, rgb)


def pose(rotation_vector=(0.4, -0.7, 0.2), t=(0.01, -0.02, 0.5)):
    return st.geometry.pose(rotation_vector, t)


def camera(width=40, height=30, distortion=()):
    return _core.Camera(50.0, 52.0, 19.3, 14.6, width, height, list(distortion))


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb", ".stl"])
def test_a_saved_mesh_loads_back_as_the_same_surface(tmp_path, suffix):
    mesh = box_mesh(colors=True)
    mesh = Mesh(mesh.vertices, mesh.faces, mesh.colors, seen=np.arange(8) % 3)
    mesh.save(tmp_path / f"box{suffix}")
    back = Mesh.load(tmp_path / f"box{suffix}")
    assert np.allclose(back.vertices[back.faces], mesh.vertices[mesh.faces], atol=POSITION_ATOL)
    assert [p.name for p in tmp_path.iterdir()] == [f"box{suffix}"]
    assert (back.seen is None) == (suffix in (".obj", ".stl"))
    if suffix in (".ply", ".glb"):
        assert np.array_equal(back.colors[back.faces], mesh.colors[mesh.faces])
        assert np.array_equal(back.seen[back.faces], mesh.seen[mesh.faces])


def test_the_unit_of_a_file_is_converted_to_metres(tmp_path):
    box_mesh(size=(80, 50, 100)).save(tmp_path / "mm.ply")
    assert np.allclose(np.ptp(Mesh.load(tmp_path / "mm.ply", unit="mm").vertices, axis=0), [0.08, 0.05, 0.1])


def test_a_mesh_pickles_copies_compares_and_is_short_in_print():
    mesh = box_mesh(colors=True)
    mesh.raycast(camera(), pose())  # what is cached must not be pickled or compared
    assert pickle.loads(pickle.dumps(mesh)) == mesh == copy.deepcopy(mesh)
    assert mesh != box_mesh()
    assert mesh != box_mesh(size=(1, 1, 1), colors=True)
    assert mesh != "mesh"
    assert repr(mesh) == "Mesh(8 vertices, 12 faces, 0.080 x 0.050 x 0.100 m, colored)"
    assert mesh._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(ValueError):
        mesh.vertices[0, 0] = 1
    with pytest.raises(AttributeError, match="read-only"):
        mesh.vertices = np.zeros((8, 3))


def cast(mesh, cam, T):
    """Depth, normals and colours of all rays by libigl, one by one, in the object's frame."""
    igl = pytest.importorskip("igl")
    faces, xy, R = mesh.faces.astype(np.int64), cam.rays(), T[:3, :3]
    eye, shape = -T[:3, 3] @ R, cam.rays().shape[:2]
    depth, normals, colors = np.zeros(shape), np.zeros((*shape, 3)), np.zeros((*shape, 3))
    for pixel in np.ndindex(shape):
        ray = np.append(xy[pixel], 1.0) @ R
        if hits := igl.ray_mesh_intersect(eye, ray, mesh.vertices, faces):
            face, depth[pixel], u, v = hits[0]
            a, b, c = mesh.vertices[faces[face]]
            n = np.cross(b - a, c - a)
            normals[pixel] = R @ n * -np.sign(n @ ray) / np.linalg.norm(n)
            colors[pixel] = [1 - u - v, u, v] @ mesh.colors[faces[face]].astype(float)
    return depth, normals, colors


@pytest.mark.parametrize("distortion", [(), (0.1, -0.05, 0.002, -0.001, 0.01)])
def test_ray_casting_agrees_with_every_ray_against_every_triangle(distortion):
    mesh, cam, T = box_mesh(colors=True), camera(distortion=distortion), pose()
    depth, normals, colors = mesh.raycast(cam, T)
    ref_depth, ref_normals, ref_colors = cast(mesh, cam, T)
    assert 50 < np.count_nonzero(depth) < depth.size / 2
    np.testing.assert_allclose(depth, ref_depth, atol=DEPTH_ATOL)
    np.testing.assert_allclose(normals, ref_normals, atol=1e-5)
    assert np.abs(colors.astype(int) - ref_colors).max() <= 1  # rounding to 8 bits


def test_only_what_is_before_the_camera_is_seen_and_a_camera_inside_sees_the_walls():
    mesh = box_mesh()
    assert not mesh.raycast(camera(), pose(t=(0, 0, -0.5)))[0].any()
    assert not mesh.raycast(camera(), pose(t=(5, 0, 0.5)))[0].any()
    depth, normals, _ = mesh.raycast(camera(), pose((0, 0, 0), (0, 0, 0)))
    assert (depth > 0).all()
    assert depth.max() <= 0.05 + DEPTH_ATOL
    rays = np.dstack([camera().rays(), np.ones((30, 40))])
    assert ((normals * rays).sum(axis=-1) < 0).all()
