# SPDX-License-Identifier: MIT
"""What a tracker says about one frame."""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

__all__ = ["ColorDelay", "Status", "Step", "TrackResult"]


class Status(str, enum.Enum):
    """How far a pose may be trusted; compares equal to its text."""

    OK = "ok"
    WEAK = "weak"
    LOST = "lost"
    BAD_FRAME = "bad_frame"

    def __str__(self) -> str:
        return self.value


class Step(NamedTuple):
    """One trial of the optimiser.

    Attributes
    ----------
    cost : float
        Cost at the pose that was kept (a sum over ``pixels`` pixels, without unit).
    damping : float
        Levenberg-Marquardt damping of the trial.
    accepted : bool
        Whether the trial lowered the cost and was kept.
    scale_m : float
        Scale ``s`` of the depth density in this stage, metres at the reference depth.
    pixels : int
        Pixels that the cost sums over.
    """

    cost: float
    damping: float
    accepted: bool
    scale_m: float = float("nan")
    pixels: int = 0


class Steps(Sequence[Step]):
    """The trials of one object as a read-only list of :class:`Step`, made when they are asked for."""

    __slots__ = ("_rows",)

    def __init__(self, rows: NDArray[np.float64]) -> None:
        self._rows = rows  # (N, 5), the fields of Step

    def __len__(self) -> int:
        return len(self._rows)

    @overload
    def __getitem__(self, i: int) -> Step: ...
    @overload
    def __getitem__(self, i: slice) -> list[Step]: ...
    def __getitem__(self, i: int | slice) -> Step | list[Step]:
        if isinstance(i, slice):
            return [_step(row) for row in self._rows[i].tolist()]
        return _step(self._rows[i].tolist())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return Steps, (self._rows,)

    def __repr__(self) -> str:
        return repr(list(self))


def _step(row: list[float]) -> Step:
    cost, damping, accepted, scale_m, pixels = row
    return Step(cost, damping, bool(accepted), scale_m, int(pixels))


@dataclass(frozen=True)
class ColorDelay:
    """By how much colour images are of a later moment than the depth images that came with them.

    Attributes
    ----------
    delay_s, sd_s : float
        Seconds, and its standard deviation. Negative: colour is earlier.
    frames : int
        In which it was looked at.
    """

    delay_s: float
    sd_s: float
    frames: int

    @property
    def significant(self) -> bool:
        """More than three standard deviations and 3 ms from none."""
        return abs(self.delay_s) > max(3 * self.sd_s, 0.003)

    def __str__(self) -> str:
        when = "later" if self.delay_s > 0 else "earlier"
        return f"colour {1e3 * abs(self.delay_s):.0f} +- {1e3 * self.sd_s:.0f} ms {when} than depth"


@dataclass(frozen=True, eq=False)
class TrackResult:
    """Poses of the M tracked objects in one frame, each with a measure of trust.

    Attributes
    ----------
    poses : (M, 4, 4) float64
        ``T_cam_obj``: object points (m) to the depth camera's frame. The last good pose when lost.
    status : list of Status
        ``"ok"``, ``"weak"``, ``"lost"`` or ``"bad_frame"``, per object.
    reason : list of str
        Empty, or one sentence that explains the status.
    confidence : (M,) float64
        0..1, comparable between frames and objects; 0 when lost.
    covariances : (M, 6, 6) float64
        Of (x, y, z, rx, ry, rz), m and rad, camera axes, about the object's origin: ``t = t^ + d``,
        ``R = Exp(r) R^``. Directions without data have the variance of the object's diameter and of pi. NaN when lost.
    twists : (M, 6) float64
        (v, w), same origin and axes, m/s and rad/s; NaN until two frames have timestamps.
    inliers : (M,) float64
        Share of the pixels expected on the object that lie on its surface.
    runner_up : (M,) float64
        After a search: score of the best other pose over this one's, near 1 where the view does not decide between
        them (a symmetric body, a flat side). NaN where nothing was searched.
    energy : float
        Mean cost per pixel at the final poses.
    iterations : int
        Trials of the optimiser, all stages.
    steps : list of sequences of Step
        Every trial, per object.
    seconds : float
        Time of ``track`` alone.
    timestamp : float or None
        Of the frame, s.
    index : int
        Number of the frame since ``start`` (0).
    shape_change : float
        Of a :class:`Reconstructor`: how far the surface moved with this frame, m, on the mean where it was seen; NaN
        where nothing was fused.
    sensor : str
        Name of the sensor model that the covariances rest on; "" where none was named: then the noise is measured from
        frame to frame, and the systematic error learnt where a pose was given.
    systematic : (M,) float64 or None
        Sd (m) of the depth error that an object's readings are taken to share; 0 where none is known, and the
        covariance is that of the noise alone (docs/sensors.md).
    """

    poses: NDArray[np.float64]
    status: list[Status]
    reason: list[str]
    confidence: NDArray[np.float64]
    covariances: NDArray[np.float64]
    twists: NDArray[np.float64]
    inliers: NDArray[np.float64]
    runner_up: NDArray[np.float64]
    energy: float
    iterations: int = 0
    steps: Sequence[Sequence[Step]] = field(default_factory=list, repr=False)
    seconds: float = 0.0
    timestamp: float | None = None
    index: int = 0
    shape_change: float = float("nan")
    membership: NDArray[np.float32] | None = None
    foreground: NDArray[np.float32] | None = None
    sensor: str = ""
    systematic: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        for name in ("poses", "confidence", "covariances", "twists", "inliers", "runner_up"):
            getattr(self, name).setflags(write=False)

    @property
    def ok(self) -> bool:
        """Whether every object's status is ``"ok"``."""
        return all(s is Status.OK for s in self.status)

    @property
    def pose(self) -> NDArray[np.float64]:
        """The only object's ``T_cam_obj``, (4, 4); ValueError when there are several."""
        return self._only(self.poses, "pose", "poses")

    @property
    def covariance(self) -> NDArray[np.float64]:
        """The only object's covariance, (6, 6); ValueError when there are several."""
        return self._only(self.covariances, "covariance", "covariances")

    def _only(self, values: NDArray[np.float64], name: str, plural: str) -> NDArray[np.float64]:
        if len(values) != 1:
            raise ValueError(f"{name}: expected 1 tracked object, got {len(values)}; use .{plural}[k]")
        only: NDArray[np.float64] = values[0]
        return only

    def to_dict(self) -> dict[str, Any]:
        """Return plain Python values (lists, floats, None in place of NaN), ready for JSON."""
        out: dict[str, Any] = {}
        for f in dataclasses.fields(self):
            value = getattr(self, f.name)
            if f.name == "steps":
                value = [[s._asdict() for s in steps] for steps in value]
            elif f.name == "status":
                value = [s.value for s in value]
            out[f.name] = _plain(value)
        return out

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TrackResult) and self.to_dict() == other.to_dict()

    def __repr__(self) -> str:
        who = ", ".join(f"{s.value} {c:.2f}" for s, c in zip(self.status, self.confidence, strict=True))
        return f"TrackResult(frame {self.index}: {who}; {1e3 * self.seconds:.2f} ms)"


def _plain(value: Any) -> Any:
    """Numpy to Python, NaN to None, recursively."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def doubted(result: TrackResult, reason: str) -> TrackResult:
    """The result of one object, as weak for a reason that its tracker cannot know."""
    confidence = np.minimum(result.confidence, 0.5)
    confidence.flags.writeable = False
    return dataclasses.replace(result, status=[Status.WEAK], reason=[reason], confidence=confidence)
