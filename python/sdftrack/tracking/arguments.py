# SPDX-License-Identifier: MIT
"""Validation of a tracker's arguments: each error states the argument, what was expected and what was given."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import numbers
from sdftrack.options import TrackerOptions
from sdftrack.sdf import SDF
from sdftrack.sensor import SensorModel

COLLISIONS = {"contact": "contact", "printed": "printed", None: "none"}  # the core's names


def shape_list(shapes: SDF | Sequence[SDF]) -> list[SDF]:
    """Return one or more shapes as a list."""
    several = isinstance(shapes, (list, tuple))
    many: list[Any] = list(shapes) if isinstance(shapes, (list, tuple)) else [shapes]
    if not many:
        raise ValueError("shapes: expected at least one SDF, got none")
    for k, shape in enumerate(many):
        if not isinstance(shape, SDF):
            name = f"shapes[{k}]" if several else "shapes"
            raise TypeError(
                f"{name}: expected an SDF, got {type(shape).__name__}; make one with SDF.from_mesh"
            )
    return many


def option_set(options: Any) -> TrackerOptions:
    """Return the options, or the defaults if none are given."""
    if options is None:
        return TrackerOptions()
    if not isinstance(options, TrackerOptions):
        raise TypeError(
            f"options: expected TrackerOptions, got {type(options).__name__}; pass single options as keywords, "
            "or a dict through TrackerOptions.from_dict"
        )
    return options


def options_of(options: Any, sensor: SensorModel | None, single: dict[str, Any]) -> TrackerOptions:
    """Combine the options with those of the sensor; single options take precedence over both."""
    known = {} if sensor is None else sensor.options()
    return option_set(options).replace(**{**known, **single})


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


def expect(name: str, value: str, known: tuple[str, ...]) -> None:
    """Check that a value is one of the known ones; the error lists them."""
    if value not in known:
        raise ValueError(f"{name}: expected one of {known} in this version, got {value!r}")


def check_switches(collision: Any, membership: Any, threads: Any) -> None:
    """Check the types; the error names the argument."""
    if collision not in COLLISIONS:
        raise ValueError(f"collision: expected 'contact', 'printed' or None, got {collision!r}")
    if not isinstance(membership, bool):
        raise TypeError(f"membership: expected True or False, got {membership!r}")
    if isinstance(threads, bool) or not isinstance(threads, int) or threads < 0:
        raise ValueError(f"threads: expected 0 (all cores) or a number of threads, got {threads!r}")


def object_number(k: Any, count: int) -> int:
    """Check that `k` is in 0..count - 1."""
    try:
        index = operator.index(k)
    except TypeError:
        raise TypeError(f"k: expected 0..{count - 1}, an object's number, got {k!r}") from None
    if not 0 <= index < count:
        raise ValueError(f"k: expected 0..{count - 1}, got {k}")
    return index


def pose_covariance(given: ArrayLike) -> NDArray[np.float64]:
    """Check that a covariance is (6, 6), symmetric and positive definite; returns float64."""
    covariance = numbers(given, "covariance")
    if covariance.shape != (6, 6) or not np.isfinite(covariance).all():
        raise ValueError(f"covariance: expected (6, 6) finite, got {covariance.shape}")
    if not np.allclose(covariance, covariance.T) or np.linalg.eigvalsh(covariance)[0] <= 0:
        raise ValueError("covariance: expected a symmetric matrix with eigenvalues above 0; give "
                         "unknown directions a large variance")  # fmt: skip
    return covariance
