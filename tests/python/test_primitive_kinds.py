# SPDX-License-Identifier: MIT
"""The table of kinds that the core keeps: what Python, the command line and the synthetic scenes make of it."""

import numpy as np
import pytest

import sdftrack as st
from reference.primitives import distance
from sdftrack import _core
from sdftrack.primitives.result import KINDS, SIZES, SOLIDS, TABLE, volume_of

LENGTHS_M = (0.05, 0.09, 0.07)
EXPONENTS = (0.4, 1.2)
MADE = {
    "sphere": lambda a, b, c: st.SDF.sphere(a, voxels=24),
    "cylinder": lambda a, b, c: st.SDF.cylinder(a, b, voxels=24),
    "cone": lambda a, b, c: st.SDF.cone(a, b, voxels=24),
    "box": lambda a, b, c: st.SDF.box((a, b, c), voxels=24),
    "ellipsoid": lambda a, b, c: st.SDF.ellipsoid((a, b, c), voxels=24),
}


@pytest.mark.parametrize("kind", SOLIDS)
def test_a_volume_holds_the_distances_of_its_solid_whoever_makes_it(kind):
    size = dict(zip(SIZES[kind], LENGTHS_M, strict=False))
    made, given = MADE[kind](*LENGTHS_M), volume_of(kind, size, 24)
    np.testing.assert_array_equal(given.values, made.values)
    np.testing.assert_array_equal(given.origin, made.origin)
    assert given.voxel_size == made.voxel_size
    z, y, x = np.indices(made.values.shape)
    points = made.origin + made.voxel_size * np.stack([x, y, z], axis=-1).reshape(-1, 3)
    exact = _core.primitive_distances(TABLE[kind].member, list(size.values()), points)[0]
    np.testing.assert_allclose(made.values.ravel(), exact, atol=1e-7)  # float32


@pytest.mark.parametrize("kind", KINDS)
def test_a_solid_ends_at_its_half_extent(kind):
    size = dict(zip(SIZES[kind], LENGTHS_M + EXPONENTS, strict=False))
    half = TABLE[kind].half_extent(list(size.values()))
    # Of a cone the extent along x is reached at its base.
    height = -half[2] if kind == "cone" else 0.0
    tips = np.array([[half[0], 0, height], [0, half[1], height], [0, 0, half[2]]])
    np.testing.assert_allclose(distance(kind, size, tips), 0, atol=1e-9)
