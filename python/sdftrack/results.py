# SPDX-License-Identifier: MIT
"""Results of a tracker for one frame."""

from __future__ import annotations

import dataclasses
import enum
import html
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import NDArray


class Status(str, enum.Enum):
    """Reliability of a pose; compares equal to its string value."""

    OK = "ok"
    WEAK = "weak"
    LOST = "lost"
    BAD_FRAME = "bad_frame"

    def __str__(self) -> str:
        return self.value


class Step(NamedTuple):
    """One trial step of the optimiser.

    Attributes
    ----------
    cost : float
        Cost at the retained pose (a dimensionless sum over ``pixels`` pixels).
    damping : float
        Levenberg-Marquardt damping of the trial step.
    accepted : bool
        Whether the trial step lowered the cost and was accepted.
    scale_m : float
        Scale ``s`` of the depth density in this stage, metres at the reference depth.
    pixels : int
        Number of pixels in the cost.
    """

    cost: float
    damping: float
    accepted: bool
    scale_m: float = float("nan")
    pixels: int = 0


class Steps(Sequence[Step]):
    """The trial steps of one object as a read-only list of :class:`Step`, created on access."""

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
    """Delay of the colour images relative to the depth images of the same frames.

    Attributes
    ----------
    delay_s, sd_s : float
        Delay in seconds, and its standard deviation. Negative: colour is earlier.
    frames : int
        Number of frames used for the estimate.
    """

    delay_s: float
    sd_s: float
    frames: int

    @property
    def significant(self) -> bool:
        """Whether the delay exceeds three standard deviations and 3 ms."""
        return abs(self.delay_s) > max(3 * self.sd_s, 0.003)

    def __str__(self) -> str:
        when = "later" if self.delay_s > 0 else "earlier"
        return f"colour {1e3 * abs(self.delay_s):.0f} +- {1e3 * self.sd_s:.0f} ms {when} than depth"


@dataclass(frozen=True)
class ScaleEstimate:
    """Scale of an object over its mesh, and its standard deviation.

    The deviation contains what the sensor may be off by in distance, which one camera cannot tell from the scale. It is
    infinite while nothing is known.
    """

    scale: float
    sd: float

    @property
    def interval95(self) -> tuple[float, float]:
        """The 95 % interval of the scale."""
        relative = 1.96 * self.sd / self.scale
        high = math.inf if relative > 100 else self.scale * math.exp(relative)
        return self.scale * math.exp(-relative), high

    def __str__(self) -> str:
        low, high = self.interval95
        if math.isinf(high):
            return "scale not known"
        return f"scale {self.scale:.4f} ({low:.4f} to {high:.4f})"


@dataclass(frozen=True, eq=False)
class TrackResult:
    """Poses of the M tracked objects in one frame, each with measures of its reliability.

    Attributes
    ----------
    poses : (M, 4, 4) float64
        ``T_cam_obj``: maps object points (m) to the depth camera's frame. The last good pose if lost.
    status : list of Status
        ``"ok"``, ``"weak"``, ``"lost"`` or ``"bad_frame"``, per object.
    reason : list of str
        Empty, or one sentence that explains the status.
    confidence : (M,) float64
        0..1, comparable between frames and objects; 0 if lost.
    covariances : (M, 6, 6) float64
        Of (x, y, z, rx, ry, rz), m and rad, camera axes, about the object's origin: ``t = t^ + d``,
        ``R = Exp(r) R^``. Unconstrained directions have the variance of the object's diameter squared and of pi
        squared. NaN if lost.
    twists : (M, 6) float64
        (v, w), same origin and axes, m/s and rad/s; NaN until two frames have timestamps.
    inliers : (M,) float64
        Fraction of the pixels expected on the object that lie on its surface.
    runner_up : (M,) float64
        After a search: ratio of the score of the best alternative pose to that of this one; near 1 if the view is
        ambiguous (a symmetric body, a flat side). NaN without a search.
    energy : float
        Mean cost per pixel at the final poses.
    iterations : int
        Number of trial steps of the optimiser in all stages.
    steps : list of sequences of Step
        Every trial step, per object.
    seconds : float
        Duration of ``track`` alone.
    timestamp : float or None
        Timestamp of the frame, s.
    index : int
        Number of the frame since ``start`` (0).
    shape_change : float
        For a :class:`Reconstructor`: change of the surface in this frame, m, averaged over the observed surface; NaN if
        the frame was not fused.
    sensor : str
        Name of the sensor model used for the covariances. "" if none was given: the noise is then estimated in every
        frame, and the systematic error in frames with a given pose.
    systematic : (M,) float64 or None
        Sd (m) assumed for the depth error shared by all measurements of an object (docs/sensors.md); of a sensor of
        which nothing is stated that of a stereo camera; 0: the covariance accounts for noise alone.
    unstated : (M, 6, 6) float64 or None
        The part of `covariances` by what a sensor of which nothing is stated may err by: a nearly constant error of the
        distance that bends over the object, and half a frame's motion. The analysis of movements leaves it out.
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
    unstated: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        for name in ("poses", "confidence", "covariances", "twists", "inliers", "runner_up"):
            getattr(self, name).setflags(write=False)

    @property
    def ok(self) -> bool:
        """Whether every object's status is ``"ok"``."""
        return all(s is Status.OK for s in self.status)

    @property
    def pose(self) -> NDArray[np.float64]:
        """``T_cam_obj`` (4, 4) of the only object; ValueError if there are several."""
        return self._only(self.poses, "pose", "poses")

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance (6, 6) of the only object; ValueError if there are several."""
        return self._only(self.covariances, "covariance", "covariances")

    @property
    def motion_covariances(self) -> NDArray[np.float64]:
        """(M, 6, 6) `covariances` without `unstated`: for differences between frames."""
        return self.covariances if self.unstated is None else self.covariances - self.unstated

    def _only(self, values: NDArray[np.float64], name: str, plural: str) -> NDArray[np.float64]:
        if len(values) != 1:
            raise ValueError(f"{name}: expected 1 tracked object, got {len(values)}; use .{plural}[k]")
        return values[0]

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

    def _repr_html_(self) -> str:
        """A row per object; the picture of a result is `draw(frame, result, shapes, camera)`."""
        rows = []
        for k, status in enumerate(self.status):
            at = " ".join(f"{1e3 * x:.1f}" for x in self.poses[k, :3, 3])
            sd = " ".join(f"{1e3 * x:.1f}" for x in np.sqrt(np.diag(self.covariances[k])[:3]))
            cells = (k, status.value, f"{self.confidence[k]:.2f}", at, sd, html.escape(self.reason[k]))
            rows.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
        head = "<th>object<th>status<th>confidence<th>position mm<th>sd mm<th>reason"
        return f"<table><caption>frame {self.index}</caption><tr>{head}</tr>{''.join(rows)}</table>"


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
    """Mark the result of one object as weak for a reason unknown to its tracker."""
    confidence = np.minimum(result.confidence, 0.5)
    return dataclasses.replace(result, status=[Status.WEAK], reason=[reason], confidence=confidence)
