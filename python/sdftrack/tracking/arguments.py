# SPDX-License-Identifier: MIT
"""Validation of a tracker's arguments: each error states the argument, what was expected and what was given."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import THREADS, numbers, whole
from sdftrack.options import TrackerOptions
from sdftrack.sensor import SensorModel

COLLISIONS = {"contact": "contact", "printed": "printed", None: "none"}  # the core's names


def options_of(options: Any, sensor: SensorModel | None, single: dict[str, Any]) -> TrackerOptions:
    """Combine the options, if any, with those of the sensor; single options take precedence over both."""
    options = TrackerOptions() if options is None else options
    if not isinstance(options, TrackerOptions):
        raise TypeError(
            f"options: expected TrackerOptions, got {type(options).__name__}; pass single options as keywords, "
            "or a dict through TrackerOptions.from_dict"
        )
    known = {} if sensor is None else sensor.options()
    return options.replace(**{**known, **single})


def name_list(names: Any, count: int) -> list[str]:
    """One name per shape; numbers if none are given."""
    if names is None:
        return [f"object {k}" for k in range(count)]
    if isinstance(names, (str, bytes)) or not hasattr(names, "__iter__"):
        raise TypeError(f"names: expected a list with one name per shape ({count}), got {names!r}")
    many = [str(name) for name in names]
    if len(many) != count:
        raise ValueError(f"names: expected one per shape ({count}), got {len(many)}")
    return many


def one_hint(several: dict[str, Any], single: dict[str, Any], count: int) -> tuple[str, Any] | None:
    """The one of `several` ("masks", ...) or `single` ("mask", ...) that is given, as one of `several`; None: none.

    Both are in the same order. ValueError for more than one, and for a single one of several shapes.
    """
    given = {name: value for name, value in (several | single).items() if value is not None}
    if len(given) > 1:
        raise ValueError(f"expected one of {', '.join(several)}, got {' and '.join(given)}")
    for name, value in given.items():
        if name in several:
            return name, value
        many = list(several)[list(single).index(name)]
        if count > 1:
            raise ValueError(f"{name}: expected {many} with one per shape ({count}), got a single one")
        return many, [value]
    return None


def check_switches(collision: Any, membership: Any, threads: Any) -> None:
    """Check the types; the error names the argument."""
    if collision not in COLLISIONS:
        raise ValueError(f"collision: expected 'contact', 'printed' or None, got {collision!r}")
    if not isinstance(membership, bool):
        raise TypeError(f"membership: expected True or False, got {membership!r}")
    whole(threads, "threads", 0, what=THREADS)


def object_number(k: Any, count: int) -> int:
    """Check that `k` is in 0..count - 1."""
    return whole(k, "k", 0, count - 1, f"0..{count - 1}, an object's number")


def pose_covariance(given: ArrayLike) -> NDArray[np.float64]:
    """Check that a covariance is (6, 6), symmetric and positive definite; returns float64."""
    covariance = numbers(given, "covariance")
    if covariance.shape != (6, 6) or not np.isfinite(covariance).all():
        raise ValueError(f"covariance: expected (6, 6) finite, got {covariance.shape}")
    if not np.allclose(covariance, covariance.T) or np.linalg.eigvalsh(covariance)[0] <= 0:
        raise ValueError("covariance: expected a symmetric matrix with eigenvalues above 0; give "
                         "unknown directions a large variance")  # fmt: skip
    return covariance
