# SPDX-License-Identifier: MIT
"""Each measure on movements whose value can be written down, and against slow or foreign implementations."""

from itertools import pairwise

import numpy as np
import pytest
from motion_cases import minimum_jerk
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from sdftrack import motion
from sdftrack.motion.definitions import Context
from sdftrack.motion.measures.movement import movement_of
from sdftrack.motion.measures.targets import definitions_of_target

RATE_HZ = 200.0
FAR_M, MOVE_S, START_S, HOLD_S = 0.3, 1.0, 0.5, 0.8
WAY = np.array([0.48, 0.6, 0.64])  # of unit length
UP = np.array([0.0, 0.0, 1.0])
# The speed of a minimum-jerk movement, 30 u^2 (1 - u)^2 d / T, is 5 % of its peak at u (1 - u) = sqrt(0.05) / 4.
ONSET = 0.5 * (1 - np.sqrt(1 - np.sqrt(0.05)))
FIVE_PERCENT_S = (1 - 2 * ONSET) * MOVE_S
MOVED = minimum_jerk(1 - ONSET) - minimum_jerk(ONSET)  # of the distance, from onset to offset
JERK2 = quad(lambda u: (60 - 360 * u + 360 * u**2) ** 2, ONSET, 1 - ONSET)[0]
TURN_RAD = np.deg2rad(70)


def step(t, start_s, move_s=MOVE_S):
    """A minimum-jerk step from 0 to 1 and its first two derivatives."""
    u = np.clip((t - start_s) / move_s, 0, 1)
    return (minimum_jerk(u), 30 * u**2 * (1 - u) ** 2 / move_s, 60 * u * (1 - u) * (1 - 2 * u) / move_s**2)


def movement(t, x, v=None, a=None, axis=(0.0, 0.0, 1.0), turn=None, turn_rate=None, observed=None):
    """MotionSamples, S = 1, of positions (n, 3) and of an angle about an axis."""
    zero = np.zeros((len(t), 3))
    axis = np.asarray(axis, np.float64)
    angle = zero if turn is None else np.outer(turn, axis)
    rate = zero if turn_rate is None else np.outer(turn_rate, axis)
    v, a = (zero if q is None else q for q in (v, a))
    seen = np.ones(len(t), bool) if observed is None else observed
    R = Rotation.from_rotvec(angle).as_matrix()
    return motion.MotionSamples(t, x[None], v[None], a[None], 0 * x[None], R[None], rate[None], seen)


def times(end_s=2.0, rate_hz=RATE_HZ):
    return np.arange(round(end_s * rate_hz) + 1) / rate_hz


def reach(end_s=2.0, start_s=START_S, rate_hz=RATE_HZ):
    t = times(end_s, rate_hz)
    return movement(t, *(FAR_M * np.outer(s, WAY) for s in step(t, start_s)))


def there_and_back():
    """Out, a hold, and back; the context tells the movements."""
    t = times(4.0)
    second = START_S + MOVE_S + HOLD_S
    x = [FAR_M * np.outer(p - q, WAY) for p, q in zip(step(t, START_S), step(t, second), strict=True)]
    spans = ((START_S, START_S + MOVE_S), (second, second + MOVE_S))
    return movement(t, *x), Context(0.0, 4.0, movements=spans, cue_s=0.2, up=UP)


def rotation(axis, end_s=2.0):
    t = times(end_s)
    turn, rate, _ = (TURN_RAD * s for s in step(t, START_S))
    return movement(t, np.zeros((len(t), 3)), axis=axis, turn=turn, turn_rate=rate)


def value(name, samples, context=None):
    t = samples.times_s
    (one,) = motion.DEFINITIONS[name].compute(samples, context or Context(t[0], t[-1], up=UP))
    return float(one)


# Name: expected value and tolerance. Onset and offset lie between samples 5 ms apart; a mean over 176 samples may have
# one more or less at the ends, where the object hardly moves.
STRAIGHT = {
    "path_length": (FAR_M, 1e-9),
    "index_of_curvature": (1.0, 1e-9),
    "peak_speed": (1.875 * FAR_M / MOVE_S, 1e-9),
    "mean_speed": (MOVED * FAR_M / FIVE_PERCENT_S, 0.006 * FAR_M),
    "time_to_peak_speed": (0.5 * FIVE_PERCENT_S, 0.001),
    "time_to_peak_speed_part": (50.0, 0.1),
    "velocity_peaks": (1, 0),
    "peak_acceleration": (10 / np.sqrt(3) * FAR_M / MOVE_S**2, 1e-3 * FAR_M),
    "sparc": (-1.41, 0.02),
    "log_dimensionless_jerk": (-np.log(JERK2 * (1 - 2 * ONSET) ** 3 / 1.875**2), 0.02),
    "movement_time": (FIVE_PERCENT_S, 0.001),
    "repetition_time": (FIVE_PERCENT_S, 0.001),
    "range_x": (0.48 * FAR_M, 1e-9),
    "range_y": (0.6 * FAR_M, 1e-9),
    "range_z": (0.64 * FAR_M, 1e-9),
    "range_height": (0.64 * FAR_M, 1e-9),
    # The nearest of the directions is at most 2.5 degrees off.
    "range_horizontal": (np.hypot(0.48, 0.6) * FAR_M, 1e-3 * FAR_M),
    "reach": (FAR_M, 1e-9),
    "range_angle": (0, 1e-9),
    "range_turn": (0, 1e-9),
    "peak_angular_speed": (0, 1e-9),
    "max_tilt": (0, 1e-9),
    "mean_tilt": (0, 1e-9),
}


@pytest.mark.parametrize("name", STRAIGHT)
def test_a_straight_minimum_jerk_reach_has_the_value_of_the_formula(name):
    expected, tolerance = STRAIGHT[name]
    assert value(name, reach()) == pytest.approx(expected, abs=tolerance + 1e-12)


class TestTimes:
    @pytest.mark.parametrize(
        ("name", "expected", "tolerance"),
        [
            ("dwell_time", HOLD_S + 2 * ONSET * MOVE_S, 0.002),  # between offset and onset
            ("reaction_time", START_S + ONSET - 0.2, 0.001),  # from the cue to the onset
            # first onset to last offset
            ("repetition_time", 2 * MOVE_S + HOLD_S - 2 * ONSET * MOVE_S, 0.002),
        ],
    )  # fmt: skip
    def test_times_between_onsets_and_offsets(self, name, expected, tolerance):
        samples, context = there_and_back()
        assert value(name, samples, context) == pytest.approx(expected, abs=tolerance)

    def test_a_halt_of_less_than_a_tenth_of_a_second_is_part_of_the_movement(self):
        t = times(3.0)
        short, long = (
            movement(
                t, *(np.outer(p + q, WAY) for p, q in zip(step(t, 0.5), step(t, 1.5 + halt), strict=True))
            )
            for halt in (-0.05, 0.2)
        )
        assert movement_of(short).duration_s == pytest.approx(2 * MOVE_S - 0.05 - 2 * ONSET, abs=0.002)
        assert movement_of(long).duration_s == pytest.approx(FIVE_PERCENT_S, abs=0.002)

    def test_a_movement_that_the_recording_cuts_begins_and_ends_with_it(self):
        t = times(0.6)
        cut = movement(t, *(np.outer(s, WAY) for s in step(t, -0.2)))
        found = movement_of(cut)
        assert (found.onset_s[0], found.offset_s[0]) == (0.0, 0.6)


class TestPath:
    def test_the_index_of_a_half_circle_is_half_of_pi(self):
        t = times()
        s, ds, _ = step(t, START_S)
        x = 0.1 * np.column_stack([np.cos(np.pi * s), np.sin(np.pi * s), 0 * s])
        v = 0.1 * np.pi * ds[:, None] * np.column_stack([-np.sin(np.pi * s), np.cos(np.pi * s), 0 * s])
        # The ends below 5 % of the peak speed, half a per cent of the arc, are missing.
        part = MOVED * np.pi / 2 / np.sin(MOVED * np.pi / 2)
        assert value("index_of_curvature", movement(t, x, v)) == pytest.approx(part, abs=1e-3)
        assert value("path_length", movement(t, x, v)) == pytest.approx(0.1 * np.pi, rel=1e-3)

    def test_a_closed_path_has_no_index_of_curvature(self):
        t = times()
        s, ds, _ = step(t, START_S)
        x = 0.1 * np.column_stack([np.cos(2 * np.pi * s), np.sin(2 * np.pi * s), 0 * s])
        along = np.column_stack([-np.sin(2 * np.pi * s), np.cos(2 * np.pi * s), 0 * s])
        v = 0.2 * np.pi * ds[:, None] * along
        assert np.isnan(value("index_of_curvature", movement(t, x, v)))

    def test_the_path_leaves_out_what_lies_between_the_movements(self):
        samples, context = there_and_back()
        trembling, t, end_s = samples.positions_m.copy(), samples.times_s, START_S + MOVE_S
        held = (t > end_s + 0.01) & (t < end_s + HOLD_S - 0.01)
        trembling[0, held] += 1e-3 * np.random.default_rng(0).normal(size=(held.sum(), 3))
        shaken = movement(t, trembling[0], samples.velocities_mps[0])
        assert value("path_length", shaken, context) == pytest.approx(2 * FAR_M, rel=1e-6)

    def test_the_horizontal_range_does_not_depend_on_where_up_points(self):
        turn = Rotation.from_rotvec([0.3, -1.1, 0.4]).as_matrix()
        samples = reach()
        x, v = samples.positions_m[0] @ turn.T, samples.velocities_mps[0] @ turn.T
        turned = movement(samples.times_s, x, v)
        context = Context(0, 2, up=turn @ UP)
        assert value("range_height", turned, context) == pytest.approx(0.64 * FAR_M)
        across = value("range_horizontal", turned, context)
        assert across == pytest.approx(np.hypot(0.48, 0.6) * FAR_M, rel=1e-3)


class TestRotation:
    @pytest.mark.parametrize(
        ("axis", "turn", "tilt"),
        [((1, 0, 0), 0, TURN_RAD), ((0, 0, 1), TURN_RAD, 0), ((0, -1, 0), 0, TURN_RAD)],
    )
    def test_a_pure_rotation_has_its_angle_turn_and_tilt(self, axis, turn, tilt):
        samples = rotation(axis)
        assert value("range_angle", samples) == pytest.approx(TURN_RAD)
        # The angular speed is integrated over steps of 5 ms.
        assert value("range_turn", samples) == pytest.approx(turn, abs=1e-4)
        assert value("max_tilt", samples) == pytest.approx(tilt, abs=1e-9)
        assert value("peak_angular_speed", samples) == pytest.approx(1.875 * TURN_RAD / MOVE_S)

    def test_turning_by_more_than_half_a_turn_is_not_folded(self):
        t = times()
        turn, rate, _ = (np.deg2rad(500) * s for s in step(t, START_S))
        samples = movement(t, np.zeros((len(t), 3)), turn=turn, turn_rate=rate)
        assert value("range_turn", samples) == pytest.approx(np.deg2rad(500), rel=1e-4)
        assert value("range_angle", samples) == pytest.approx(np.pi, abs=0.05)

    def test_the_tilt_is_that_of_the_axis_that_points_up(self):
        samples = rotation((1, 0, 0))
        moving = Context(0, 2, up=UP, movements=((START_S, START_S + MOVE_S),))
        assert value("mean_tilt", samples, moving) == pytest.approx(0.5 * TURN_RAD, rel=1e-6)
        context = Context(0, 2, up=UP, axis_obj=np.array([0.0, 1.0, 0.0]))
        # The axis begins horizontal and rises towards the vertical.
        assert value("max_tilt", samples, context) == pytest.approx(0.5 * np.pi)
        along = Context(0, 2, up=UP, axis_obj=np.array([1.0, 0.0, 0.0]))
        assert value("max_tilt", samples, along) == pytest.approx(0.5 * np.pi)


class TestUndefined:
    OF_A_MOVEMENT = (
        "movement_time", "mean_speed", "time_to_peak_speed", "time_to_peak_speed_part", "velocity_peaks",
        "index_of_curvature", "sparc", "log_dimensionless_jerk", "repetition_time",
    )  # fmt: skip

    @pytest.mark.parametrize("name", OF_A_MOVEMENT)
    @pytest.mark.parametrize("drift_mps", [0.0, 0.002])
    def test_where_nothing_moves_measures_of_a_movement_are_undefined(self, name, drift_mps):
        t = times()
        still = movement(t, np.outer(drift_mps * t, WAY), np.full((len(t), 3), drift_mps) * WAY)
        assert np.isnan(value(name, still))

    @pytest.mark.parametrize("name", motion.DEFINITIONS)
    def test_a_gap_in_the_repetition_makes_every_measure_undefined(self, name):
        samples, context = there_and_back()
        seen = np.ones(len(samples.times_s), bool)
        for start in (START_S + 0.5, START_S + MOVE_S + HOLD_S + 0.5):  # in both movements
            seen[np.abs(samples.times_s - start) < 0.1] = False
        cut = motion.MotionSamples(
            samples.times_s,
            *(
                np.where(seen[None, :, None], getattr(samples, f), np.nan)
                for f in ("positions_m", "velocities_mps", "accelerations_mps2", "jerks_mps3")
            ),
            np.where(seen[None, :, None, None], samples.rotations, np.nan),
            np.where(seen[None, :, None], samples.angular_velocities_radps, np.nan),
            seen,
        )
        assert np.isfinite(value(name, samples, context)) or name == "index_of_curvature"
        assert np.isnan(value(name, cut, context))

    def test_a_gap_beside_the_repetition_changes_nothing(self):
        samples = reach()
        seen = samples.times_s < 1.8
        cut = movement(samples.times_s, samples.positions_m[0], samples.velocities_mps[0], observed=seen)
        assert value("path_length", cut, Context(0, 1.7)) == pytest.approx(FAR_M)

    @pytest.mark.parametrize(
        "name",
        [
            "range_height", "range_horizontal", "range_turn", "max_tilt", "mean_tilt", "reaction_time",
            "dwell_time",
        ],
    )  # fmt: skip
    def test_without_gravity_cue_and_hold_what_needs_them_is_undefined(self, name):
        assert np.isnan(value(name, reach(), Context(0, 2)))


class TestSmoothness:
    def profiles(self):
        rng = np.random.default_rng(4)
        for n in (2, 7, 64, 100, 301):
            yield np.abs(rng.normal(size=n)) + 0.01
        for n in (50, 128, 400):
            u = np.linspace(0, 1, n)
            yield u**2 * (1 - u) ** 2

    @pytest.mark.parametrize("rate_hz", [21.0, 30.0, 100.0])
    def test_sparc_is_that_of_the_published_code(self, rate_hz):
        smoothness = pytest.importorskip("monalysa.quality.smoothness")
        for speed in self.profiles():
            expected = smoothness.sparc(speed, rate_hz)[0]
            assert motion.sparc(speed, rate_hz) == pytest.approx(expected, abs=1e-6), len(speed)

    @pytest.mark.parametrize("rate_hz", [30.0, 100.0])
    def test_the_dimensionless_jerk_is_that_of_the_published_code(self, rate_hz):
        smoothness = pytest.importorskip("monalysa.quality.smoothness")
        rng = np.random.default_rng(5)
        for n, d in ((5, 1), (40, 3), (200, 3)):
            v = rng.normal(size=(n, d))
            expected = smoothness.log_dimensionless_jerk(v, rate_hz)
            assert motion.log_dimensionless_jerk(v, rate_hz) == pytest.approx(expected, abs=1e-6)
        v = np.outer(step(times(1.0), 0.0)[1], WAY)
        expected = smoothness.log_dimensionless_jerk(v, rate_hz)
        assert motion.log_dimensionless_jerk(v, rate_hz) == pytest.approx(expected, abs=1e-6)

    def test_two_submovements_are_less_smooth_than_one(self):
        t = times(2.0)
        halting = step(t, 0.0)[1] + step(t, 1.0)[1]
        assert motion.sparc(halting, RATE_HZ) < -1.6
        assert value(
            "velocity_peaks", movement(t, *(np.outer(p + q, WAY) for p, q in zip(
                step(t, 0.0), step(t, 0.9), strict=True)))
        ) == 2  # fmt: skip

    def test_zero_and_unknown_speeds_have_no_smoothness(self):
        speeds = np.array([[0.0, 0, 0, 0], [0, 1, np.nan, 0], [0, 1, 1, 0]])
        found = motion.sparc(speeds, 100.0)
        assert np.isnan(found[:2]).all()
        assert np.isfinite(found[2])
        assert np.isnan(motion.log_dimensionless_jerk(np.ones((5, 3)), 100.0))
        assert np.isnan(motion.log_dimensionless_jerk(np.ones((2, 3)), 100.0))


def slow_dtw(a, b, band):
    """Dynamic time warping cell by cell: the sum of distances over the number of pairs."""
    n, m = len(a), len(b)
    width = max(band, 1 / min(n, m))
    best = {(-1, -1): (0.0, 0)}
    for i in range(n):
        for j in range(m):
            if abs(i / max(n - 1, 1) - j / max(m - 1, 1)) > width:
                continue
            earlier = [best[c] for c in ((i - 1, j - 1), (i - 1, j), (i, j - 1)) if c in best]
            if earlier:
                total, count = min(earlier)
                best[i, j] = total + float(np.linalg.norm(a[i] - b[j])), count + 1
    total, count = best[n - 1, m - 1]
    return total / count


class TestTimeWarping:
    @pytest.mark.parametrize(
        "shape", [(20, 20), (25, 18), (11, 30), (60, 3), (7, 200), (1, 5), (5, 1), (1, 1)]
    )
    @pytest.mark.parametrize("band", [0.1, 0.3, 1.0])
    def test_it_is_the_slow_one(self, shape, band):
        rng = np.random.default_rng(sum(shape))
        a, b = (np.cumsum(rng.normal(size=(n, 3)), axis=0) for n in shape)
        assert motion.dtw_distance(a, b, band) == pytest.approx(slow_dtw(a, b, band), rel=1e-12)

    def test_the_mean_is_over_pairs(self):
        x = np.outer(np.linspace(0, 1, 30), [1.0, 0, 0])
        paths = [np.add(x, [0, y, 0]) for y in (0, 0.01, 0.03)]
        assert motion.mean_dtw_distance(paths) == pytest.approx(0.02)
        assert np.isnan(motion.mean_dtw_distance(paths[:1]))
        assert np.isnan(motion.mean_dtw_distance([]))


class TestTargets:
    POINTS = np.random.default_rng(7).uniform(-0.3, 0.3, (60, 3))

    def test_the_distance_from_a_box_is_that_from_its_surface(self):
        low, high = np.array([-0.1, -0.05, -0.2]), np.array([0.1, 0.15, 0.0])
        u = np.linspace(0, 1, 81)
        faces = []
        for axis in range(3):
            for side in (0, 1):
                grid = np.stack(np.meshgrid(u, u, [side], indexing="ij"), axis=-1).reshape(-1, 3)
                faces.append(np.roll(grid, axis - 2, axis=1))
        surface = low + np.concatenate(faces) * (high - low)
        inside = (np.clip(self.POINTS, low, high) == self.POINTS).all(axis=1)
        assert inside.any()
        nearest = np.linalg.norm(self.POINTS[:, None] - surface, axis=-1).min(axis=1)
        found = motion.Box(low, high).distances(self.POINTS)
        assert (np.sign(found) == np.where(inside, -1, 1)).all()
        # Half a diagonal of the grid of 2.5 mm is the most that the nearest of its points is off.
        assert np.abs(np.abs(found) - nearest).max() < 1.8e-3

    def test_the_distance_from_a_path_is_that_from_its_points(self):
        points = np.array([[0, 0, 0], [0.2, 0, 0], [0.2, 0.1, 0.1], [0.2, 0.1, 0.1]])
        u = np.linspace(0, 1, 2001)[:, None]
        line = np.concatenate([a + u * (b - a) for a, b in pairwise(points)])
        nearest = np.linalg.norm(self.POINTS[:, None] - line, axis=-1).min(axis=1)
        found = motion.Path(points, 0.02).distances(self.POINTS)
        np.testing.assert_allclose(found, nearest - 0.02, atol=1e-6)

    def test_time_and_distance_of_a_reach_through_a_sphere(self):
        samples = reach()
        sphere = motion.Sphere(FAR_M * WAY, 0.05)
        inside, nearest, mean, entries, error = (
            d.compute(samples, Context(0, 2))[0] for d in definitions_of_target(sphere, 1)
        )
        away = FAR_M * (1 - step(samples.times_s, START_S)[0])
        fine = np.linspace(0, 1, 100_001)
        enters = START_S + MOVE_S * fine[np.argmax(FAR_M * (1 - minimum_jerk(fine)) <= 0.05)]
        assert inside == pytest.approx(2 - enters, abs=2 / RATE_HZ)
        assert nearest == 0
        assert mean == pytest.approx(np.maximum(away - 0.05, 0).mean())
        assert entries == 1
        assert error == pytest.approx(0, abs=1e-12)

    def test_the_error_is_that_at_the_end_of_the_first_movement(self):
        samples, context = there_and_back()
        sphere = motion.Sphere(FAR_M * WAY + [0, 0, 0.01], 0.05)
        box = motion.Box(FAR_M * WAY - 0.02, FAR_M * WAY + [0.02, 0.02, 0.04])
        line = motion.Path([[0, 0, 0], FAR_M * WAY + [0, 0.02, 0]], 0.01)
        for target, expected in ((sphere, 0.01), (box, 0.01), (line, 0.02)):
            *_, error = definitions_of_target(target, 1)
            assert error.compute(samples, context)[0] == pytest.approx(expected, abs=1e-9)
            back = np.linalg.norm(target.aim_m)
            assert error.compute(samples, Context(0.0, 4.0))[0] == pytest.approx(back, abs=1e-9)

    def test_each_visit_is_an_entry_and_a_short_absence_is_none(self):
        t = times(3.0)
        inside = ((t > 0.5) & (t < 1.5) & ~((t > 1.0) & (t < 1.05))) | (t > 2.0)
        x = np.where(inside, 0.0, 1.0)[:, None] * [1.0, 0, 0]
        entries = definitions_of_target(motion.Sphere([0, 0, 0], 0.1), 1)[3]
        assert entries.name == "target1_entries"
        assert entries.compute(movement(t, x), Context(0.0, 3.0)).tolist() == [2]
        assert entries.compute(movement(t, 0 * x), Context(0.0, 3.0)).tolist() == [1]
        assert entries.compute(movement(t, 0 * x + 1), Context(0.0, 3.0)).tolist() == [0]
        gap = movement(t, x, observed=t != 1.0)
        assert np.isnan(entries.compute(gap, Context(0.0, 3.0))).all()

    def test_text_is_a_target(self, tmp_path):
        sphere = motion.parse_target("sphere:0,0.1,0.8,0.05")
        assert (sphere.center_m.tolist(), sphere.radius_m) == ([0, 0.1, 0.8], 0.05)
        box = motion.parse_target("box: 0, 0, 0.5, 0.1, 0.1, 0.6")
        assert (box.low_m.tolist(), box.high_m.tolist()) == ([0, 0, 0.5], [0.1, 0.1, 0.6])
        (tmp_path / "line.csv").write_text("# x,y,z\n0,0,0.8\n0.1,0,0.8\n")
        line = motion.parse_target(f"path:{tmp_path / 'line.csv'},0.02")
        assert line.points_m.tolist() == [[0, 0, 0.8], [0.1, 0, 0.8]]
        assert line.radius_m == 0.02

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("", "target: expected sphere:"),
            ("sphere:0,0,wide,1", "target 'sphere:0,0,wide,1': .*; expected sphere:"),
            ("sphere:0,0,1,0", "radius_m: expected more than 0"),
            ("sphere:0,0,nan,0.1", "center_m: expected three coordinates, finite"),
            ("sphere:0,0,800,50", "in mm"),
            ("box:0,0,0,0.1,0.1,0", "expected low < high"),
            ("path:/nowhere.csv,0.1", "/nowhere.csv: no such file"),
            # The rest is what a file of a path contains.
            ("0,0,0.8\n", "at least two points"),
            ("a,b,c\n", "expected lines of x,y,z"),
        ],
    )
    def test_what_is_no_target_is_told(self, tmp_path, text, message):
        if "\n" in text:
            (tmp_path / "line.csv").write_text(text)
            text = f"path:{tmp_path / 'line.csv'},0.02"
        with pytest.raises(ValueError, match=message):
            motion.parse_target(text)


NOISE_M = 0.5e-3  # of an axis


def held(rate_hz, seconds, seed, tremor_m=0.0, hz=6.0, status=None):
    """An object that is held and drifts slowly, with noise and a tremor of that amplitude along WAY."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(rate_hz * seconds)) / rate_hz
    T = np.tile(np.eye(4), (len(t), 1, 1))
    T[:, :3, 3] = [0, 0, 0.8] + 0.01 * np.outer(np.sin(0.7 * t), WAY) + NOISE_M * rng.normal(size=(len(t), 3))
    T[:, :3, 3] += tremor_m * np.outer(np.sin(2 * np.pi * hz * t + rng.uniform(0, 6)), WAY)
    return motion.Trajectory(t, T, status=status)


class TestTremor:
    TOGETHER = NOISE_M * np.sqrt(3)

    @pytest.mark.parametrize("rate_hz", [30, 60])
    @pytest.mark.parametrize("amplitude_m", [0.5e-3, 1e-3, 3e-3])
    def test_a_tremor_is_in_the_interval_and_at_its_frequency(self, rate_hz, amplitude_m):
        found = [
            motion.tremor_of(held(rate_hz, 4, seed, amplitude_m), 0, 4, noise_m=self.TOGETHER)
            for seed in range(40)
        ]
        inside = [f.low_m <= amplitude_m / np.sqrt(2) <= f.high_m for f in found]
        assert np.mean(inside) >= 0.9
        assert np.median([f.rms_m for f in found]) == pytest.approx(amplitude_m / np.sqrt(2), rel=0.1)
        # The main lobe of the tapers is 6 / (4 s) wide.
        assert all(abs(f.frequency_hz - 6) < 0.8 for f in found if f.determined)
        assert np.mean([f.determined for f in found]) > (0.9 if amplitude_m > 0.9e-3 else -1)

    @pytest.mark.parametrize("rate_hz", [30, 60])
    def test_a_resting_object_shows_the_floor_and_no_tremor(self, rate_hz):
        found = [motion.tremor_of(held(rate_hz, 4, seed), 0, 4, noise_m=self.TOGETHER) for seed in range(50)]
        total = np.mean([f.total_m for f in found])
        assert np.mean([f.floor_m for f in found]) == pytest.approx(total, rel=0.2)
        assert np.mean([f.low_m == 0 for f in found]) >= 0.9
        assert np.mean([f.determined for f in found]) <= 0.1

    def test_the_band_ends_below_half_of_the_frame_rate(self):
        assert motion.tremor_of(held(60, 4, 0), 0, 4, noise_m=1e-3).band_hz == (3, 12)
        assert motion.tremor_of(held(20, 4, 0), 0, 4, noise_m=1e-3).band_hz == pytest.approx((3, 9))

    def test_a_slow_movement_is_no_tremor(self):
        found = [
            motion.tremor_of(held(30, 4, seed, 5e-3, hz=0.5), 0, 4, noise_m=self.TOGETHER)
            for seed in range(20)
        ]
        assert np.mean([f.determined for f in found]) <= 0.1
        assert max(f.rms_m for f in found) < self.TOGETHER

    @pytest.mark.parametrize(
        ("trajectory", "span"),
        [
            (held(30, 4, 0), (1.0, 1.9)),  # shorter than a second
            (held(30, 4, 0), (5.0, 7.0)),  # outside the recording
            (held(12, 1.2, 0), (0.0, 1.2)),  # fewer than 16 frames
            (held(8, 4, 0), (0.0, 4.0)),  # up to 3.6 Hz only
            (held(30, 4, 0, status=["ok"] * 50 + ["lost"] + ["ok"] * 69), (0.0, 4.0)),
            (held(30, 4, 0).part(np.delete(np.arange(120), 50)), (0.0, 4.0)),
        ],
        ids=["short", "outside", "few", "slow", "lost", "gap"],
    )
    def test_short_stretches_and_gaps_have_none(self, trajectory, span):
        assert motion.tremor_of(trajectory, *span, noise_m=1e-3) is None
