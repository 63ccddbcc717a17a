# SPDX-License-Identifier: MIT
"""How far the posterior's spread of a measure and its bias from noise are off, measured on synthetic exercises.

The samples of a prior with white jerk are rougher than people's movements, which shows in measures of extremes and of
jerk more than in others; errors of the tracker that change slowly cancel in ranges. Factors were chosen on rendered
and tracked exercises of seeds 500 to 599, and on simulated noise of seeds 30 to 35 that has no slow part; they are
reported on others (docs/results/motion.md).
"""

from __future__ import annotations

__all__ = ["CALIBRATION"]

# Measure: (part of the samples' shift that the mean movement has, too; factor of the spread).
CALIBRATION: dict[str, tuple[float, float]] = {
    "path_length": (0.9, 2.1),
    "index_of_curvature": (0.0, 0.9),
    "sparc": (0.0, 1.05),
    "log_dimensionless_jerk": (0.2, 1.1),
    "peak_speed": (0.2, 1.0),
    "peak_acceleration": (0.2, 1.0),
    "peak_angular_speed": (0.5, 1.05),
    "range_height": (1.0, 1.15),
    "range_horizontal": (1.1, 1.25),
    "range_turn": (1.5, 1.35),
    "range_angle": (0.6, 0.85),
    "range_x": (0.5, 1.2),
    "range_y": (0.7, 1.0),
    "range_z": (0.6, 0.9),
    "reach": (0.2, 1.05),
    "movement_time": (0.0, 0.8),
    "reaction_time": (0.0, 0.9),
    "repetition_time": (0.0, 0.8),
    "time_to_peak_speed_part": (0.0, 1.1),
    "max_tilt": (1.4, 0.95),
    "mean_tilt": (0.2, 1.1),
    "dwell_time": (0.1, 1.6),
}
