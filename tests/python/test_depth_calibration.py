# SPDX-License-Identifier: MIT
"""Noise and bias of a depth camera from planes and from a known object, against the models that made the images."""

import math

import cv2
import numpy as np
import pytest

import sdftrack as st
from sdftrack import geometry
from sdftrack.cli.app import run

CAMERA = st.Camera(285.0, 285.0, 159.5, 119.5, 320, 240)
RAYS = np.dstack([CAMERA.rays, np.ones(CAMERA.shape)]).astype(np.float64)
TRUE = st.SensorModel(
    "true", noise_m=0.0006, noise_per_m=0.0015, noise_incidence=0.002, correlation_px=1.5, systematic_m=0.002,
    systematic_per_m=0.001,
)  # fmt: skip


def field(rng, length_px):
    """Unit variance, shared over so many pixels."""
    noise = rng.normal(size=CAMERA.shape)
    if length_px > 0:
        noise = cv2.GaussianBlur(noise, (0, 0), length_px / math.sqrt(2))
    return noise / noise.std()


def wall(sensor, distance, slant_deg, rng):
    a, around = math.radians(slant_deg), rng.uniform(0, 2 * np.pi)
    normal = -np.array([math.sin(a) * math.cos(around), math.sin(a) * math.sin(around), math.cos(a)])
    z = normal[2] * distance / (RAYS @ normal)
    z = np.where((z > 0.2) & (z < 4), z, 0)
    incidence = np.arccos(np.clip(np.abs(RAYS @ normal) / np.linalg.norm(RAYS, axis=-1), 0, 1))
    error = sensor.noise(z, incidence) * field(rng, sensor.correlation_px)
    error += sensor.systematic(z) * field(rng, 40)
    return st.Frame(np.where(z > 0, z + error, 0).astype(np.float32))


def walls(sensor, rng, distances=(0.5, 0.7, 0.9, 1.2, 1.5, 1.8), slants=(0, 30, 50)):
    return [wall(sensor, d, s, rng) for d in distances for s in slants]


def test_planes_give_back_the_model_that_made_them():
    found = st.calibrate_depth(walls(TRUE, np.random.default_rng(0)), CAMERA)
    assert (found.surface, found.used) == ("plane", 18)
    z = np.array([0.5, 1.0, 1.8])
    for degrees in (0, 30, 50):
        angle = math.radians(degrees)
        np.testing.assert_allclose(found.sensor.noise(z, angle), TRUE.noise(z, angle), rtol=0.15)
    assert found.sensor.correlation_px == pytest.approx(1.5, rel=0.15)
    # What a plane's own fit takes up is not seen: the smooth error comes out smaller, not larger.
    ratio = found.sensor.systematic(z) / TRUE.systematic(z)
    assert (ratio > 0.5).all()
    assert (ratio < 1.2).all()
    assert found.sensor.bias_m == 0  # nobody knows how far a wall is


def test_white_noise_is_not_said_to_be_shared():
    white = st.SensorModel("white", noise_m=0.002)
    sensor = st.calibrate_depth(walls(white, np.random.default_rng(1)), CAMERA).sensor
    assert sensor.correlation_px == 0
    np.testing.assert_allclose(sensor.noise([0.5, 1.8]), 0.002, rtol=0.1)
    assert sensor.systematic(1.0) < 0.0005


def test_what_was_filled_in_a_lattice_of_holes_has_no_noise_of_its_own():
    frames = walls(st.SensorModel("white", noise_m=0.002), np.random.default_rng(1))
    holed = [frame.depth.copy() for frame in frames]
    for depth in holed:
        depth[::3] = depth[:, ::3] = 0
    sensor = st.calibrate_depth([st.Frame(depth) for depth in holed], CAMERA).sensor
    np.testing.assert_allclose(sensor.noise([0.5, 1.8]), 0.002, rtol=0.1)


@pytest.fixture(scope="module")
def ball():
    return st.SDF.ellipsoid([0.12, 0.10, 0.08], voxels=100)


def test_a_known_object_gives_the_bias_too(ball):
    rng = np.random.default_rng(2)
    poses = [geometry.pose(rng.normal(0, 1, 3), [0, 0, z]) for z in np.linspace(0.5, 1.0, 12)]
    frames = []
    for T in poses:
        depth = ball.render(CAMERA, T)[0].astype(np.float64)
        error = 0.002 + 0.003 * depth**2 + rng.normal(0, 0.001, depth.shape)
        frames.append(st.Frame(np.where(depth > 0, depth + error, 0).astype(np.float32)))
    found = st.calibrate_depth(frames, CAMERA, model=ball, poses=poses)
    z = np.array([0.5, 0.75, 1.0])
    np.testing.assert_allclose(found.sensor.bias(z), 0.002 + 0.003 * z**2, atol=0.0003)
    np.testing.assert_allclose(found.sensor.noise(z), 0.001, rtol=0.15)
    # And a tracker that is told so is no longer off by it.
    told, untold = (
        st.Tracker(ball, CAMERA, threads=1, sensor=s).start(frames[6], poses=poses[6]).pose
        for s in (found.sensor, None)
    )
    assert abs(untold[2, 3] - poses[6][2, 3]) > 0.0025
    assert abs(told[2, 3] - poses[6][2, 3]) < 0.0005


def test_errors_are_one_clear_line(ball):
    rng = np.random.default_rng(3)
    few = walls(TRUE, rng, (0.6,), (0, 30))
    with pytest.raises(ValueError, match=r"^frames: expected at least 5 that show a plane, got 2 of 2$"):
        st.calibrate_depth(few, CAMERA)
    nothing = [st.Frame(np.zeros(CAMERA.shape, np.float32))] * 6
    with pytest.raises(
        ValueError, match=r"^frames: expected at least 5 that show a plane, got 0 of 6; the last"
    ):
        st.calibrate_depth(nothing, CAMERA)
    middle = np.zeros(CAMERA.shape, bool)
    middle[70:170, 110:210] = True  # the rest of the image sees the wall at other angles
    slanted = [
        st.Frame(np.where(middle, f.depth, np.float32(0)))
        for f in walls(TRUE, rng, (0.6, 0.8, 1.0), (62, 63))
    ]
    with pytest.raises(ValueError, match=r"^frames: expected some views at less than 40 deg"):
        st.calibrate_depth(slanted, CAMERA)
    with pytest.raises(ValueError, match=r"^poses: expected both model and poses"):
        st.calibrate_depth(few, CAMERA, model=ball)


def test_the_command_writes_a_sensor_that_a_tracker_takes(tmp_path, capsys):
    from sdftrack._internal.files import write_json
    from sdftrack.io.frames import write_depth_units

    seq = tmp_path / "seq"
    (seq / "depth").mkdir(parents=True)
    pinhole = {name: getattr(CAMERA, name) for name in ("fx", "fy", "cx", "cy")}
    write_json(seq / "camera.json", {"image_size": [320, 240], "depth_scale_m": 0.0001, "K_depth": pinhole})
    for i, frame in enumerate(walls(TRUE, np.random.default_rng(4), (0.5, 0.8, 1.2), (0, 30))):
        write_depth_units(seq / "depth" / f"{i:06d}.png", np.rint(1e4 * frame.depth).astype(np.uint16))
    out = tmp_path / "sensor.toml"
    assert run(["calibrate", "depth", str(seq), "--out", str(out), "--name", "mine"]) == 0
    assert "the noise is correlated over" in capsys.readouterr().out
    assert out.with_suffix(".png").stat().st_size > 10000
    sensor = st.SensorModel.load(out)
    assert sensor.name == "mine"
    tracker = st.Tracker(st.SDF.sphere(0.05, voxels=40), CAMERA, sensor=out)
    assert tracker.options.noise_m == sensor.noise_m
