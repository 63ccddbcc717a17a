# SPDX-License-Identifier: MIT
"""Result of an intrinsic calibration, and its observability: missing motion, parameters that are not determined."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import metrics
from sdftrack._internal.array_equality import Compared
from sdftrack.calibration.statistics import fuse
from sdftrack.camera import Camera
from sdftrack.io.report_file import plain
from sdftrack.results import Step
from sdftrack.sdf import SDF

Array = NDArray[np.float64]

COLUMNS, ROWS = 8, 6  # cells of the image
MIN_IN_CELL = 50  # measurements for a cell to count as visited
ALIKE = 0.95  # correlation beyond which two unknowns are not told apart
STILL_M, STILL_RAD = 0.01, np.radians(2.0)
FLAT, FLAT_RAD = 0.6, np.radians(1.0)
FEW_FRAMES = 20  # of a good sweep, seldom enough
DEPTH_SPAN, TURN_RAD = 0.2, np.radians(30.0)  # less is too little
# sd beyond which an unknown is not known: of fx and fy by themselves, of the others as stated.
HOPELESS = {"fx": 0.2, "fy": 0.2, "cx": 0.2, "cy": 0.2, "skew": 0.1, "k1": 1.0, "k2": 5.0}
HOPELESS |= {"depth_scale": 0.2, "depth_offset": 0.2}
SIDES: dict[str, Any] = {
    "left": np.s_[:, 0],
    "right": np.s_[:, -1],
    "top": np.s_[0, :],
    "bottom": np.s_[-1, :],
}


@dataclass(frozen=True, eq=False)
class Observability(Compared):
    """Observability of the camera parameters from the recording.

    Attributes
    ----------
    coverage : (6, 8) int
        Number of object pixels in each cell of the image, rows from the top.
    depth_m : (float, float)
        Smallest and largest distance of the object.
    turn_rad : float
        Largest rotation between two frames.
    correlation : (n, n) float64
        Correlation of the parameters, in the order of ``free``.
    advice : list of str
        How to improve the calibration, one sentence each; empty: nothing is missing.
    """

    coverage: NDArray[np.int64]
    depth_m: tuple[float, float]
    turn_rad: float
    correlation: Array
    advice: list[str]


def observe(coverage: NDArray[Any], poses: Array, names: Sequence[str], covariance: Array) -> Observability:
    """Report from the poses (M, 4, 4), the pixels per cell, and the covariance of the parameters."""
    distance = np.linalg.norm(poses[:, :3, 3], axis=1)
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sd, sd)
    turn = _largest_turn(poses)
    advice = _missing_places(coverage)
    if np.ptp(distance) < DEPTH_SPAN * distance.mean():
        advice.append(
            f"the object stayed at {distance.min():.2f} to {distance.max():.2f} m: move it closer and farther"
        )
    if turn < TURN_RAD:
        advice.append(f"the object rotated by only {np.degrees(turn):.0f} deg: show it from more sides")
    for i, j in itertools.combinations(range(len(names)), 2):
        if abs(correlation[i, j]) > ALIKE:
            advice.append(
                f"{names[i]} and {names[j]} are hardly distinguishable (correlation {correlation[i, j]:.3f}): "
                "move the object closer and farther, or free only one of them"
            )
    return Observability(
        coverage.astype(np.int64), (distance.min(), distance.max()), turn, correlation, advice
    )


def refuse_still_object(poses: Array) -> None:
    """ValueError if the object does not move: one view is not sufficient."""
    moved = np.linalg.norm(np.ptp(poses[:, :3, 3], axis=0))
    turned = _largest_turn(poses)
    if moved < STILL_M and turned < STILL_RAD:
        raise ValueError(
            f"frames: the object does not move ({1e3 * moved:.1f} mm and {np.degrees(turned):.1f} deg in all); move it "
            "through the whole image, nearer and farther, and turn it"
        )


def refuse_flat_shape(sdf: SDF, names: Sequence[str]) -> None:
    """ValueError if depth scale or offset is to be estimated from a shape with flat faces."""
    # Planar faces and their angles look the same on a smaller, closer body; only curved surfaces, or the outline, which
    # is not used, determine the size (docs/math/intrinsics.md, section 3).
    asked = [name for name in ("depth_scale", "depth_offset") if name in names]
    if asked and (flat := _flat_share(sdf)) > FLAT:
        raise ValueError(
            f"free: {' and '.join(asked)} cannot be estimated with this shape, whose surface is flat "
            f"to {100 * flat:.0f} %: use a curved shape, or fix the parameter"
        )


def _flat_share(sdf: SDF) -> float:
    """Fraction of the surface whose normal is constant over a twentieth of the object's size."""
    vertices = sdf.to_mesh().vertices
    points = vertices[:: max(1, len(vertices) // 1000)]
    step = 0.05 * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    normals = _unit(sdf.gradient(points))
    along = _unit(np.cross(normals, np.roll(normals, 1, axis=1) + np.array([0.3, 0.5, 0.7])))
    cosine = np.einsum("ij,ij->i", normals, _unit(sdf.gradient(points + step * along)))
    return float(np.mean(cosine > np.cos(FLAT_RAD)))


def _unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-12)


def refuse_unobservable(
    names: Sequence[str], sd: Array, camera: Camera, frames: int, open_shifts: Array
) -> None:
    """ValueError naming the parameters that are not observable in the frames, and the cause."""
    # `open_shifts` (M,): number of directions in which the object's position is undetermined in each frame.
    unit = {"fx": camera.fx, "fy": camera.fy, "cx": camera.width, "cy": camera.width, "skew": camera.fx}
    bad = [
        f"{name} ({f'sd {s:.3g}' if np.isfinite(s) else 'not at all'})"
        for name, s in zip(names, sd, strict=True)
        if not s < HOPELESS[name] * unit.get(name, 1.0)
    ]
    if not bad:
        return
    raise ValueError(f"frames: the object does not show {', '.join(bad)}: {_cause(frames, open_shifts)}")


def _cause(frames: int, open_shifts: Array) -> str:
    """Cause: even a body without symmetry may look the same when moved, if its ends are out of view."""
    usual = int(np.median(open_shifts))
    if usual:
        way = "along a line" if usual == 1 else "along two lines"
        return (
            f"what is in view looks the same when the object is moved {way}, like a pole or a plate whose ends are "
            "out of view; show its ends, rotate it in the image, or use a smaller one"
        )
    if frames < FEW_FRAMES:
        return f"{frames} frames are too few; record a few tens of frames with the object moving and rotating"
    return "move it through the whole image, nearer and farther, and turn it"


def _missing_places(coverage: NDArray[Any]) -> list[str]:
    missing = [side for side, cells in SIDES.items() if (coverage[cells] >= MIN_IN_CELL).mean() < 0.5]
    if not missing:
        return []
    share = (coverage >= MIN_IN_CELL).mean()
    return [
        f"the object covered {100 * share:.0f} % of the image and hardly reached its {', '.join(missing)} "
        f"{'edge' if len(missing) == 1 else 'edges'}: move it into the corners"
    ]


def _largest_turn(poses: Array) -> float:
    """Largest angle from the first frame, or from the frame farthest from it."""
    if len(poses) < 2:
        return 0.0
    from_first = metrics.pose_error(poses, poses[0])[1]
    return float(np.max(metrics.pose_error(poses, poses[int(np.argmax(from_first))])[1]))


@dataclass(frozen=True, eq=False)
class PerFrame(Compared):
    """Estimates from single frames, and their information-weighted mean (thesis Eq. 3.23).

    Frames in which a parameter is unobservable are excluded.

    Attributes
    ----------
    frames : list of int
        Indices of the frames.
    values : (M, n) float64
        In the order of ``free``.
    covariances : (M, n, n) float64
        Marginal: the pose is unknown too (docs/math/intrinsics.md, section 2).
    fused : (n,) float64
    fused_covariance : (n, n) float64
    """

    frames: list[int]
    values: Array
    covariances: Array
    fused: Array
    fused_covariance: Array

    def running(self) -> Array:
        """(M, n): the mean of the first 1, 2, ... M frames, as in thesis Fig. 3.12."""
        information = np.linalg.inv(self.covariances)
        weighted = np.cumsum(np.einsum("mij,mj->mi", information, self.values), axis=0)
        return np.linalg.solve(np.cumsum(information, axis=0), weighted[:, :, None])[:, :, 0]


@dataclass(frozen=True, eq=False)
class IntrinsicsResult(Compared):
    """Intrinsics of a depth camera from a known object, with their uncertainty.

    Attributes
    ----------
    camera : Camera
    free : tuple of str
        The estimated parameters, in the order of the arrays.
    values : (n,) float64
        Pixels, plain numbers, or metres (depth_offset).
    covariance : (n, n) float64
    interval95 : (n, 2) float64
        Lower and upper end of the 95 % intervals.
    extra : dict
        skew (px), depth_scale and depth_offset (m) where they were free: ``depth = scale * reading + offset``.
    bias : (n,) float64
        Bias of the estimate due to noise, measured in a simulation (depth rendered from the solution, with the noise of
        each frame); not subtracted.
    per_frame : PerFrame
        Estimates from the frames that were used.
    poses : (M, 4, 4) float64
        ``T_cam_obj`` of the frames that were used, m.
    frames : list of int
        Indices of those frames.
    left_out : dict of int to str
        Reasons why the other frames were not used.
    noise_m : (M,) float64
        Noise sd of the depth in each frame.
    observability : Observability
    status : "ok" or "weak"
        "weak": the object's motion was insufficient, or the estimates of single frames contradict each other; see
        ``reason``.
    reason : str
    joint : bool
        True: joint solution over all frames; False: mean of the single-frame estimates.
    steps : list of Step
    seconds : float
    """

    camera: Camera
    free: tuple[str, ...]
    values: Array
    covariance: Array
    interval95: Array
    extra: dict[str, float]
    bias: Array
    per_frame: PerFrame
    poses: Array
    frames: list[int]
    left_out: dict[int, str]
    noise_m: Array
    observability: Observability
    status: str
    reason: str
    joint: bool
    steps: list[Step]
    seconds: float

    @property
    def sd(self) -> Array:
        """(n,) standard deviations of ``values``."""
        return np.sqrt(np.diag(self.covariance))

    def __repr__(self) -> str:
        parts = [
            f"{name} = {value:.6g} +- {(high - low) / 2:.2g}"
            for name, value, (low, high) in zip(self.free, self.values, self.interval95, strict=True)
        ]
        return f"IntrinsicsResult({', '.join(parts)}; {len(self.frames)} frames, {self.status})"

    def to_dict(self) -> dict[str, Any]:
        """Convert to numbers, lists and strings for JSON, None where unknown."""
        names = (
            "free", "values", "covariance", "interval95", "extra", "bias", "status", "reason", "joint", "frames",
        )  # fmt: skip
        content = {
            "camera": dataclasses.asdict(self.camera),
            **{name: getattr(self, name) for name in (*names, "left_out", "noise_m", "poses", "seconds")},
            "fused": {"values": self.per_frame.fused, "covariance": self.per_frame.fused_covariance},
            "observability": dataclasses.asdict(self.observability),
        }
        return dict(plain(content))


def per_frame_of(estimates: dict[str, Any], order: list[int], frames: list[int]) -> PerFrame:
    """Single-frame estimates of the core for `frames`, with the parameters in the caller's `order`."""
    information = estimates["information"]
    sane = np.linalg.eigvalsh(information)[:, 0] > 0
    if not sane.any():
        n = len(order)
        return PerFrame(
            [], np.empty((0, n)), np.empty((0, n, n)), np.full(n, np.nan), np.full((n, n), np.nan)
        )
    information = information[sane][:, order][:, :, order]
    values = estimates["value"][sane][:, order]
    fused, covariance = fuse(values, information)
    own = [i for i, good in zip(frames, sane, strict=True) if good]
    return PerFrame(own, values, np.linalg.inv(information), fused, covariance)
