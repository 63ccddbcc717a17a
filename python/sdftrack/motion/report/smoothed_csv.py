# SPDX-License-Identifier: MIT
"""``trajectory_smoothed.csv``: the smoothed movement with its derivatives, for spreadsheets and scripts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from sdftrack._internal.csv_cells import text_cell
from sdftrack.motion.analysis import Analysis

__all__ = ["smoothed_csv"]

NUMBERS = (
    "time_s", "x_m", "y_m", "z_m", "vx_m_per_s", "vy_m_per_s", "vz_m_per_s", "qx", "qy", "qz", "qw",
    "wx_rad_per_s", "wy_rad_per_s", "wz_rad_per_s",
)  # fmt: skip
FORMAT = ",".join(["%.4f", *["%.7g"] * (len(NUMBERS) - 1)])


def smoothed_csv(sessions: Mapping[str, Sequence[Analysis]]) -> str:
    """A row per object and frame, at regular times of the frame rate; in gaps only the time.

    Position and velocity are those of the measured point, the rotation is a quaternion of the object in the reference
    frame, the angular velocity has the axes of that frame.
    """
    lines = [",".join(["session", "object", *NUMBERS])]
    for session, each in sessions.items():
        for a in each:
            head = f"{text_cell(session)},{text_cell(a.trajectory.name)}"
            lines += [f"{head},{row}" for row in _rows(a)]
    return "\n".join(lines) + "\n"


def _rows(a: Analysis) -> list[str]:
    mean = a.motion.mean(a.motion.times_s(a.trajectory.rate_hz))
    seen = mean.observed
    q = np.full((len(seen), 4), np.nan)
    if seen.any():
        q[seen] = Rotation.from_matrix(mean.rotations[0, seen]).as_quat()
        flips = np.sign(np.einsum("ni,ni->n", q[1:], q[:-1]))  # no jumps of sign between rows
        q[1:] *= np.cumprod(np.where(flips < 0, -1.0, 1.0))[:, None]
    turning = mean.angular_velocities_radps[0]
    table = np.column_stack([mean.times_s, mean.positions_m[0], mean.velocities_mps[0], q, turning])
    empty = "," * (len(NUMBERS) - 1)
    return [
        FORMAT % tuple(row) if known else f"{row[0]:.4f}{empty}"
        for row, known in zip(table.tolist(), seen.tolist(), strict=True)
    ]
