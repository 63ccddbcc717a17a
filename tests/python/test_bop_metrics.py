# SPDX-License-Identifier: MIT
"""BOP's errors against cases whose answers are known."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack import metrics
from sdftrack.geometry import pose

CAMERA = st.Camera(100.0, 120.0, 31.5, 23.5, 64, 48)
T = pose([0.3, -0.2, 0.9], [0.02, 0.01, 0.8])
RING = 0.05 * np.array([[np.cos(a), np.sin(a), 0] for a in np.arange(0, 2 * np.pi, np.pi / 4)])
QUARTER = st.Symmetry(np.array([pose([0, 0, k * np.pi / 2]) for k in (1, 2, 3)]))
WHEEL = st.Symmetry(continuous=(([0, 0, 1], [0, 0, 0]),))


def test_mssd_of_a_shift_is_its_length_and_of_a_turn_its_longest_chord():
    assert metrics.mssd(pose(t_m=[0.03, 0, 0.04]) @ T, T, RING) == pytest.approx(0.05)
    turned = T @ pose([0, 0, 0.4])
    assert metrics.mssd(turned, T, RING) == pytest.approx(2 * 0.05 * np.sin(0.2))
    far = np.concatenate([RING, [[0.2, 0, 0]]])
    assert metrics.mssd(turned, T, far) == pytest.approx(2 * 0.2 * np.sin(0.2))


def test_mssd_forgives_the_turns_that_are_stated_and_no_other():
    turned = T @ pose([0, 0, np.pi / 2 + 0.1])
    assert metrics.mssd(turned, T, RING, QUARTER) == pytest.approx(2 * 0.05 * np.sin(0.05))
    assert metrics.mssd(T @ pose([0, 0, np.pi / 2]), T, RING, QUARTER) < 1e-12
    assert metrics.mssd(T @ pose([0, 0, np.pi / 2]), T, RING) > 0.07
    # Within half a step of a 315th of a circle.
    assert metrics.mssd(T @ pose([0, 0, 1.234]), T, RING, WHEEL) <= 0.05 * np.pi / 315 + 1e-12
    assert metrics.mssd(T @ pose([0.3, 0, 0]), T, RING, WHEEL) > 0.01


def test_mspd_of_a_shift_across_is_that_in_pixels():
    plate = np.array([[x, y, 0.0] for x in (-0.05, 0.05) for y in (-0.05, 0.05)])
    at = pose(t_m=[0, 0, 0.5])
    assert metrics.mspd(pose(t_m=[0.01, 0, 0]) @ at, at, plate, CAMERA) == pytest.approx(100 * 0.01 / 0.5)
    assert metrics.mspd(pose(t_m=[0, 0.01, 0]) @ at, at, plate, CAMERA) == pytest.approx(120 * 0.01 / 0.5)
    # Along the axis the corners move: f x (1 / z - 1 / z').
    nearer = np.hypot(100, 120) * 0.05 * (1 / 0.4 - 1 / 0.5)
    assert metrics.mspd(pose(t_m=[0, 0, 0.4]), at, plate, st.RGBDCamera(CAMERA)) == pytest.approx(nearer)
    half = st.Symmetry(np.diag([-1.0, -1, 1, 1])[None])
    assert metrics.mspd(at @ np.diag([-1.0, -1, 1, 1]), at, plate, CAMERA, half) < 1e-9
    assert metrics.mspd(pose(t_m=[0, 0, -0.5]), at, plate, CAMERA) == np.inf


def rectangle(x0, x1, z=0.5):
    d = np.zeros((48, 64))
    d[10:30, x0:x1] = z
    return d


def test_vsd_counts_the_pixels_that_are_not_shown_alike():
    true = rectangle(10, 30)
    scene = np.where(true > 0, true, 1.0)
    assert metrics.vsd(scene, true, true, CAMERA, 0.02) == 0
    shifted = rectangle(15, 35)
    # 15 columns alike, 5 of the truth alone, 5 of the estimate alone.
    assert metrics.vsd(scene, shifted, true, CAMERA, 0.02) == pytest.approx(10 / 25)
    assert metrics.vsd(scene, rectangle(40, 60), true, CAMERA, 0.02) == 1
    assert metrics.vsd(scene, np.zeros_like(true), true, CAMERA, 0.02) == 1
    assert metrics.vsd(scene, np.zeros_like(true), np.zeros_like(true), CAMERA, 0.02) == 1


def test_vsd_measures_along_the_ray_and_needs_no_hidden_part():
    true = rectangle(10, 30)
    scene = np.where(true > 0, true, 1.0)
    behind = rectangle(10, 30, 0.53)  # hidden by nothing that is not the object: visible by the truth's mask
    errors = metrics.vsd(scene, behind, true, CAMERA, [0.01, 0.02, 0.05])
    assert errors.tolist() == [1.0, 1.0, 0.0]
    # Near the border a ray is longer than its depth.
    v, u = np.indices(true.shape)
    ray = np.sqrt(((u - 31.5) / 100) ** 2 + ((v - 23.5) / 120) ** 2 + 1)
    beyond = (0.03 * ray[true > 0] >= 0.0305).mean()
    assert 0 < beyond < 1
    assert metrics.vsd(scene, behind, true, CAMERA, 0.0305) == pytest.approx(beyond)
    # An occluder before columns 10 to 20 of both: those pixels count for neither.
    covered = scene.copy()
    covered[:, 10:20] = 0.3
    assert metrics.vsd(covered, rectangle(15, 35), true, CAMERA, 0.02) == pytest.approx(5 / 15)
    assert metrics.vsd(np.zeros_like(scene), true, true, CAMERA, 0.02) == 0  # no reading hides nothing


def test_average_recall_is_the_mean_over_thresholds():
    ar = metrics.average_recall(
        vsd_errors=[[0.0] * 10, [0.26] * 10], mssd_errors=[0.0, 0.0249, np.nan, np.inf],
        mspd_errors=[0.0, 12.0], diameter=0.1, width=1280,
    )  # fmt: skip
    assert ar["AR_VSD"] == pytest.approx((1 + 0.5) / 2)  # below 0.3, 0.35, ..., 0.5
    assert ar["AR_MSSD"] == pytest.approx((1 + 0.6) / 4)  # below 25 mm, 30 mm, ..., 50 mm
    assert ar["AR_MSPD"] == pytest.approx((1 + 0.9) / 2)  # 10 px, 20 px, ...
    assert ar["AR"] == pytest.approx(np.mean([ar["AR_VSD"], ar["AR_MSSD"], ar["AR_MSPD"]]))
    assert list(metrics.average_recall(mspd_errors=[1.0])) == ["AR_MSPD", "AR"]
