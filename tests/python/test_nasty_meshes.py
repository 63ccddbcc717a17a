# SPDX-License-Identifier: MIT
"""Meshes as they come: none is refused that the winding number can decide, and its sign is that number's."""

import warnings

import nasty_meshes as nasty
import numpy as np
import pytest
from test_sdf import grid_points

from sdftrack.sdf import SDF

MESHES = nasty.nasty_meshes()
RIGHT = 0.999  # of the voxels; the grid's rows and the hole's dipoles may err beside the surface
POINTS = 1500


def winding_number(points, vertices, faces):
    """Sum of all solid angles over 4 pi."""
    return pytest.importorskip("igl").winding_number(vertices, np.asarray(faces, np.int64), points)


def made(mesh, voxels=40, holes="error"):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sdf = SDF.from_mesh(mesh, voxels=voxels, holes=holes)
    return sdf, [str(w.message) for w in caught]


@pytest.mark.slow
@pytest.mark.parametrize("name", MESHES)
def test_the_sign_is_that_of_the_sum_of_all_solid_angles(name):
    mesh, holes, meant = MESHES[name]
    sdf, _ = made(mesh, holes=holes)
    points, values = grid_points(sdf).reshape(-1, 3), sdf.values.ravel()
    # Half of them near the surface, where a sign can be wrong.
    near = np.argsort(np.abs(values))[: len(values) // 8]
    rng = np.random.default_rng(0)
    pick = np.concatenate([rng.choice(near, POINTS // 2), rng.choice(len(values), POINTS // 2)])
    truth = winding_number(points[pick], np.asarray(meant[0]), meant[1]) > 0.5
    assert truth.any()
    assert ((values[pick] < 0) == truth).mean() >= RIGHT


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("turned 0", "it was inside out; the faces were flipped outwards"),
        ("one of two turned 0", "1 of its parts were inside out"),
        ("double-sided 0", "12 faces were double-sided"),
        ("cracked 0", "no gap as wide as a voxel"),
        ("cut by itself 2", "it intersects itself: .* count as outside"),
    ],
)
def test_what_was_done_to_a_mesh_is_told(name, message):
    mesh, holes, _ = MESHES[name]
    with pytest.warns(UserWarning, match=message):
        SDF.from_mesh(mesh, voxels=60, holes=holes)


def test_turned_and_double_sided_meshes_give_the_same_volume_as_good_ones():
    b, far = nasty.box(), nasty.box(centre=(0.16, 0, 0))
    for mesh, whole, attribute, count in [
        (nasty.turned(b), b, "inverted_parts", 1),
        (nasty.joined(b, nasty.turned(far)), nasty.joined(b, far), "inverted_parts", 1),
        (nasty.double_sided(b), b, "double_sided_faces", 12),
        (nasty.with_unused_nan(b), b, "inverted_parts", 0),
    ]:
        sdf, _ = made(mesh)
        assert np.array_equal(sdf.values, made(whole)[0].values)
        assert getattr(sdf.report, attribute) == count


def test_sheets_that_enclose_nothing_are_refused():
    v, f = nasty.box()
    with pytest.raises(ValueError, match=r"expected a closed surface, got .* open edges"):
        SDF.from_mesh((v, f[:4]), voxels=40)
    sheet = nasty.box((0.1, 0.08, 0.06), w=(0, 0, 0))
    with pytest.raises(ValueError, match="flat"):
        SDF.from_mesh((sheet[0], sheet[1][:2]), voxels=40, holes="close")
