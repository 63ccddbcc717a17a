# SPDX-License-Identifier: MIT
"""Pytest fixtures for external test suites: a small, deterministic camera, shape and sequence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    import sdftrack


@pytest.fixture(scope="session")
def sdftrack_camera() -> sdftrack.Camera:
    """An ideal camera of 160 x 120 pixels."""
    import sdftrack

    return sdftrack.Camera(131.25, 131.25, 79.5, 59.5, 160, 120)


@pytest.fixture(scope="session")
def sdftrack_shape() -> sdftrack.SDF:
    """A box of 10 x 14 x 18 cm with three different sides, so that its pose is observable."""
    import sdftrack

    return sdftrack.SDF.box((0.10, 0.14, 0.18))


@pytest.fixture(scope="session")
def sdftrack_sequence(sdftrack_shape: sdftrack.SDF, sdftrack_camera: sdftrack.Camera) -> sdftrack.Sequence:
    """Six frames of that shape at 0.6 m, 1 mm of noise, with `ground_truth`."""
    import sdftrack

    return sdftrack.synth.sequence(
        sdftrack_shape,
        6,
        camera=sdftrack_camera,
        trajectory=sdftrack.synth.random_walk(step_m=0.003, step_rad=0.015, distance_m=0.6),
        noise=0.001,
        seed=1,
    )
