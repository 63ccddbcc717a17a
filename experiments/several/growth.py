# SPDX-License-Identifier: MIT
"""Time of a frame against the number of objects."""

from __future__ import annotations

from collections.abc import Sequence as Seq
from typing import Any

import numpy as np

from experiments.several.identity import run_way
from experiments.several.judged import measure, total
from experiments.synth import several as scenes
from experiments.synth.contact import Solid

COUNTS = (1, 2, 3, 5, 10, 20, 50, 100)


def growth(counts: Seq[int], ms: Seq[float]) -> dict[str, float]:
    """Straight line (fixed ms, ms per object, rms residual) and, from 2 objects on, the exponent of ms ~ M^e."""
    m, t = np.array(counts, float), np.array(ms, float)
    out = {
        "fixed_ms": float("nan"),
        "ms_per_object": float("nan"),
        "residual_ms": float("nan"),
        "exponent": float("nan"),
    }
    if len(m) > 1:
        slope, fixed = np.polyfit(m, t, 1)
        rms = float(np.sqrt(np.mean((t - fixed - slope * m) ** 2)))
        out |= {"fixed_ms": float(fixed), "ms_per_object": float(slope), "residual_ms": rms}
    some = m >= 2
    if some.sum() > 1:
        out["exponent"] = float(np.polyfit(np.log(m[some]), np.log(t[some]), 1)[0])
    return out


def time_row(
    mesh: Any, solid: Solid, count: int, way: str, mode: str, frames: int, options: Any, **more: Any
) -> Any:
    """A row of the time table: median ms of a frame, pixels on the objects, and how it went."""
    scene = scenes.row(mesh, solid, count, frames, **more)
    row = total([measure(scene, run_way(scene, way, mode, options))])
    return {**row, "objects": count, "pixels": int((scene.labels(0) >= 0).sum())}


def fit_text(fit: dict[str, float]) -> str:
    """The fit of `growth` in a line."""
    return (
        f"{fit['fixed_ms']:.2f} ms + {fit['ms_per_object']:.3f} ms per object (residual {fit['residual_ms']:.2f} ms); "
        f"exponent from 2 on: {fit['exponent']:.2f}"
    )
