# SPDX-License-Identifier: MIT
"""Movements as functions of time, on a regular grid: what measures are computed from."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Kept = TypeVar("Kept")


@dataclass(frozen=True, eq=False)
class MotionSamples:
    """S possible movements of one object over the same n times: one true movement, or samples of a posterior.

    Attributes
    ----------
    times_s : (n,) float64
        Regular.
    positions_m, velocities_mps, accelerations_mps2, jerks_mps3 : (S, n, 3) float64
        Of one point of the object, in the reference frame.
    rotations : (S, n, 3, 3) float64
        R_ref_obj.
    angular_velocities_radps : (S, n, 3) float64
        In the axes of the reference frame.
    observed : (n,) bool
        False in gaps: no pose was measured for longer than the smoother bridges.
    """

    times_s: Array
    positions_m: Array
    velocities_mps: Array
    accelerations_mps2: Array
    jerks_mps3: Array
    rotations: Array
    angular_velocities_radps: Array
    observed: NDArray[np.bool_]
    # What several measures ask for.
    _kept: dict[Any, Any] = field(default_factory=dict, repr=False, init=False)

    @property
    def rate_hz(self) -> float:
        """Samples per second."""
        return 1.0 / float(self.times_s[1] - self.times_s[0]) if len(self.times_s) > 1 else float("nan")

    @property
    def speeds_mps(self) -> Array:
        """(S, n) norms of the velocities."""
        return self.kept(
            "speeds", lambda: np.sqrt(np.einsum("snd,snd->sn", self.velocities_mps, self.velocities_mps))
        )

    def kept(self, key: Any, compute: Callable[[], Kept]) -> Kept:
        """The result of `compute`, which is called once for each `key`."""
        if key not in self._kept:
            self._kept[key] = compute()
        return cast(Kept, self._kept[key])

    def between(self, start_s: float, end_s: float) -> MotionSamples:
        """The part from `start_s` to `end_s`, both included."""
        return self.kept(("between", start_s, end_s), lambda: self._between(start_s, end_s))

    def _between(self, start_s: float, end_s: float) -> MotionSamples:
        a, b = np.searchsorted(self.times_s, [start_s - 1e-9, end_s + 1e-9])
        return self.part(slice(None), slice(a, b))

    def part(self, samples: slice, times: slice) -> MotionSamples:
        """Some of the samples and of the times."""
        values = {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.init}
        of_times = ("times_s", "observed")
        return MotionSamples(
            **{k: v[times] if k in of_times else v[samples, times] for k, v in values.items()}
        )


MARGIN_S = 0.25


def with_rests(movements: Sequence[tuple[float, float]], k: int) -> tuple[float, float]:
    """(start, end) of movement `k` and up to 0.25 s of the rests beside it, at most half of a hold."""
    start, end = movements[k]
    before = 0.5 * (start - movements[k - 1][1]) if k > 0 else MARGIN_S
    after = 0.5 * (movements[k + 1][0] - end) if k + 1 < len(movements) else MARGIN_S
    return start - min(before, MARGIN_S), end + min(after, MARGIN_S)
