# SPDX-License-Identifier: MIT
"""Which frames are kept when there are more than may be kept."""

from collections.abc import Iterable

import numpy as np
import pytest
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack.reconstruction.refining import Keyframe, Keyframes

FAR_M = 0.6


def keyframe(index: int, degrees: float, far_m: float = FAR_M, roll: float = 0.0) -> Keyframe:
    """A frame that shows a turntable's object, turned by so much, to a camera turned about its axis by `roll`."""
    turn = geometry.pose((0, np.radians(degrees), 0), (0, 0, far_m))
    T = geometry.pose((0, 0, np.radians(roll)), (0, 0, 0)) @ turn
    nothing = np.empty((0, 0), np.float32)
    return Keyframe(index, (0, 0, 0, 0), nothing, None, nothing, T)


def kept(most: int, angles: Iterable[float]) -> list[int]:
    kept = Keyframes(most)
    for i, degrees in enumerate(angles):
        kept.add(keyframe(i, degrees))
        assert len(kept.frames) <= most
    return [s.index for s in kept.frames]


def gaps(degrees: NDArray[np.float64]) -> NDArray[np.float64]:
    """Between neighbours all round a circle."""
    around = np.sort(degrees % 360)
    return np.diff(np.append(around, around[0] + 360))


def test_all_are_kept_while_there_is_room() -> None:
    assert kept(20, range(20)) == list(range(20))


@pytest.mark.parametrize("turns", [1, 2])
def test_views_from_all_round_are_kept_though_there_is_room_for_half_a_turn(turns: int) -> None:
    angles = np.arange(120 * turns) * 3.0
    left = kept(60, angles)
    assert len(left) == 60
    assert left[0] == 0
    assert left == sorted(left)
    assert gaps(angles[left]).max() <= 12  # 6 if they could be chosen afterwards


def test_a_store_that_is_much_too_small_still_sees_all_sides() -> None:
    angles = np.arange(1500) * 0.5  # twice round
    assert gaps(angles[kept(12, angles)]).max() <= 60


def test_a_camera_that_stood_still_first_keeps_what_came_after() -> None:
    left = kept(30, [0.0] * 100 + [4.0 * k for k in range(1, 26)] + [100.0] * 100)
    assert set(range(101, 125)) <= set(left)


def test_a_camera_that_stands_still_is_kept_at_all_times() -> None:
    left = np.array(kept(10, [0.0] * 200))
    assert np.diff(np.append(left, 200)).max() <= 50


def test_a_nearer_view_is_another_one_a_rolled_one_is_not() -> None:
    kept = Keyframes(4)
    for i, near in enumerate((1.0, 1.0, 1.0, 0.5, 0.7)):
        kept.add(keyframe(i, 0.0, near * FAR_M))
    assert {3, 4} <= {s.index for s in kept.frames}
    kept = Keyframes(3)
    for i, (degrees, roll) in enumerate(((0, 0), (0, 90), (20, 0), (40, 0))):
        kept.add(keyframe(i, degrees, roll=roll))
    assert [s.index for s in kept.frames] == [0, 2, 3]


def test_the_first_frame_of_each_recording_is_kept() -> None:
    frames = Keyframes(6)
    nothing = np.empty(0, np.float32)
    for i in range(40):
        T = geometry.pose([0, 0.05 * (i % 20), 0], [0, 0, 0.5])
        frames.add(Keyframe(i, (0, 0, 0, 0), nothing, None, nothing, T, None, i // 20))
    assert len(frames.frames) == 6
    assert {0, 20} <= {k.index for k in frames.frames}
