# SPDX-License-Identifier: MIT
"""A hand that holds the object: capsule fingers wrapped around it, in contact, occluding a given share.

The hand holds the object for a while and moves with it, then slides back, in contact, to the side facing the camera,
and holds again; meanwhile the hand and its fingers drift. In every frame the reach of the fingers is solved for, so
that they occlude the given share of the visible object. Capsules (segments with a radius) are cast exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack._internal.validation import whole, within
from sdftrack.camera import Camera
from sdftrack.synth.bodies import SKIN, Body, Stage
from sdftrack.synth.surroundings import Layer

Array = NDArray[np.float64]
NEAREST_M = 0.05  # what reaches nearer to the camera is not drawn


@dataclass(frozen=True)
class Capsules:
    """N segments from `a` to `b` (N, 3) with `radius` (N,), metres."""

    a: Array
    b: Array
    radius: Array

    def __len__(self) -> int:
        return len(self.radius)

    def moved(self, T: Array) -> Capsules:
        """p -> T p."""
        R, t = T[:3, :3].T, T[:3, 3]
        return Capsules(self.a @ R + t, self.b @ R + t, self.radius)

    @classmethod
    def joined(cls, parts: list[Capsules]) -> Capsules:
        return cls(
            np.concatenate([p.a for p in parts]),
            np.concatenate([p.b for p in parts]),
            np.concatenate([p.radius for p in parts]),
        )


@dataclass(frozen=True)
class Hits:
    """Every pixel's ray with every capsule that it meets: flat pixel, capsule, depth (m), cosine of incidence."""

    pixel: NDArray[np.intp]
    capsule: NDArray[np.intp]
    depth: NDArray[np.float32]
    cosine: NDArray[np.float32]


def cast(capsules: Capsules, camera: Camera) -> Hits:
    """First meeting of each ray ``z r`` (``r`` with z = 1) with each capsule; capsules in the camera's frame."""
    pixel, k = _pairs(capsules, camera)
    x, y = camera.rays.reshape(-1, 2)[pixel].astype(np.float64).T
    a, axis, r2 = capsules.a[k], (capsules.b - capsules.a)[k], capsules.radius[k] ** 2
    # Distance of the ray's points from the infinite axis equals r: A z^2 + 2 B z + C = 0, scaled by |axis|^2.
    rr = x * x + y * y + 1
    ra = x * a[:, 0] + y * a[:, 1] + a[:, 2]
    rx = x * axis[:, 0] + y * axis[:, 1] + axis[:, 2]
    xx, ax, aa = _dot(axis, axis), _dot(a, axis), _dot(a, a)
    A, B = xx * rr - rx * rx, ax * rx - xx * ra
    C = xx * (aa - r2) - ax * ax
    inside = B * B - A * C
    meets = (inside >= 0) & (A > 1e-15)
    with np.errstate(invalid="ignore", divide="ignore"):
        z = np.where(meets, (-B - np.sqrt(inside)) / A, 0)
    along = z * rx - ax  # of the meeting, in units of |axis|^2
    # Beyond an end it is the end's ball that the ray meets, or nothing.
    at_end = meets & ((along < 0) | (along > xx))
    end = np.where((along > xx)[:, None], capsules.b[k], a)
    re, ee = x * end[:, 0] + y * end[:, 1] + end[:, 2], _dot(end, end)
    ball = re * re - rr * (ee - r2)
    with np.errstate(invalid="ignore"):
        z = np.where(at_end, (re - np.sqrt(ball)) / rr, z)
    meets &= ~at_end | (ball >= 0)
    meets &= z > NEAREST_M
    z, x, y, k, pixel = z[meets], x[meets], y[meets], k[meets], pixel[meets]
    p = z[:, None] * np.stack([x, y, np.ones_like(x)], axis=1)
    a, axis = a[meets], axis[meets]
    h = np.clip(_dot(p - a, axis) / np.maximum(_dot(axis, axis), 1e-18), 0, 1)
    normal = p - a - h[:, None] * axis
    cosine = -_dot(normal, p) / (np.linalg.norm(normal, axis=1) * np.linalg.norm(p, axis=1))
    return Hits(pixel, k, z.astype(np.float32), np.clip(cosine, 0, 1).astype(np.float32))


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("ij,ij->i", a, b)


def _pairs(capsules: Capsules, camera: Camera) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """(pixel, capsule) for the pixels in the box around each capsule's picture."""
    h, w = camera.shape
    ends = np.stack([capsules.a, capsules.b])
    z = ends[..., 2] - capsules.radius
    near = np.maximum(z, NEAREST_M)
    px = camera.project(np.where(z[..., None] > 0, ends, [0, 0, 1.0]))
    # A ball's outline is wider than r f / z: by its nearer side, and towards the image's border.
    stretch = 1 + np.hypot(*(ends[..., :2] / np.maximum(ends[..., 2:], NEAREST_M)).transpose(2, 0, 1)) ** 2
    reach = max(camera.fx, camera.fy) * capsules.radius / near * stretch + 2
    low = np.floor((px - reach[..., None]).min(axis=0))
    high = np.ceil((px + reach[..., None]).max(axis=0)) + 1
    low = np.clip(low, 0, [w, h]).astype(np.intp)
    high = np.clip(high, 0, [w, h]).astype(np.intp)
    size = np.maximum(high - low, 0)
    size[(z <= 0).any(axis=0)] = 0
    count = size[:, 0] * size[:, 1]
    capsule = np.repeat(np.arange(len(capsules)), count)
    within = np.arange(len(capsule)) - np.repeat(np.cumsum(count) - count, count)
    row = low[capsule, 1] + within // size[capsule, 0]
    column = low[capsule, 0] + within % size[capsule, 0]
    return row * w + column, capsule


DIRECTIONS = 64  # of a finger's curve around a section
JOINT_M = 0.006  # between the capsules of a finger: its curve is bent, not a few straight bones
BEYOND_RAD = 0.5  # how far past the farther rim a finger can reach
FINGER_M = 0.009  # radius
HOLD, SLIDE = (
    20,
    10,
)  # frames for which the hand moves with the object, and in which it then slides back into view
SPARE = 0.25  # breadth of the hand beyond the share that it must hide
GLOVES = (SKIN, (40, 90, 200), (60, 170, 70), (235, 225, 60), (25, 25, 30))


@dataclass(frozen=True)
class Grip:
    """Fingers in contact with the first object, moving with it and shifting over time.

    Parameters
    ----------
    share : float
        Share of the object's visible pixels occluded by the hand in every frame, 0..0.7.
    color : "skin", "similar", "other" or (r, g, b)
        "similar": every finger has a colour found on the object. "other": the colour among skin and some gloves that
        differs most from the object's.
    grow : int
        Number of frames in which the hand closes: the share rises linearly from zero; 0: closed from the first frame
        on.
    """

    share: float = 0.4
    color: str | tuple[int, int, int] = "skin"
    grow: int = 0

    def __post_init__(self) -> None:
        within(self.share, "occluder: Grip(share)", 0, 0.7)
        whole(self.grow, "occluder: Grip(grow)", 0)
        if isinstance(self.color, str):
            known = self.color in ("skin", "similar", "other")
        else:
            known = np.shape(self.color) == (3,) and all(0 <= c <= 255 for c in self.color)
        if not known:
            raise ValueError(
                f'occluder: Grip(color): expected "skin", "similar", "other" or (r, g, b), got {self.color!r}'
            )

    def ready(self, stage: Stage) -> Callable[[int, Any, Any], Layer]:
        """A function (frame, visible, depth) -> the hand's picture."""
        return _Held(self, stage).layer


@dataclass(frozen=True)
class _Hand:
    """Capsules in the object's frame with the finger and the reach (m along it) at which each appears."""

    capsules: Capsules
    finger: NDArray[np.intp]
    reach: Array


class _Held:
    def __init__(self, grip: Grip, stage: Stage) -> None:
        self._grip, self._stage = grip, stage
        body, rng = stage.body, np.random.default_rng([stage.seed, 5])
        self._side, self._phase = rng.uniform(0, 2 * np.pi, 2)
        breadth = float(2 * np.linalg.norm(body.points - body.centre, axis=1).max())
        pitch = 2.05 * FINGER_M
        count = max(4, int(np.ceil((grip.share + SPARE) * breadth / pitch)))
        self._offsets = pitch * (np.arange(count) - 0.5 * (count - 1))
        self._drift_m = 0.08 * breadth
        self._lag_m, self._creep = rng.uniform(-0.008, 0.008, count), rng.uniform(0, 2 * np.pi, count)
        self._colors = _colors(grip.color, body, rng, count)

    def layer(self, i: int, visible: NDArray[np.bool_], depth: NDArray[np.float32]) -> Layer:
        """The hand of frame i, reaching as far as the wanted share of `visible` asks for."""
        stage = self._stage
        closed = min(1.0, i / self._grip.grow) if self._grip.grow else 1.0
        wanted = round(self._grip.share * closed * np.count_nonzero(visible))
        if not wanted:
            return Layer.empty(stage.camera)
        hand = self.hand(i)
        hits = cast(hand.capsules.moved(stage.poses[i]), stage.camera)
        reach = hand.reach[hits.capsule]
        # From which reach on each visible pixel is hidden: the first capsule in front of it.
        hides = visible.ravel()[hits.pixel] & (hits.depth < depth.ravel()[hits.pixel])
        needed = np.full(visible.size, np.inf)
        np.minimum.at(needed, hits.pixel[hides], reach[hides])
        least = np.sort(needed[needed < np.inf])
        limit = least[min(wanted, len(least)) - 1] if len(least) else -np.inf
        drawn = reach <= max(float(limit), 0.0)
        order = np.flatnonzero(drawn)[np.argsort(-hits.depth[drawn], kind="stable")]  # the nearest last
        out = Layer.empty(stage.camera)
        at = hits.pixel[order]
        out.depth.reshape(-1)[at] = hits.depth[order]
        out.cosine.reshape(-1)[at] = hits.cosine[order]
        color = self._colors[hand.finger[hits.capsule[order]]]
        out.color.reshape(-1, 3)[at] = color * (0.6 + 0.4 * hits.cosine[order, None])
        return out

    def hand(self, i: int) -> _Hand:
        """All of the hand with its fingers as long as they can be, object frame."""
        stage = self._stage
        R = self._orientation(i)
        across, inward, up = R.T
        points = (stage.body.points - stage.body.centre) @ R
        seconds = i / stage.fps
        offsets = self._offsets + self._drift_m * np.sin(0.7 * seconds + self._phase)
        parts, finger, reach, knuckles = [], [], [], []
        for j, d in enumerate(offsets):
            curve = _finger_curve(points, d, FINGER_M)
            if curve is None:
                continue
            joints = stage.body.centre + d * across + curve @ np.stack([inward, up])
            parts.append(Capsules(joints[:-1], joints[1:], np.full(len(joints) - 1, FINGER_M)))
            finger.append(np.full(len(joints) - 1, j))
            lag = self._lag_m[j] + 0.006 * np.sin(1.3 * seconds + self._creep[j])
            reach.append(JOINT_M * np.arange(1, len(joints)) + lag)
            knuckles.append(joints[0])
        if knuckles:
            bones = _palm(np.array(knuckles), inward, up, FINGER_M)
            parts.append(bones)
            finger.append(np.full(len(bones), len(self._offsets)))
            reach.append(np.full(len(bones), -np.inf))
        if not parts:
            none = np.zeros((0, 3))
            return _Hand(Capsules(none, none, np.zeros(0)), np.zeros(0, np.intp), np.zeros(0))
        return _Hand(Capsules.joined(parts), np.concatenate(finger), np.concatenate(reach))

    def _orientation(self, i: int) -> Array:
        """Columns across the fingers, along them, and up to the camera, in the object's frame."""
        n = len(self._stage.poses)
        turn, at = divmod(i, HOLD + SLIDE)
        first = turn * (HOLD + SLIDE)
        held = self._home(min(first + HOLD // 2, n - 1))
        if at < HOLD:
            return held
        # Smooth at both ends: the hand neither starts nor stops with a jerk.
        s = (at - HOLD + 1) / (SLIDE + 1)
        target = self._home(min(first + HOLD + SLIDE + HOLD // 2, n - 1))
        change = np.eye(4)
        change[:3, :3] = held.T @ target
        w = geometry.log(change)[3:]
        return held @ geometry.pose(w * s * s * (3 - 2 * s))[:3, :3]

    def _home(self, i: int) -> Array:
        """The hand as the camera of frame i would see its back, object frame."""
        T = self._stage.poses[i]
        toward = -(T[:3, :3] @ self._stage.body.centre + T[:3, 3])
        toward /= np.linalg.norm(toward)
        side = self._side + 0.4 * i / self._stage.fps
        inward = np.array([np.cos(side), np.sin(side), 0])
        inward -= (inward @ toward) * toward
        inward /= np.linalg.norm(inward)
        return T[:3, :3].T @ np.column_stack([np.cross(inward, toward), inward, toward])


def _finger_curve(points: Array, offset: float, radius: float) -> Array | None:
    """(J, 2) joints (inward, up) of a finger that touches the section at `offset`, from rim to rim."""
    # The centre line lies on the hull of the section grown by the finger's radius, so that a finger of that radius
    # touches the surface and nowhere enters it; over a hollow it goes straight.
    beside = points[:, 0] - offset
    near = np.abs(beside) < radius
    if np.count_nonzero(near) < 3:
        return None
    q, grown = points[near, 1:], np.sqrt(radius**2 - beside[near] ** 2)
    angle = np.linspace(np.pi, -BEYOND_RAD, DIRECTIONS)
    direction = np.stack([np.cos(angle), np.sin(angle)])
    best = np.argmax(q @ direction + grown[:, None], axis=0)
    curve = q[best] + grown[best, None] * direction.T
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    if length[-1] < 2 * JOINT_M:
        return None
    s = np.arange(0, length[-1], JOINT_M)
    return np.column_stack([np.interp(s, length, curve[:, 0]), np.interp(s, length, curve[:, 1])])


def _palm(knuckles: Array, inward: Array, up: Array, radius: float) -> Capsules:
    """Bones of the palm from the knuckles out to the wrist, and the forearm away from the object."""
    back = -0.8 * inward - 0.6 * up
    wrist = knuckles.mean(axis=0) + 0.09 * back
    ends = 0.6 * (knuckles + 0.07 * back) + 0.4 * wrist
    elbow = wrist + 0.35 * (-0.97 * inward - 0.24 * up)
    return Capsules(
        np.concatenate([knuckles, ends, wrist[None]]),
        np.concatenate([ends, np.tile(wrist, (len(ends), 1)), elbow[None]]),
        np.concatenate([np.full(len(ends), 1.3 * radius), np.full(len(ends), 1.6 * radius), [3 * radius]]),
    )


def _colors(color: Any, body: Body, rng: np.random.Generator, count: int) -> Array:
    """(count + 1, 3): of each finger, and of the palm."""
    if color == "skin":
        return np.tile(np.array(SKIN, np.float64), (count + 1, 1))
    if color == "similar":
        return body.palette(rng, count + 1)
    if color == "other":
        own = body.palette(rng, 2000)
        distance = [np.percentile(np.linalg.norm(own - g, axis=1), 5) for g in GLOVES]
        color = GLOVES[int(np.argmax(distance))]
    return np.tile(np.array(color, np.float64), (count + 1, 1))
