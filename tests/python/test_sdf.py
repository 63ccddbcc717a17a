# SPDX-License-Identifier: MIT
import copy
import pickle
import warnings

import numpy as np
import pytest
import tracking_scene

import sdftrack as st
from reference import sdf as reference
from sdftrack import _core
from sdftrack.sdf import SDF

# The band is exact up to float32 (1e-8 m of 0.1 m, 1e-5 voxel) and the 2^-18 voxel of the sign's rows.
BAND_ATOL_VOXELS = 1e-3
# First order upwind differences over some tens of voxels: measured 0.9 on scanned objects at 200 voxels.
FAR_ATOL_VOXELS = 1.5
# Sharp edges between the voxels are cut off by the interpolant; measured 0.7.
REDISTANCED_EDGE_ATOL_VOXELS = 1.0


def box_arrays(size=(0.08, 0.05, 0.1), centre=(0.0, 0.0, 0.0)):
    mesh = tracking_scene.box_mesh(np.array(size))
    return mesh.vertices + centre, mesh.faces.copy()


def grid_points(sdf):
    z, y, x = np.meshgrid(*(np.arange(n) for n in sdf.values.shape), indexing="ij")
    return sdf.origin + sdf.voxel_size * np.stack([x, y, z], axis=-1)


def signed_distances(points, vertices, faces):
    igl = pytest.importorskip("igl")
    kind = igl.SignedDistanceType.SIGNED_DISTANCE_TYPE_WINDING_NUMBER
    return igl.signed_distance(points, vertices, faces.astype(np.int64), kind)[0]


def random_rigid(seed=0):
    T = _core.rotation_exp(list(np.random.default_rng(seed).normal(size=3)))
    T[:3, 3] = [0.02, -0.03, 0.01]
    return T


# ---- from a mesh ----
def test_a_tiny_grid_agrees_with_every_point_against_every_triangle():
    vertices, faces = box_arrays()
    T = random_rigid()
    vertices = vertices @ T[:3, :3].T + T[:3, 3]
    sdf = SDF.from_mesh((vertices, faces), voxels=24)
    truth = signed_distances(grid_points(sdf).reshape(-1, 3), vertices, faces).reshape(sdf.values.shape)
    near = np.abs(truth) < 5.9 * sdf.voxel_size
    np.testing.assert_allclose(sdf.values[near], truth[near], atol=BAND_ATOL_VOXELS * sdf.voxel_size)
    assert np.array_equal(sdf.values < 0, truth < 0)


MESHES = [
    f"meshes/{n}.ply"
    for n in ("bunny", "lm_ape", "lm_can", "lm_cat", "lm_driller", "lm_duck", "lm_glue", "spot")
]
MESHES += [f"ycbv10/models/obj_00000{i}.ply" for i in (1, 2, 3)]


@pytest.mark.parametrize("name", MESHES)
def test_scanned_objects_agree_with_libigl(data_dir, name):
    if not (data_dir / name).is_file():
        pytest.skip(f"no {data_dir / name}")
    mesh = st.Mesh.load(data_dir / name, unit="mm" if name.startswith("ycbv") else None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        sdf = SDF.from_mesh(mesh, voxels=90)
    assert sdf.report.watertight
    rng = np.random.default_rng(0)
    cells = np.argwhere(np.abs(sdf.values) < 5.5 * sdf.voxel_size)
    cells = cells[rng.choice(len(cells), 1500, replace=False)]
    points = sdf.origin + sdf.voxel_size * cells[:, ::-1]
    truth = signed_distances(points, mesh.vertices, mesh.faces)
    assert np.abs(sdf.values[tuple(cells.T)] - truth).max() / sdf.voxel_size < 0.02


def test_a_thin_plate_warns_and_the_named_voxels_cure_it():
    outer, faces = box_arrays((0.1, 0.1, 0.1))
    inner = box_arrays((0.096, 0.096, 0.096))[0]
    shell = np.concatenate([outer, inner]), np.concatenate([faces, faces[:, ::-1] + 8])
    with pytest.warns(UserWarning, match="thinner than 2 voxels") as caught:
        SDF.from_mesh(shell, voxels=100)
    named = int(str(caught[0].message).split("voxels=")[1])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        SDF.from_mesh(shell, voxels=named)
    with pytest.raises(ValueError, match=r"no voxel lies inside.*use voxels="):
        SDF.from_mesh(shell, voxels=50)


def test_split_vertices_duplicate_and_flipped_faces_are_repaired():
    vertices, faces = box_arrays()
    soup = vertices[faces].reshape(-1, 3), np.arange(36, dtype=np.int32).reshape(-1, 3)
    whole = SDF.from_mesh((vertices, faces), voxels=30)
    assert SDF.from_mesh(soup, voxels=30) == whole
    assert SDF.from_mesh(soup, voxels=30).report.merged_vertices == 28
    doubled = SDF.from_mesh((vertices, np.concatenate([faces, faces[:3], [[0, 1, 1]]])), voxels=30)
    assert doubled == whole
    assert (doubled.report.duplicate_faces, doubled.report.degenerate_faces) == (3, 1)
    faces[2] = faces[2][::-1]
    with pytest.warns(UserWarning, match="1 faces were oriented against"):
        assert SDF.from_mesh((vertices, faces), voxels=30) == whole


def test_a_hole_is_an_error_or_closed_on_request():
    ball = SDF.sphere(0.05, voxels=50).to_mesh()
    low = ball.faces[ball.vertices[ball.faces].mean(axis=1)[:, 2] < 0.04]
    with pytest.raises(ValueError, match=r"closed surface, got \d+ open edges.*holes='close'"):
        SDF.from_mesh((ball.vertices, low), voxels=50)
    closed = SDF.from_mesh((ball.vertices, low), voxels=50, holes="close")
    assert not closed.report.watertight
    points = grid_points(closed)
    cap = np.minimum(np.linalg.norm(points, axis=-1) - 0.05, 1)
    truth = np.maximum(cap, points[..., 2] - 0.04)  # the ball with its cap cut off, near its surface
    sure = np.abs(truth) > 1.5 * closed.voxel_size
    assert np.array_equal((closed.values < 0)[sure], (truth < 0)[sure])
    near = (np.abs(truth) < 3 * closed.voxel_size) & (points[..., 2] < 0.02)
    assert np.abs(closed.values - truth)[near].max() < 0.1 * closed.voxel_size


def test_the_unit_and_every_kind_of_source_give_the_same_volume(tmp_path):
    vertices, faces = box_arrays()
    mesh = st.Mesh(vertices, faces)
    mesh.save(tmp_path / "box.ply")
    whole = SDF.from_mesh(mesh, voxels=30)
    assert SDF.from_mesh(mesh.to_trimesh(), voxels=30) == whole
    for other in (
        SDF.from_mesh(tmp_path / "box.ply", voxels=30),
        SDF.from_mesh((1000 * vertices, faces), 30, unit="mm"),
    ):
        np.testing.assert_allclose(other.values, whole.values, atol=1e-7)  # float32 in the file


def test_padding_follows_the_rule():
    assert np.allclose(SDF.sphere(0.05).bounds, [[-0.075] * 3, [0.075] * 3])  # 25 mm is more than a tenth
    assert np.allclose(SDF.sphere(0.5, voxels=50).bounds, [[-0.6] * 3, [0.6] * 3])
    wide = SDF.box((0.1, 0.05, 0.05), voxels=41, padding=0.5)
    assert wide.values.shape[2] == 41
    assert np.allclose(wide.bounds[:, 0], [-0.1, 0.1])


# ---- sampled, moved, joined ----
def test_samples_agree_with_their_twin_inside_and_outside_the_box():
    sdf = SDF.box((0.05, 0.04, 0.03), voxels=20)
    points = np.random.default_rng(1).uniform(-0.1, 0.1, (200, 3))
    values, gradients = sdf(points), sdf.gradient(points)
    for p, value, gradient in zip(points, values, gradients, strict=True):
        phi, g = reference.sample(sdf.values, sdf.voxel_size, sdf.origin, p)
        # voxel size and origin are float32 in the core
        assert value == pytest.approx(phi, abs=1e-7)
        np.testing.assert_allclose(gradient, g, atol=1e-5)
    assert sdf(points.reshape(20, 10, 3)).shape == (20, 10)
    assert sdf(points[0]).shape == ()


def test_a_moved_shape_has_the_same_distance_at_the_moved_point():
    sdf, T = SDF.box((0.05, 0.04, 0.03), voxels=60), random_rigid()
    moved = sdf.transformed(T)
    points = np.random.default_rng(2).uniform(-0.025, 0.025, (300, 3))
    np.testing.assert_allclose(moved(points @ T[:3, :3].T + T[:3, 3]), sdf(points), atol=sdf.voxel_size)
    shift = np.eye(4)
    shift[:3, 3] = [0.1, 0, 0]
    assert np.array_equal(sdf.transformed(shift).values, sdf.values)


def test_redistancing_restores_a_squeezed_field_and_keeps_its_surface():
    truth = SDF.sphere(0.04, voxels=50)
    squeezed = SDF(np.tanh(truth.values / 0.01).astype(np.float32), truth.voxel_size, truth.origin)
    back = squeezed.redistanced()
    error = np.abs(back.values - truth.values) / truth.voxel_size
    # curvature of the squeezed field
    assert error[np.abs(truth.values) < 3.5 * truth.voxel_size].max() < 0.05
    assert error.max() < FAR_ATOL_VOXELS
    assert np.array_equal(back.values < 0, truth.values < 0)
    box = SDF.box((0.05, 0.04, 0.03), voxels=50)
    error = np.abs(box.redistanced().values - box.values) / box.voxel_size
    assert error[np.abs(box.values) < 3.5 * box.voxel_size].max() < REDISTANCED_EDGE_ATOL_VOXELS


def test_a_union_is_inside_where_either_is_and_a_distance_outside():
    a = SDF.sphere(0.03, voxels=50)
    shift = np.eye(4)
    shift[:3, 3] = [0.04, 0, 0]
    b = a.transformed(shift)
    both = st.union(a, b)
    points = grid_points(both)
    truth = np.minimum(np.linalg.norm(points, axis=-1), np.linalg.norm(points - [0.04, 0, 0], axis=-1)) - 0.03
    outside = (truth > 0.5 * a.voxel_size) & (truth < 3 * a.voxel_size)
    assert np.abs(both.values - truth)[outside].max() < 0.4 * a.voxel_size  # the crease between the balls
    sure = np.abs(truth) > 0.3 * a.voxel_size
    assert np.array_equal((both.values < 0)[sure], (truth < 0)[sure])
    smooth = st.smooth_union(a, b, radius=0.01)
    assert smooth([[0.02, 0.0, 0.0223607]])[0] < -0.002 < both([[0.02, 0.0, 0.0223607]])[0]  # filled crease


def test_its_mesh_is_closed_outward_and_on_the_surface():
    sdf = SDF.ellipsoid((0.05, 0.03, 0.02), voxels=60)
    mesh = sdf.to_mesh()
    assert mesh.to_trimesh().is_watertight
    assert mesh.to_trimesh().volume == pytest.approx(4 / 3 * np.pi * 0.05 * 0.03 * 0.02, rel=0.01)
    assert np.abs(sdf(mesh.vertices)).max() < 0.05 * sdf.voxel_size


def test_surface_samples_lie_on_the_surface_evenly_with_outward_normals():
    sdf = SDF.sphere(0.05, voxels=60)
    points, normals = sdf.surface_samples(4000)
    assert len(points) == 4000
    assert np.abs(sdf(points)).max() < 1e-6
    radial = points / np.linalg.norm(points, axis=1)[:, None]
    assert ((radial * normals).sum(axis=1) > 0.99).all()
    octant = np.bincount((points > 0) @ [1, 2, 4], minlength=8)
    assert octant.min() > 0.9 * 500
    assert octant.max() < 1.1 * 500
    assert np.array_equal(points, sdf.surface_samples(4000)[0])
    assert len(SDF(np.ones((4, 4, 4), np.float32), 0.01, np.zeros(3)).surface_samples(10)[0]) == 0


@pytest.mark.parametrize("count", [300, 1000, 1808])
def test_surface_samples_leave_no_hole(count):
    """No place of a sphere is much farther from a sample than the samples are from one another."""
    directions = np.random.default_rng(0).normal(size=(3000, 3))
    places = 0.03 * directions / np.linalg.norm(directions, axis=1)[:, None]
    points = SDF.sphere(0.03, voxels=60).surface_samples(count)[0].astype(float)
    spacing = np.sqrt(4 * np.pi * 0.03**2 / count)
    nearest = np.linalg.norm(places[:, None] - points, axis=2).min(axis=1)
    assert nearest.max() < 1.5 * spacing


# ---- kept ----
def test_a_volume_pickles_copies_compares_and_is_short_in_print():
    sdf = SDF.cone(0.03, 0.1, voxels=30)
    assert sdf == pickle.loads(pickle.dumps(sdf)) == copy.deepcopy(sdf)
    assert sdf != SDF.cone(0.03, 0.09, voxels=30)
    assert sdf != "sdf"
    assert repr(sdf) == "SDF(23 x 23 x 30 voxels of 5.17 mm)"
    assert sdf._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(ValueError, match="read-only"):
        sdf.values[0, 0, 0] = 1


def test_a_cropped_volume_has_the_same_values_at_the_same_places():
    ball = st.SDF.sphere(0.03, voxels=64)
    wide = np.pad(ball.values, 20, constant_values=0.05)
    ball = st.SDF(wide, ball.voxel_size, ball.origin - 20 * ball.voxel_size)
    small = ball.cropped(4)
    assert small.values.size < 0.5 * ball.values.size
    points = np.random.default_rng(0).uniform(-0.032, 0.032, (500, 3))
    np.testing.assert_allclose(small(points), ball(points), atol=1e-7)
    assert small.cropped(4) == small
