# SPDX-License-Identifier: MIT
"""A tracker names what its frames do not determine, and does not call lost what they show."""

import itertools

import numpy as np
import pytest
import trimesh
from reconstruction_scene import begun

import sdftrack as st
from sdftrack import geometry, synth

RADIUS_M, HEIGHT_M = 0.033, 0.10


def mesh_of(body, scale=1.0):
    return st.Mesh(scale * np.asarray(body.vertices), np.asarray(body.faces))


BODIES = {
    "can": lambda: trimesh.creation.cylinder(radius=RADIUS_M, height=HEIGHT_M, sections=64),
    "ball": lambda: trimesh.creation.icosphere(4, 0.04),
    "bottle": lambda: trimesh.creation.revolve(
        [[0, 0], [0.03, 0], [0.035, 0.05], [0.02, 0.12], [0.012, 0.15], [0.012, 0.17], [0, 0.17]], sections=64
    ),
}


def tracked(mesh, sequence, mode="depth", **options):
    """(results, angles about the object's z axis from frame to frame, degrees)."""
    tracker = st.Tracker(st.SDF.from_mesh(mesh, voxels=80), sequence.camera, mode=mode, **options)
    results = [tracker.start(sequence[0], poses=[sequence.ground_truth[0][0]])]
    results += [tracker.track(sequence[i]) for i in range(1, len(sequence))]
    steps = []
    for before, now in itertools.pairwise(results):
        R = before.pose[:3, :3].T @ now.pose[:3, :3]
        steps.append(np.degrees(np.arctan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])))
    return results, np.array(steps)


@pytest.mark.parametrize("mode", ["depth", "auto"])
@pytest.mark.parametrize("body", sorted(BODIES))
def test_a_turn_that_nothing_shows_is_named_and_not_made_up(body, mode):
    mesh = mesh_of(BODIES[body]())
    sequence = synth.sequence(mesh, 15, trajectory="static", noise="stereo", clutter="objects", seed=8)
    results, steps = tracked(mesh, sequence, mode)
    assert abs(steps.sum()) < 3
    assert np.abs(steps).max() < 1
    what = "rotation about 3 axes" if body == "ball" else "rotation about the axis (0.00, 0.00, 1.00)"
    named = [r.status[0] == "weak" and what in r.reason[0] for r in results]
    assert sum(named) >= 14
    axis = results[-1].pose[:3, 2]
    assert np.sqrt(axis @ results[-1].covariance[3:, 3:] @ axis) > 1


def test_a_declared_symmetry_leaves_nothing_undetermined():
    mesh = mesh_of(BODIES["can"]())
    sequence = synth.sequence(mesh, 8, trajectory="static", noise=0.001, clutter="objects", seed=3)
    axis = st.Symmetry(continuous=(([0, 0, 1], [0, 0, 0]),))
    results, _ = tracked(mesh, sequence, symmetry=axis)
    assert [r.status[0] for r in results] == ["ok"] * 8


def test_no_velocity_is_learnt_about_an_axis_that_nothing_shows():
    mesh = mesh_of(BODIES["can"]())
    walk = synth.random_walk(step_m=0.006, step_rad=0.03)
    sequence = synth.sequence(mesh, 20, trajectory=walk, noise=0.001, clutter="objects", seed=5)
    results, steps = tracked(mesh, sequence)
    truth = [sequence.ground_truth[i][0] for i in range(20)]
    off = [np.linalg.norm(r.pose[:3, 3] - g[:3, 3]) for r, g in zip(results, truth, strict=True)]
    tilt = [
        np.degrees(np.arccos(min(1, r.pose[:3, 2] @ g[:3, 2]))) for r, g in zip(results, truth, strict=True)
    ]
    assert max(off) < 0.002
    assert max(tilt) < 2
    assert np.abs(steps).max() < 1


@pytest.mark.parametrize("scale", [0.95, 1.0, 1.05])
def test_another_size_is_named_with_an_interval_that_contains_it(scale):
    duck = synth.duck_mesh()
    walk = synth.random_walk(step_m=0.004, step_rad=0.03)
    other = st.Mesh(scale * duck.vertices, duck.faces, duck.colors)
    sequence = synth.sequence(other, 30, trajectory=walk, noise=0.001, clutter="objects", seed=4)
    results, _ = tracked(duck, sequence)
    named = [r.reason[0] for r in results if "than the model" in r.reason[0]]
    if scale == 1:
        assert not named
        return
    assert results[-1].status[0] == "weak"
    assert len(named) > 10
    low, high = map(float, named[-1].split("(")[1].split(")")[0].split(" to "))
    assert ("larger" if scale > 1 else "smaller") in named[-1]
    assert low <= 100 * abs(scale - 1) <= high
    assert high - low < 2


@pytest.mark.parametrize(("axis", "stretch"), [(0, 0.75), (2, 0.87)])
def test_another_shape_is_named_with_the_axis_along_which_it_differs(axis, stretch):
    duck = synth.duck_mesh()
    walk = synth.random_walk(step_m=0.004, step_rad=0.03)
    other = st.Mesh(duck.vertices * np.where(np.arange(3) == axis, stretch, 1), duck.faces, duck.colors)
    sequence = synth.sequence(other, 16, trajectory=walk, noise=0.001, clutter="objects", seed=4)
    results, _ = tracked(duck, sequence)
    assert sum(r.ok for r in results) <= 2
    assert results[-1].status[0] == "weak"
    named = results[-1].reason[0]
    percent, way = named.split("appears ")[1].split(" % ")
    assert way.startswith("shorter" if stretch < 1 else "longer")
    assert abs(float(percent) - 100 * abs(stretch - 1)) < 8
    along = [float(x) for x in way.split("(")[1].split(")")[0].split(", ")]
    assert abs(along[axis]) > 0.95


@pytest.mark.parametrize("tilt", [0.0, 0.1, 0.2])
def test_a_thin_thing_seen_end_on_is_followed(tilt):
    rod = mesh_of(trimesh.creation.box((0.18, 0.02, 0.006)))
    pose = np.eye(4)
    pose[:3, :3] = trimesh.transformations.rotation_matrix(np.pi / 2 + tilt, (0.1, 1, 0))[:3, :3]
    pose[:3, 3] = 0.02, 0.01, 0.6
    sequence = synth.sequence(rod, 3, trajectory=np.tile(pose, (3, 1, 1)), noise=0.001, seed=2)
    assert sequence.masks(0)[0].sum() > 150
    tracker = st.Tracker(st.SDF.from_mesh(rod, voxels=200), sequence.camera, mode="depth")
    result = tracker.start(sequence[0], poses=[pose])
    assert result.status[0] in ("ok", "weak"), result.reason[0]
    assert result.confidence[0] > 0.1
    assert np.linalg.norm(result.pose[:3, 3] - pose[:3, 3]) < 0.003


def test_an_object_without_depth_is_followed_by_its_outline_while_the_table_has_depth():
    duck = synth.duck_mesh()
    walk = synth.random_walk(step_m=0.004, step_rad=0.02)
    sequence = synth.sequence(duck, 8, trajectory=walk, noise="stereo", clutter="objects", seed=6)
    tracker = st.Tracker(st.SDF.from_mesh(duck, voxels=80), sequence.camera)
    errors = []
    for i in range(8):
        mask = sequence.masks(i)[0]
        depth = np.where(mask, 0, sequence[i].depth).astype(np.float32)
        frame = st.Frame(depth, sequence[i].color, sequence[i].timestamp)
        truth = sequence.ground_truth[i][0]
        result = tracker.start(frame, poses=[truth]) if i == 0 else tracker.track(frame)
        assert result.status[0] == "weak"
        assert "outline" in result.reason[0]
        errors.append(np.linalg.norm(result.pose[:3, 3] - truth[:3, 3]))
    assert max(errors) < 0.01


CAMERA = st.Camera(400.0, 400.0, 159.5, 119.5, 320, 240)


def on_a_turntable(mesh, noise, frames=24, step_deg=4.0, camera=CAMERA, seed=5):
    """A sequence without colour of a mesh that turns about its z axis before a camera that looks down at it."""
    tilt = geometry.pose((np.radians(120), 0, 0), (0, 0, 0))
    poses = [
        geometry.pose((0, 0, 0), (0, 0, 0.5))
        @ tilt
        @ geometry.pose((0, 0, np.radians(step_deg * i)), (0, 0, 0))
        for i in range(frames)
    ]
    return synth.sequence(
        mesh, frames, trajectory=np.array(poses), noise=noise, camera=camera, seed=seed, color=False
    )


def with_handle():
    can = trimesh.creation.cylinder(radius=0.035, height=HEIGHT_M, sections=48)
    return trimesh.util.concatenate(
        [can, trimesh.creation.box((0.05, 0.014, 0.06)).apply_translation([0.04, 0, 0])]
    )


@pytest.mark.parametrize("noise", ["stereo", 0.001])
@pytest.mark.parametrize("body", sorted(BODIES))
def test_noise_that_was_fused_into_a_shape_is_no_form(body, noise):
    mesh = mesh_of(BODIES[body]())
    mesh = st.Mesh(mesh.vertices - mesh.vertices.mean(axis=0), mesh.faces)
    sequence = on_a_turntable(mesh, noise)
    star, (_, *results) = begun(len(sequence), sequence, voxels=96)
    assert sum(r.ok for r in results) <= 3
    assert all(r.ok or r.reason[0].startswith("undetermined: ") for r in results)
    sds = [np.sqrt(np.linalg.eigvalsh(r.covariance[3:, 3:])[-1]) for r in results]
    assert np.median(sds) > 1
    assert star.quality().frames == len(sequence)  # each adds to the shape


HELD_OUT = {
    "cone": lambda: trimesh.creation.revolve(
        [[0, -0.06], [0.04, -0.06], [0.005, 0.06], [0, 0.06]], sections=64
    ),
    "jar": lambda: trimesh.creation.revolve(
        [[0, -0.04], [0.03, -0.04], [0.045, 0], [0.03, 0.04], [0, 0.04]], sections=64
    ),
    "egg": lambda: trimesh.creation.icosphere(4, 0.035).apply_scale([1, 1, 1.4]),
}


@pytest.mark.parametrize("noise", ["kinect", 0.0015])
@pytest.mark.parametrize("body", sorted(HELD_OUT))
def test_bodies_that_no_threshold_was_chosen_on(body, noise):
    camera = st.Camera(500.0, 500.0, 199.5, 149.5, 400, 300)
    sequence = on_a_turntable(mesh_of(HELD_OUT[body]()), noise, 20, 5.0, camera, seed=17)
    _, (_, *results) = begun(len(sequence), sequence, voxels=128)
    assert sum(r.ok for r in results) <= 2


def test_a_handle_determines_the_turn_while_it_is_seen():
    sequence = on_a_turntable(mesh_of(with_handle()), "stereo", frames=12)
    _, (first, *results) = begun(len(sequence), sequence, voxels=96)
    assert all(r.ok for r in results)
    truth = sequence.ground_truth
    turned = results[-1].pose @ np.linalg.inv(first.pose) @ truth[0][0]
    assert st.metrics.pose_error(turned, truth[len(sequence) - 1][0])[1] < np.radians(2)
