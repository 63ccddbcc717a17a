# SPDX-License-Identifier: MIT
"""Sensor models: presets, files, what a tracker makes of them."""

import pickle

import numpy as np
import pytest

import sdftrack as st
from sdftrack import geometry
from sdftrack.sensor import PRESETS

CAMERA = st.Camera(285.0, 285.0, 159.5, 119.5, 320, 240)
POSE = geometry.pose([0.5, -0.4, 0.2], [0.01, -0.02, 0.6])


@pytest.fixture(scope="module")
def box():
    return st.SDF.box([0.10, 0.07, 0.05], voxels=80)


def test_presets_say_what_was_published():
    kinect = st.SensorModel.preset("kinect_v1")
    assert kinect.noise(1.0) - kinect.noise_m == pytest.approx(0.0014, abs=1e-4)  # Khoshelham and Elberink
    assert kinect.noise(1.0, np.radians(60)) > 1.3 * kinect.noise(1.0)
    assert 2 * st.SensorModel.preset("azure_kinect").systematic(1.0) == pytest.approx(0.011, abs=0.002)
    assert all(sensor.name == name and sensor.source for name, sensor in PRESETS.items())


@pytest.mark.parametrize("suffix", ["toml", "json"])
def test_files_give_back_what_was_saved(tmp_path, suffix):
    sensor = PRESETS["realsense_d400"].replace(name='my "D435"', bias_m=-0.002)
    path = tmp_path / f"sensor.{suffix}"
    sensor.save(path)
    assert st.SensorModel.load(path) == sensor
    assert st.SensorModel.of(path) == st.SensorModel.of(str(path)) == sensor


def test_a_tracker_takes_the_model_and_says_so(box):
    depth = box.render(CAMERA, POSE)[0]
    frame = st.Frame(np.where(depth > 0, depth + np.random.default_rng(0).normal(0, 0.001, depth.shape), 0))
    plain = st.Tracker(box, CAMERA, threads=1)
    named = st.Tracker(box, CAMERA, threads=1, sensor="azure_kinect", noise_m=0.0012)
    a, b = (t.start(frame, poses=POSE) for t in (plain, named))
    assert (a.sensor, b.sensor) == ("", "azure_kinect")
    assert a.systematic[0] == pytest.approx(0.002 + 0.004 * a.pose[2, 3] ** 2, rel=0.1)  # nothing is stated
    assert b.systematic.tolist() == [0.005]
    assert b.covariance[2, 2] > 0.9 * 0.005**2 > 0.8 * a.systematic[0] ** 2
    assert named.options.noise_m == 0.0012  # a single option goes before the sensor
    again = pickle.loads(pickle.dumps(named))
    assert (again.sensor, again.options) == (named.sensor, named.options)
    assert b.to_dict()["sensor"] == "azure_kinect"


def test_the_bias_is_taken_out_of_the_depth(box):
    depth = box.render(CAMERA, POSE)[0].astype(np.float64)
    sensor = st.SensorModel("biased", bias_m=0.004, bias_per_m=0.01)
    z = np.where(depth > 0, depth + sensor.bias(depth), 0).astype(np.float32)
    out = sensor.corrected(z)
    # the bias of the reading, not of the truth
    np.testing.assert_allclose(out[depth > 0], depth[depth > 0], atol=2e-4)
    assert (out[depth == 0] == 0).all()
    assert st.SensorModel("none").corrected(z) is z
    result = st.Tracker(box, CAMERA, threads=1, sensor=sensor).start(st.Frame(z), poses=POSE)
    np.testing.assert_allclose(result.pose[:3, 3], POSE[:3, 3], atol=5e-4)


def test_the_presets_keep_to_the_makers_bounds():
    d400 = PRESETS["realsense_d400"]
    assert 2 * d400.systematic(2.0) == pytest.approx(0.02 * 2.0, rel=0.15)
    assert d400.systematic(0.5) == pytest.approx(0.003, rel=0.1)


def test_distance_widens_what_is_shared(box):
    sensor = st.SensorModel("far", systematic_per_m=0.01)
    tracker = st.Tracker(box, CAMERA, threads=1, sensor=sensor, max_systematic_m=0.0)
    for z in (0.5, 0.9):
        T = geometry.pose([0.5, -0.4, 0.2], [0, 0, z])
        result = tracker.start(st.Frame(box.render(CAMERA, T)[0]), poses=T)
        assert result.systematic[0] == pytest.approx(0.01 * z**2, rel=0.02)
