# SPDX-License-Identifier: MIT
"""What is no pose, no point or no field of view is refused in a line that names the argument."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack import geometry

BAD = [None, "a", [1, 2], [1, 2, 3, 4], [np.nan] * 3, [np.inf] * 3, [1e200] * 3, [[1], [2, 3]], {}, object]
CALLS = {
    "w_rad": geometry.pose,
    "t_m": lambda v: geometry.pose(t_m=v),
    "twist": geometry.exp,
    "T": geometry.inverse,
    "T of log": geometry.log,
    "T of points": lambda v: geometry.transform_points(v, [[0.0, 0, 0]]),
    "eye": lambda v: geometry.look_at(v, [0, 0, 0]),
    "target": lambda v: geometry.look_at([0, 0, 1], v),
    "up": lambda v: geometry.look_at([0, 0, 1], [1, 0, 0], v),
}


@pytest.mark.filterwarnings("error")  # numpy's, of an overflow
@pytest.mark.parametrize("bad", BAD, ids=repr)
@pytest.mark.parametrize("name", CALLS)
def test_each_argument_is_named(name, bad):
    if name == "t_m" and isinstance(bad, list) and bad == [1e200] * 3:
        assert np.isfinite(geometry.pose(t_m=bad)).all()
        return
    with pytest.raises((TypeError, ValueError), match=rf"\b{name.split()[0]}\b.*: expected "):
        CALLS[name](bad)


@pytest.mark.parametrize("bad", [None, "a", [1, 2], 3.0, {}, [[1], [2, 3]]], ids=repr)
def test_points_have_three_coordinates(bad):
    with pytest.raises((TypeError, ValueError), match=r"^points: expected "):
        geometry.transform_points(np.eye(4), bad)


def test_a_twist_without_end_is_refused():
    for part in (0, 3):
        twist = np.zeros(6)
        twist[part] = 1e300
        with pytest.raises(ValueError, match="expected"):
            geometry.exp(twist)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (("a", 640, 480), "fov_x_rad"),
        (([1, 2], 640, 480), "fov_x_rad"),
        ((np.nan, 640, 480), "fov_x_rad"),
        ((4.0, 640, 480), "fov_x_rad"),
        ((1.0, "b", 480), "width"),
        ((1.0, 10**30, 480), "width"),
        ((1.0, np.nan, 480), "width"),
        ((1.0, 640, None), "height"),
        ((1.0, 640, 480.5), "height"),
    ],
)
def test_a_field_of_view_and_a_size_are_numbers(arguments, name):
    with pytest.raises((TypeError, ValueError), match=f"^{name}: expected "):
        st.Camera.from_fov(*arguments)
