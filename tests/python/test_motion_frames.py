# SPDX-License-Identifier: MIT
"""Trajectories: what is accepted, their points and frames, and the usual filters."""

import numpy as np
import pytest
from motion_cases import correlated_noise, noisy, reaches
from refusals import assert_refused, refused
from scipy.spatial.transform import Rotation

from sdftrack import geometry, motion
from sdftrack.motion import Trajectory

TIMES = np.arange(150) / 30
TURN = Rotation.from_rotvec(np.column_stack([np.sin(TIMES), 0.3 * TIMES, 0 * TIMES]))
POINT = np.array([0.03, -0.02, 0.1])


def sampled_covariance(T, C, change):
    """Covariance of poses whose errors of covariance C pass through a change of the frames."""
    rng = np.random.default_rng(0)
    moved = []
    exact = change(T)
    for e in rng.multivariate_normal(np.zeros(6), C, 4000):
        noisy_pose = T.copy()
        noisy_pose[:3, 3] += e[:3]
        noisy_pose[:3, :3] = Rotation.from_rotvec(e[3:]).as_matrix() @ T[:3, :3]
        M = change(noisy_pose)
        moved.append([*(M - exact)[:3, 3], *Rotation.from_matrix(M[:3, :3] @ exact[:3, :3].T).as_rotvec()])
    return np.cov(np.array(moved).T)


def test_covariances_of_another_point_are_those_of_sampled_errors():
    _, C = correlated_noise(1, np.random.default_rng(1))
    T = geometry.pose([0.3, -0.8, 0.5], [0.1, 0.2, 0.7])
    moved = motion.at_point(Trajectory([0.0], T[None], C[None]), POINT)
    np.testing.assert_allclose(moved.poses[0], T @ geometry.pose(t_m=POINT))
    expected = sampled_covariance(T, C, lambda M: M @ geometry.pose(t_m=POINT))
    np.testing.assert_allclose(moved.covariances[0], expected, atol=0.06 * np.abs(expected).max())


def test_covariances_in_another_frame_are_those_of_sampled_errors():
    _, C = correlated_noise(1, np.random.default_rng(1))
    T, N = geometry.pose([0.3, -0.8, 0.5], [0.1, 0.2, 0.7]), geometry.pose([1.0, 0.5, -0.7], [0.5, 0, 0.1])
    moved = motion.in_frame(Trajectory([0.0], T[None], C[None]), N, "room")
    assert moved.frame == "room"
    expected = sampled_covariance(T, C, lambda M: N @ M)
    np.testing.assert_allclose(moved.covariances[0], expected, atol=0.06 * np.abs(expected).max())


@pytest.mark.parametrize("normal", [[0, -0.8, -0.6], [0, 0.8, 0.6], [0, 0, -1], [0, -1, 0]])
def test_z_of_the_table_frame_is_the_height_above_it(normal):
    n, d = np.array(normal, float), 0.5
    T = motion.table_frame(n, d)
    np.testing.assert_allclose(T, motion.table_frame(-n, -d))
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)
    points = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(geometry.transform_points(T, points)[:, 2], points @ n + d, atol=1e-12)
    assert T[2, 3] == pytest.approx(d)  # the camera is above the table


class TestResampling:
    def test_values_between_frames_are_those_of_the_motion(self):
        t = np.sort(np.random.default_rng(0).uniform(0, 5, 150))
        x = reaches(t, [1.0])
        R = Rotation.from_rotvec(np.column_stack([0 * t, t, 0 * t]))
        poses = np.tile(np.eye(4), (len(t), 1, 1))
        poses[:, :3, 3], poses[:, :3, :3] = x, R.as_matrix()
        out = motion.resample(Trajectory(t, poses), 100.0)
        assert out.rate_hz == pytest.approx(100)
        np.testing.assert_allclose(out.poses[:, :3, 3], reaches(out.times_s, [1.0]), atol=1e-3)
        turned = Rotation.from_matrix(out.poses[:, :3, :3]).as_rotvec()[:, 1]
        np.testing.assert_allclose(turned, np.arctan2(np.sin(out.times_s), np.cos(out.times_s)), atol=1e-6)

    def test_gaps_remain_gaps(self):
        status = ["lost" if 60 <= i < 90 else "ok" for i in range(150)]
        out = motion.resample(noisy(TIMES, reaches(TIMES, [1.0]), status=status), 60.0)
        inside = (out.times_s > TIMES[59] + 1e-6) & (out.times_s < TIMES[90] - 1e-6)
        assert not out.usable[inside].any()
        assert out.usable[~inside].all()


class TestFilters:
    def test_butterworth_is_that_of_its_definition(self):
        """Forwards and backwards, a sinusoid keeps its phase and loses 1 / (1 + (f / c)^4) of its amplitude."""
        t = np.arange(3000) / 100
        x = np.column_stack([np.sin(2 * np.pi * 4 * t), 0 * t, 0 * t])
        poses = np.tile(np.eye(4), (len(t), 1, 1))
        poses[:, :3, 3] = x
        out = motion.butterworth(Trajectory(t, poses), 6.0)
        inner = slice(500, -500)
        warped = np.tan(np.pi * 4 / 100) / np.tan(np.pi * 6 / 100)  # the bilinear transform's frequencies
        np.testing.assert_allclose(out.poses[inner, 0, 3], x[inner, 0] / (1 + warped**4), atol=1e-3)

    def test_savitzky_golay_keeps_polynomials(self):
        t = np.arange(200) / 100
        poses = np.tile(np.eye(4), (len(t), 1, 1))
        poses[:, 1, 3] = 1 - t + 0.3 * t**4
        out = motion.savitzky_golay(Trajectory(t, poses), 0.2, 4)
        np.testing.assert_allclose(out.poses, poses, atol=1e-9)

    def test_noise_of_rotations_is_reduced(self):
        still = noisy(TIMES, reaches(TIMES, [1.0]), TURN)
        out = motion.butterworth(still, 3.0)
        error = [
            (Rotation.from_matrix(p.poses[:, :3, :3]) * TURN.inv()).magnitude().mean() for p in (still, out)
        ]
        assert error[1] < 0.6 * error[0]

    def test_gaps_are_not_bridged(self):
        status = ["lost" if i == 75 else "ok" for i in range(150)]
        out = motion.savitzky_golay(noisy(TIMES, reaches(TIMES, [1.0]), status=status))
        assert np.flatnonzero(~out.usable).tolist() == [75]

    def test_times_must_be_regular(self):
        t = TIMES.copy()
        t[70:] += 0.5
        with pytest.raises(ValueError, match=r"regular times; use st\.motion\.resample"):
            motion.butterworth(noisy(t, reaches(t, [1.0])))


class TestBestKnownPoint:
    def test_it_is_the_centre_of_a_ball(self):
        """Its rotation is unknown, so the position of any other point is, too."""
        C = np.diag([1e-8] * 3 + [1.0] * 3)
        J = np.eye(6)
        J[:3, 3:] = np.array([[0, -0.03, 0], [0.03, 0, 0], [0, 0, 0]])  # the origin is 30 mm below the centre
        at_origin = Trajectory([0.0], np.eye(4)[None], (J @ C @ J.T)[None])
        assert np.sqrt(at_origin.covariances[0, 0, 0]) > 0.02
        np.testing.assert_allclose(motion.best_known_point(at_origin), [0, 0, 0.03], atol=1e-4)
        np.testing.assert_allclose(motion.at_point(at_origin, [0, 0, 0.03]).covariances[0], C, atol=1e-12)

    def test_without_covariances_it_is_the_wanted_one(self):
        plain = Trajectory([0.0], np.eye(4)[None])
        np.testing.assert_array_equal(motion.best_known_point(plain, POINT), POINT)


FOUR, POSES = np.arange(4) / 30, np.tile(np.eye(4), (4, 1, 1))


def changed(**pose):
    T = POSES.copy()
    for name, value in pose.items():
        if name == "t":
            T[2, :3, 3] = value
        else:
            T[2, :3, :3] = value
    return T


@refused(
    (lambda: Trajectory([0, 0.1, 0.1, 0.2], POSES), ValueError, r"repeated at frames 1 and 2 \(0.1"),
    (lambda: Trajectory([0, np.nan, 0.1, 0.3], POSES), ValueError, r"needs fps \(--fps\)"),
    (lambda: Trajectory([], np.zeros((0, 4, 4))), ValueError, "at least one"),
    (lambda: Trajectory(FOUR[:3], POSES), ValueError, r"poses: expected shape \(3, 4, 4\)"),
    (lambda: Trajectory(FOUR, changed(t=[0, 0, 3000.0])), ValueError, r"3000 m from the origin; in mm\?"),
    (lambda: Trajectory(FOUR, changed(R=np.diag([1, 1, -1]))), ValueError, "expected rigid poses"),
    (lambda: Trajectory(FOUR, POSES, status=["lost"] * 4, name="cup"), ValueError, "lost in all 4 frames"),
    (lambda: Trajectory(FOUR, POSES, np.zeros((3, 6, 6))), ValueError, r"covariances: .* \(4, 6, 6\)"),
    (lambda: Trajectory(FOUR, POSES, status=["ok"]), ValueError, "status: expected 4 of them"),
)
def test_what_is_no_trajectory_is_refused(call, error, words):
    assert_refused(call, error, words)


def test_lost_poses_may_be_anything():
    trajectory = Trajectory(FOUR, changed(t=[np.nan] * 3), status=["ok", "weak", "lost", "bad_frame"])
    assert trajectory.usable.tolist() == [True, True, False, False]


def test_part_rate_and_duration():
    trajectory = Trajectory(FOUR, POSES, np.tile(np.eye(6), (4, 1, 1)), name="cup")
    part = trajectory.part(slice(1, None, 2))
    assert part.times_s.tolist() == [1 / 30, 3 / 30]
    assert (part.name, len(part), len(part.covariances)) == ("cup", 2, 2)
    assert trajectory.rate_hz == pytest.approx(30)
    assert trajectory.duration_s == pytest.approx(0.1)
