# SPDX-License-Identifier: MIT
"""Synthetic exercises: exact derivatives, a truth that agrees with the motion, frames that show it."""

import itertools

import numpy as np
import pytest
from refusals import assert_refused, refused

import sdftrack as st
from sdftrack.synth.exercise_plans import PLANS
from sdftrack.synth.objects import OBJECTS

STEP_S = 1e-4
DERIVATIVE_RTOL = 1e-3  # central differences of STEP_S across the jumps of the snap; measured 4e-4
STILL = 1e-12  # sums of float64
SEEDS = range(5)
KINDS = list(PLANS)


def all_of(kinds=KINDS, seeds=SEEDS, **more):
    for kind in kinds:
        for seed in seeds:
            made = st.synth.exercise(kind, seed=seed, repetitions=2, **more)
            for k in range(made.objects):
                yield made, k


def phases(made, name):
    return [(a, b) for phase, a, b in made.phases if phase == name]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("origin_m", [0.0, 0.05])
def test_velocities_accelerations_jerks_and_angular_velocities_are_the_derivatives(kind, origin_m):
    for made, k in all_of([kind], origin_m=origin_m):
        times = np.random.default_rng(0).uniform(0, made.duration_s, 500)
        before, now, after = (made.sample(times + d, k) for d in (-STEP_S, 0, STEP_S))
        names = ("positions_m", "velocities_mps", "accelerations_mps2", "jerks_mps3")
        for value, slope in itertools.pairwise(names):
            expected = getattr(now, slope)
            found = (getattr(after, value) - getattr(before, value)) / (2 * STEP_S)
            assert np.abs(found - expected).max() < DERIVATIVE_RTOL * np.abs(expected).max()
        turning = (after.rotations - before.rotations) @ np.swapaxes(now.rotations, -1, -2) / (2 * STEP_S)
        w = np.stack([turning[..., 2, 1], turning[..., 0, 2], turning[..., 1, 0]], axis=-1)
        np.testing.assert_allclose(now.angular_velocities_radps, w, atol=DERIVATIVE_RTOL)


@pytest.mark.parametrize("kind", KINDS)
def test_even_the_jerk_is_continuous(kind):
    for made, k in all_of([kind], seeds=range(2)):
        ends = np.array(
            [t for _, *span in made.phases for t in span] + [t for r in made.repetitions for t in r]
        )
        a, b = made.sample(ends - 1e-7, k), made.sample(ends + 1e-7, k)
        assert np.abs(a.jerks_mps3 - b.jerks_mps3).max() < 1e-3
        # Between closer times it changes less; a jump would remain.
        coarse, fine = (
            np.abs(np.diff(made.sample(np.linspace(0, made.duration_s, n), k).jerks_mps3, axis=1)).max()
            for n in (5_001, 20_001)
        )
        assert fine < 0.35 * coarse


@pytest.mark.parametrize("kind", KINDS)
def test_rests_are_at_rest_on_the_table_with_the_axis_up(kind):
    for made, k in all_of([kind]):
        n, d = made.table
        assert np.linalg.norm(n) == pytest.approx(1)
        assert d > 0.3  # the camera is above the table
        for start, end in phases(made, "rest"):
            still = made.sample(np.linspace(start, end, 20), k)
            for values in (still.velocities_mps, still.jerks_mps3, still.angular_velocities_radps):
                assert np.abs(values).max() < STILL
            np.testing.assert_allclose(still.rotations[0, :, :, 2], np.tile(made.up, (20, 1)), atol=STILL)
            np.testing.assert_allclose(still.positions_m[0] @ n + d, 0, atol=STILL)


def test_repetitions_do_not_overlap_and_follow_their_cues():
    for made, _ in all_of():
        edges = np.ravel(made.repetitions)
        assert (np.diff(edges) >= 0).all()
        assert edges[0] > 0
        assert edges[-1] < made.duration_s
        starts = [start for start, _ in made.repetitions][: len(made.cues_s)]
        reactions = np.subtract(starts, made.cues_s)
        assert ((reactions > 0.15) & (reactions < 0.8)).all()
        assert len(made.cues_s) == (1 if made.kind == "circle" else 2)


def test_the_object_is_carried_as_far_and_tilted_as_much_as_the_kind_says():
    for made, _ in all_of(["reach", "pouring"], seeds=range(20)):
        for (a, _), (start, end) in zip(phases(made, "move"), phases(made, "hold"), strict=True):
            there = made.sample(np.linspace(start, end, 200))
            by = there.positions_m[0, 0] - made.sample([a]).positions_m[0, 0]
            across = np.linalg.norm(by - (by @ made.up) * made.up)
            tilt = np.degrees(np.arccos(np.minimum(1, there.rotations[0, :, :, 2] @ made.up))).max()
            if made.kind == "reach":
                assert 0.18 < across < 0.42
            else:
                assert 57 < tilt < 115


def test_the_tremor_has_the_frequency_and_amplitude_of_the_truth():
    made = st.synth.exercise("tremor", seed=3, tremor_hz=6.0, tremor_amplitude_m=0.002, repetitions=1)
    assert (made.tremor_hz, made.tremor_amplitude_m) == (6.0, 0.002)
    start, end = phases(made, "hold")[0]
    times = np.arange(start + 0.7, end - 0.7, 1 / 300)
    held = made.sample(times)
    # Slow drift and modulation are far below 2 Hz, so the spectrum shows the tremor alone.
    power = (
        np.abs(np.fft.rfft(held.accelerations_mps2[0] * np.hanning(len(times))[:, None], axis=0)) ** 2
    ).sum(1)
    hz = np.fft.rfftfreq(len(times), 1 / 300)
    assert abs(hz[power.argmax()] - 6.0) < 0.5
    size = np.linalg.norm(held.accelerations_mps2[0], axis=1).max() / (2 * np.pi * 6) ** 2
    assert 0.002 < size < 1.45 * 0.002  # modulated by up to 30 %
    still = st.synth.exercise("tremor", seed=3, tremor_amplitude_m=0, repetitions=1)
    assert still.tremor_hz is None
    assert still.tremor_amplitude_m == 0
    reach = st.synth.exercise("reach", tremor_hz=5.0, tremor_amplitude_m=0.001)
    assert (reach.tremor_hz, reach.tremor_amplitude_m) == (5.0, 0.001)
    assert st.synth.exercise("reach", tremor_hz=5.0).tremor_amplitude_m > 0


def test_the_objects_stay_in_view_and_above_the_table():
    camera = st.Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
    meshes = {name: st.synth.exercise_object(name).vertices[::200] for name in OBJECTS}
    for made, k in all_of(seeds=range(4)):
        n, d = made.table
        for T in made.poses(np.arange(0, made.duration_s, 0.4), k):
            for name, vertices in meshes.items():
                p = st.geometry.transform_points(T, vertices)
                px = camera.project(p)
                assert ((px >= 0) & (px <= [639, 479])).all(), (made, name)
                assert (p @ n + d).min() > -1e-9, (made, name)


@pytest.mark.parametrize("name", ["box", "can", "stick"])
def test_two_objects_touch_while_they_are_held_together_and_never_overlap(name):
    low, high = st.synth.exercise_object(name).bounds
    width = float(high[0] - low[0])
    for made, k in all_of(["two_handed"], seeds=range(8), meeting_m=width):
        if k:
            continue
        times = np.linspace(0, made.duration_s, 2000)
        left, right = made.sample(times, 0), made.sample(times, 1)
        apart = np.linalg.norm(right.positions_m - left.positions_m, axis=-1)[0]
        assert apart.min() > width - 1e-9
        for start, end in phases(made, "hold"):
            held = (times >= start) & (times <= end)
            np.testing.assert_allclose(apart[held], width, atol=STILL)
        np.testing.assert_array_equal(left.rotations, right.rotations)
        # The hands are not images of each other.
        assert np.abs(left.speeds_mps - right.speeds_mps).max() > 0.02


def test_frames_are_a_period_apart_and_poses_hold_the_samples():
    made = st.synth.exercise("reach", fps=25.0, repetitions=1)
    assert made.times_s[1] == 1 / 25
    assert made.times_s[-1] <= made.duration_s < made.times_s[-1] + 1 / 25
    exact, poses = made.sample(), made.poses()
    np.testing.assert_array_equal(poses[:, :3, 3], exact.positions_m[0])
    np.testing.assert_array_equal(poses[:, :3, :3], exact.rotations[0])
    assert exact.rate_hz == pytest.approx(25.0)
    assert exact.observed.all()


def reach(kind="reach", **given):
    return st.synth.exercise(kind, **given)


def shown(made=None, lower_m=0.0, count=1, **given):
    box = st.synth.exercise_object("box")
    moved = st.Mesh(box.vertices - [0, 0, lower_m], box.faces)
    return st.synth.exercise_sequence(made or reach(), moved if count == 1 else [moved] * count, **given)


@refused(
    (lambda: reach("jump"), ValueError, "kind: expected one of reach, pouring"),
    (lambda: reach(repetitions=0), ValueError, "repetitions: expected"),
    (lambda: reach(repetitions=1.5), TypeError, "repetitions: expected"),
    (lambda: reach(fps=-30), ValueError, "fps: expected"),
    (lambda: reach(seed=-1), ValueError, "seed: expected"),
    (lambda: reach(submovements=0), ValueError, "submovements: expected"),
    (lambda: reach("circle", tremor_hz=5), ValueError, "tremor: expected one of the kinds"),
    (lambda: reach("circle", submovements=2), ValueError, "submovements: circles have none"),
    (lambda: reach(tremor_amplitude_m=3), ValueError, "tremor_amplitude_m: expected 0 to 0.02 m"),
    (lambda: reach().sample([0.0], object=1), ValueError, "object: expected"),
    (lambda: reach().poses([np.nan]), ValueError, "times_s: expected finite"),
    (lambda: st.synth.exercise_object("piano"), ValueError, "name: expected one of cup"),
    (lambda: shown(count=2), ValueError, "meshes: expected 1"),
    (lambda: shown(lower_m=0.05), ValueError, r"create it with exercise\(\.\.\., origin_m=0\.0500\)"),
    (lambda: shown(around="objects"), ValueError, "around: expected"),
    (lambda: shown(frames=0), ValueError, "frames: expected"),
    (lambda: shown("reach"), TypeError, "exercise: expected"),
)
def test_an_exercise_that_cannot_be_says_why(call, error, words):
    assert_refused(call, error, words)
