# SPDX-License-Identifier: MIT
"""The source's likelihood of a voxel (thesis Eqs. 4.28 to 4.31), by formula and in the core."""

import numpy as np
import pytest

import sdftrack as st

SLANTED = st.Camera(500.0, 500.0, 160.0, 120.0, 321, 241)


def slanted_plane():
    """Depth (m) of a plane that leans by 45 degrees, half a metre away on the middle pixel's ray."""
    u = np.arange(SLANTED.width)
    row = 0.5 / (1 - (u - SLANTED.cx) / SLANTED.fx)  # z = 0.5 + x
    return np.broadcast_to(row, (SLANTED.height, SLANTED.width)).astype(np.float32)


def said_at(point_m, depth, sigma_d_m, mask=None):
    """What the core says of one point of the camera's frame."""
    grid = ((2, 2, 2), 1e-3, point_m)
    ratio = st.levelset.evidence(
        st.Frame(depth), SLANTED, np.eye(4), grid, form="printed", sigma_d_m=sigma_d_m, mask=mask
    )
    return float(ratio[0, 0, 0])


def test_two_millimetres_behind_a_slanted_plane_the_printed_formula_gives_2_085():
    # d = 2 mm along the ray, sigma_d = 8 mm: q = e^(-1/4), log(L_in / L_out) = log((1 + q) / (1 - q)).
    q = np.exp(-0.25)
    assert np.log((1 + q) / (1 - q)) == pytest.approx(2.085, abs=5e-4)
    at = (0.0, 0.0, 0.502)
    assert said_at(at, slanted_plane(), 0.008) == pytest.approx(2.085, abs=5e-4)


def test_only_the_objects_readings_speak_and_all_of_them_do():
    depth = slanted_plane()
    mask = np.zeros(depth.shape, np.uint8)
    mask[120, 160] = 1  # a single pixel, all of it border
    assert said_at((0.0, 0.0, 0.502), depth, 0.008, mask) == pytest.approx(2.0846, abs=5e-4)
    mask[:] = 1
    mask[120, 160] = 0  # what is not the object's carves nothing
    assert said_at((0.0, 0.0, 0.3), depth, 0.008, mask) == 0
    assert said_at((0.0, 0.0, 0.502), depth, 0.008, mask) == 0
