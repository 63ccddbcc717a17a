# SPDX-License-Identifier: MIT
"""Exercises with known truth and noise of known covariance, measured as a whole."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from motion_cases import SD_M, SD_RAD, noisy, reaches
from scipy.spatial.transform import Rotation

import sdftrack as st
from experiments.exercise.truth import true_values
from sdftrack import motion
from sdftrack.motion.report import compare_sessions

POSITIONS = ("range_x", "range_y", "range_z", "reach", "path_length", "peak_speed_move", "movement_time_move")
TURNS = ("range_angle", "range_turn", "peak_angular_speed")
UP = (0.0, 0.0, 1.0)


def tracked(kind, seed, repetitions=3):
    """An exercise and its trajectory with noise."""
    exercise = st.synth.exercise(kind, seed=seed, repetitions=repetitions)
    exact = exercise.sample()
    rotations = Rotation.from_matrix(exact.rotations[0])
    return exercise, noisy(exact.times_s, exact.positions_m[0], rotations, seed=seed)


@cache
def measured_exercise(kind, seed):
    exercise, trajectory = tracked(kind, seed)
    return exercise, motion.analyze(trajectory, cues_s=exercise.cues_s, up=exercise.up)


def session(starts_s=(1.0, 4.5, 8.0), away_m=(0.25, 0.1, 0.0), seed=0, move_s=0.8, fps=30, **fields):
    """The trajectory of reaches along a straight line."""
    t = np.arange(12 * fps) / fps
    return noisy(t, reaches(t, starts_s, away_m, move_s), seed=seed, **fields)


def unseen(start_s, end_s):
    """The session with the object lost for a while."""
    trajectory = session()
    status = ["lost" if start_s < t < end_s else "ok" for t in trajectory.times_s]
    return dataclasses.replace(trajectory, status=status)


def measured_session(**fields):
    return motion.analyze(session(**fields), up=UP)


def half_width(analysis, name):
    m = analysis.averages[name]
    return 0.5 * (m.high - m.low)


@pytest.mark.slow
def test_the_intervals_hold_the_truth():
    """Ninety-five of a hundred are meant to; the values of one exercise share their noise, so fewer may by chance."""
    inside = {}
    for kind in ("reach", "pouring"):
        for seed in range(300, 304):
            exercise, found = measured_exercise(kind, seed)
            for repetition in found.repetitions:
                truth = true_values(found, repetition, exercise.sample)
                assert truth.keys() == repetition.values.keys()
                for name, m in repetition.values.items():
                    if np.isfinite([m.value, truth[name]]).all():
                        inside.setdefault(name, []).append(m.low - 1e-9 <= truth[name] <= m.high + 1e-9)
    everything = np.concatenate(list(inside.values()))
    assert len(everything) > 500
    assert everything.mean() >= 0.85, {name: np.mean(v) for name, v in inside.items()}
    # No measure is off as a whole.
    assert min(np.mean(v) for v in inside.values()) >= 0.6, {n: np.mean(v) for n, v in inside.items()}


class TestOneSession:
    def test_a_straight_reach_has_its_distance_and_speed(self):
        found = measured_session()
        away = np.hypot(0.25, 0.1)
        for name, expected in (
            ("reach", away), ("range_x", 0.25), ("range_y", 0.1), ("path_length", 2 * away),
            ("peak_speed_move", 1.875 * away / 0.8), ("peak_speed_return", 1.875 * away / 0.8),
        ):  # fmt: skip
            m = found.averages[name]
            assert m.determined, name
            # Three repetitions share no noise; the average may be off by the noise of one of them.
            assert m.value == pytest.approx(expected, rel=0.03), name
            assert m.low < m.value < m.high
        assert found.averages["velocity_peaks_move"].value == 1
        assert found.averages["time_to_peak_speed_part_move"].value == pytest.approx(50, abs=5)
        assert found.averages["dwell_time"].value == pytest.approx(0.7, abs=0.15)
        assert found.variation["reach"] < 0.02
        assert found.path_difference_m < 5 * SD_M
        assert found.shares == {"ok": 1, "weak": 0, "lost": 0, "bad_frame": 0}

    def test_an_average_is_corrected_once_like_its_repetitions(self):
        found = measured_session()
        for name, m in found.averages.items():
            each = [r.values[name].value for r in found.repetitions]
            # Of noise alone the lower end is 0, and a value below it is set to 0.
            alone = any(r.values[name].low == 0 for r in found.repetitions)
            if np.isfinite(each).all() and not alone:
                assert m.value == pytest.approx(np.mean(each), rel=0.01, abs=0.01 * np.ptp(each)), name

    def test_the_same_seed_gives_the_same_numbers_and_the_smoother_may_run_before(self):
        trajectory = session()
        one = motion.analyze(trajectory, up=UP, seed=3)
        other = motion.analyze(motion.smooth(trajectory, seed=3), up=UP)
        assert one.averages == other.averages

    @pytest.mark.parametrize(
        "options", [{"by": "smell"}, {"measures": ["reach", "elegance"]}, {"spans_s": [(1.0, 13.0)]}], ids=str
    )
    def test_wrong_options_are_told(self, options):
        with pytest.raises(ValueError, match=f"^{next(iter(options))}: expected"):
            motion.analyze(session(), **options)

    def test_nothing_moves(self):
        found = measured_session(starts_s=())
        assert found.count == (0, 0, 0)
        assert (found.repetitions, found.averages, found.tremors) == ([], {}, [])
        assert np.isnan(found.path_difference_m)


class TestDirections:
    @pytest.mark.parametrize(
        "away", [(0.25, 0.1, 0), (-0.25, 0.1, 0), (0, -0.3, 0), (0, 0.3, 0), (0.1, 0, -0.2)]
    )
    def test_long_holds_are_counted_whichever_way_the_object_is_carried(self, away):
        t = np.arange(20 * 30) / 30
        x = reaches(t, (0.5, 6.5, 12.5), away, hold_s=3.6)
        found = motion.analyze(noisy(t, x, seed=2), measures=["reach"])
        assert found.count == (3, 3, 3)
        for r, start in zip(found.repetitions, (0.5, 6.5, 12.5), strict=True):
            assert r.span.start_s == pytest.approx(start, abs=0.15)
            assert r.span.end_s == pytest.approx(start + 5.2, abs=0.15)

    @pytest.mark.slow
    def test_an_exercise_that_is_away_most_of_the_time_is_no_circle(self):
        for kind, seed, count in (("pouring", 311, 3), ("tremor", 303, 2)):
            _, trajectory = tracked(kind, seed, count)
            assert motion.analyze(trajectory, measures=["reach"]).count == (count, count, count)


class TestByHand:
    def test_a_stretch_in_which_nothing_moves_has_a_range_of_zero(self):
        found = motion.analyze(session(starts_s=()), spans_s=[(2.0, 5.0)], up=UP)
        (r,) = found.repetitions
        for name in ("reach", "range_x", "range_y", "range_z", "range_height", "range_angle", "max_tilt"):
            m = r.values[name]
            assert m.low == 0, name
            assert 0 <= m.value <= m.high < 5 * SD_RAD, name


class TestCues:
    def test_a_cue_belongs_to_the_repetition_that_follows(self):
        # One for the first, none for the second, two for the third, of which the later one counts, and one too late.
        found = motion.analyze(session(), cues_s=[11.5, 7.6, 0.5, 7.0])
        assert [r.cue_s for r in found.repetitions] == [0.5, None, 7.6]
        times = [r.values["reaction_time"] for r in found.repetitions]
        assert np.isnan(times[1].value)
        # A minimum-jerk movement exceeds 5 % of its speed after 6 % of its time.
        assert [times[0].value, times[2].value] == pytest.approx([0.5 + 0.05, 0.4 + 0.05], abs=0.06)


class TestSessions:
    def test_a_real_change_is_shown(self):
        changes = compare_sessions(
            {
                "monday": [measured_session(seed=1)],
                "friday": [measured_session(seed=2, away_m=(0.3, 0.12, 0.0), move_s=1.0)],
            }
        )
        by_name = {c.name: c for c in changes}
        assert {c.session for c in changes} == {"friday"}
        for name, expected in (("reach", 0.0539), ("range_x", 0.05), ("movement_time_move", 0.176)):
            change = by_name[name]
            assert change.shown, name
            assert change.low <= expected <= change.high, name
            assert change.value == pytest.approx(expected, rel=0.2), name

    @pytest.mark.slow
    def test_where_nothing_changed_hardly_any_change_is_shown(self):
        each = [measured_session(seed=seed) for seed in range(10, 16)]
        changes = [
            c
            for a, b in zip(each[::2], each[1::2], strict=True)
            for c in compare_sessions({"a": [a], "b": [b]})
        ]
        assert len(changes) > 60
        # One in twenty by chance; the measures of an exercise depend on each other.
        assert np.mean([c.shown for c in changes]) < 0.12, [c.name for c in changes if c.shown]


class TestErrorsOfTheTracker:
    @pytest.mark.parametrize(
        ("axis", "unseen", "seen"),
        [
            (5, TURNS, ("max_tilt", *POSITIONS)),  # a can: its rotation about the axis, which itself is seen
            (3, ("max_tilt", "mean_tilt", *TURNS), ("reach",)),  # a lying round stick
        ],
    )
    def test_what_needs_a_rotation_that_nobody_sees_is_not_determined(self, axis, unseen, seen):
        """It stays as it began, and the covariance tells that it is not known."""
        trajectory = session()
        C = trajectory.covariances.copy()
        C[:, axis] = C[:, :, axis] = 0
        C[:, axis, axis] = 3.0**2
        found = motion.analyze(dataclasses.replace(trajectory, covariances=C), up=UP)
        for values in (found.averages, *(r.values for r in found.repetitions)):
            for name in unseen:
                m = values[name]
                assert not m.determined, name
                assert "rotation is not seen" in m.note
                assert 0 <= m.low <= m.value <= m.high, name
        for name in seen:
            assert found.averages[name].determined, name

    def test_errors_that_change_slowly_widen_the_intervals_of_positions(self):
        trajectory = session()
        wider = dataclasses.replace(trajectory, covariances=25 * trajectory.covariances)
        fine, slow = motion.analyze(trajectory), motion.analyze(wider)
        assert max(slow.motion.noise_scales) < 0.3
        assert fine.motion.noise_scales == pytest.approx((1, 1), abs=0.25)
        for name in ("range_x", "reach", "range_z"):
            assert half_width(slow, name) > 1.5 * half_width(fine, name), name
            m = slow.averages[name]
            assert 0 <= m.low <= m.value <= m.high
            assert m.low <= fine.averages[name].value <= m.high, name
        # The noise from frame to frame, and so the floor of a tremor, is what it was.
        assert slow.motion.position_noise_m == pytest.approx(fine.motion.position_noise_m, rel=0.1)

    def test_without_covariances_the_noise_is_found_in_the_trajectory(self):
        trajectory = session()
        found = motion.analyze(dataclasses.replace(trajectory, covariances=None), up=UP)
        known = motion.analyze(trajectory, up=UP)
        assert found.count == (3, 3, 3)
        assert found.motion.position_noise_m == pytest.approx(np.sqrt(3) * SD_M, rel=0.25)
        # In units of 1 mm and 0.01 rad.
        assert found.motion.noise_scales == pytest.approx((SD_M / 1e-3, SD_RAD / 1e-2), rel=0.35)
        for name in POSITIONS:
            assert found.averages[name].determined, name
            assert half_width(found, name) == pytest.approx(half_width(known, name), rel=0.6), name

    def test_a_gap_is_told_and_its_repetition_left_out_of_the_averages(self):
        trajectory = unseen(4.8, 5.4)
        found = motion.analyze(trajectory, up=UP)
        assert found.shares["lost"] == pytest.approx(1 - trajectory.usable.mean())
        cut = [r for r in found.repetitions if r.gap_s]
        assert len(cut) == 1
        assert cut[0].gap_s == pytest.approx(0.6, abs=0.1)
        m = cut[0].values["path_length"]
        assert (np.isnan(m.value), m.determined, m.note) == (True, False, "undefined here")
        others = [r.values["path_length"].value for r in found.repetitions if not r.gap_s]
        assert found.averages["path_length"].value == pytest.approx(np.mean(others), abs=5 * SD_M)

    @pytest.mark.parametrize("lost", [(4.6, 5.2), (4.45, 5.0), (6.2, 6.75), (6.4, 6.9)])
    def test_a_gap_as_the_object_starts_or_arrives_is_no_rest(self, lost):
        """A repetition that began or ended with the gap would be too short, and its measures told as if seen."""
        found = motion.analyze(unseen(*lost), measures=["path_length", "reach"])
        second = found.repetitions[1]
        assert second.gap_s > 0.4
        assert np.isnan(second.values["path_length"].value)

    def test_a_gap_while_the_object_rests_costs_nothing(self):
        found = motion.analyze(unseen(3.6, 4.2), measures=["path_length"])
        assert [r.gap_s for r in found.repetitions] == [0, 0, 0]
