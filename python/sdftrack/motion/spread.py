# SPDX-License-Identifier: MIT
"""How far the posterior's spread of a measure and its bias from noise are off, measured on synthetic exercises.

The samples of a prior with white jerk are rougher than people's movements, which shows in measures of extremes and of
jerk more than in others. Factors were chosen on exercises of seeds 0 to 17 with simulated noise (those of times and of
the jerk on tracked ones of seeds 500 to 509) and are reported on others (docs/results/motion.md).
"""

from __future__ import annotations

__all__ = ["CALIBRATION"]

# Measure: (part of the samples' shift that the mean movement has, too; factor of the spread).
CALIBRATION: dict[str, tuple[float, float]] = {
    "path_length": (0.7, 1.3),
    "sparc": (0.0, 1.15),
    "log_dimensionless_jerk": (0.2, 1.4),
    "peak_acceleration": (0.2, 0.9),
    "peak_angular_speed": (0.7, 1.05),
    "range_height": (1.4, 1.5),
    "range_horizontal": (1.4, 1.4),
    "range_turn": (1.4, 1.3),
    "range_angle": (1.4, 1.25),
    "movement_time": (0.0, 1.25),
    "reaction_time": (0.0, 1.4),
    "repetition_time": (0.0, 1.25),
    "reach": (1.0, 1.25),
    "max_tilt": (1.4, 1.4),
    "mean_tilt": (1.4, 1.25),
    "dwell_time": (0.2, 1.05),
    "range_x": (1.4, 1.2),
    "range_y": (1.4, 1.2),
    "range_z": (1.4, 1.25),
}
