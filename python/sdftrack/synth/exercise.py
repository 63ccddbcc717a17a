# SPDX-License-Identifier: MIT
"""Exercises of rehabilitation with an object on a table, as functions of time whose derivatives are exact."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from collections.abc import Sequence as Several
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import geometry
from sdftrack._internal.files import write_json
from sdftrack._internal.text_files import contents, read_json
from sdftrack._internal.validation import numbers, of_kind, whole, within
from sdftrack.camera import Camera
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.motion.posterior import MotionSamples
from sdftrack.synth.exercise_motion import ObjectMotion
from sdftrack.synth.exercise_plans import PLANS, Wishes
from sdftrack.synth.scene import DEFAULT_CAMERA, sequence
from sdftrack.synth.surroundings import Table

Array = NDArray[np.float64]
VIEWS = 200  # tries until all of the exercise is in view
TREMBLING = ("reach", "pouring", "tremor")


@dataclass(frozen=True)
class Exercise:
    """An exercise with its truth; made by :func:`exercise`.

    Positions are those of the object's origin in the camera frame. The object's z axis points up when it stands. Two
    exercises are equal if their arguments are.

    Attributes
    ----------
    kind : str
    arguments : dict
        Of :func:`exercise`, which returns the same exercise for them.
    fps : float
    duration_s : float
    cues_s : tuple of float
        When each repetition is called for, before it starts by a random reaction time; one for all circles.
    repetitions : tuple of (start_s, end_s)
        From the first motion to the last. Speeds rise smoothly, so that a threshold is crossed somewhat later.
    phases : tuple of (name, start_s, end_s)
        Without gaps: "rest" (not moving at all), "move", "hold" (away: held, tilted or trembling), "return".
    tremor_hz : float or None
    tremor_amplitude_m, tremor_amplitude_rad : float
        Amplitudes (half of peak to peak) along the main axis and of the rotation, in the mean of their slow modulation.
    up : (3,) float64
        Unit vector against gravity, camera frame.
    table : (3,) float64, float
        n, d of the plane n . p + d = 0, camera frame, n = up.
    T_cam_table : (4, 4) float64
        Table frame: x to the right, y away from the camera, z up, origin where the optical axis meets the table.
    times_s : (n,) float64
        Of the frames of a camera, i / fps.
    objects : int
        Number of objects: 2 for "two_handed" (left, right), else 1.
    """

    kind: str
    arguments: dict[str, Any] = field(repr=False)
    fps: float
    duration_s: float
    cues_s: tuple[float, ...]
    repetitions: tuple[tuple[float, float], ...]
    phases: tuple[tuple[str, float, float], ...] = field(repr=False)
    tremor_hz: float | None
    tremor_amplitude_m: float
    tremor_amplitude_rad: float
    T_cam_table: Array = field(repr=False, compare=False)
    motions: tuple[ObjectMotion, ...] = field(repr=False, compare=False)

    __hash__ = None  # type: ignore[assignment]

    @property
    def up(self) -> Array:
        return self.T_cam_table[:3, 2].copy()

    @property
    def table(self) -> tuple[Array, float]:
        return self.up, -float(self.up @ self.T_cam_table[:3, 3])

    @property
    def times_s(self) -> Array:
        return np.arange(math.floor(self.duration_s * self.fps) + 1) / self.fps

    @property
    def objects(self) -> int:
        return len(self.motions)

    def sample(self, times_s: ArrayLike | None = None, object: int = 0) -> MotionSamples:
        """Exact motion (S = 1) of an object's origin in the camera frame; None: at `times_s` of the frames."""
        times = self.times_s if times_s is None else np.atleast_1d(numbers(times_s, "times_s"))
        if times.ndim != 1 or not np.isfinite(times).all():
            raise ValueError(f"times_s: expected finite times of shape (n,), got shape {times.shape}")
        motion = self.motions[whole(object, "object", 0, self.objects - 1)]
        R, w = motion.rotations(times)
        R_cam = self.T_cam_table[:3, :3]
        place, velocity, acceleration, jerk = (motion.places(times) @ R_cam.T)[:, None]
        return MotionSamples(
            times, place + self.T_cam_table[:3, 3], velocity, acceleration, jerk, rotations=(R_cam @ R)[None],
            angular_velocities_radps=(w @ R_cam.T)[None], observed=np.ones(len(times), bool),
        )  # fmt: skip

    def poses(self, times_s: ArrayLike | None = None, object: int = 0) -> Array:
        """(n, 4, 4) exact T_cam_obj in metres; None: at `times_s` of the frames."""
        exact = self.sample(times_s, object)
        T = np.tile(np.eye(4), (len(exact.times_s), 1, 1))
        T[:, :3, :3], T[:, :3, 3] = exact.rotations[0], exact.positions_m[0]
        return T

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the arguments and the truth as JSON, for `load_exercise` and for other programs."""
        write_json(path, self.truth())

    def truth(self) -> dict[str, Any]:
        """Arguments and truth as numbers, lists and tuples, as `save` writes them."""
        n, d = self.table
        told = {
            f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("T_cam_table", "motions")
        }
        return {**told, "up": n.tolist(), "table": {"n": n.tolist(), "d_m": d}}


def exercise(
    kind: str,
    *,
    seed: int = 0,
    repetitions: int = 5,
    fps: float = 30.0,
    submovements: int | None = None,
    tremor_hz: float | None = None,
    tremor_amplitude_m: float | None = None,
    origin_m: float = 0.0,
    meeting_m: float = 0.08,
) -> Exercise:
    """Create an exercise as a patient performs it in front of a camera that looks down at a table.

    Movements are sums of overlapping smooth steps with continuous jerk (minimum snap), submovements whose number,
    overlap, size and direction are random, so that smoothness varies; start, direction, distance, durations, pauses,
    reaction times, rotation and view are random, too. All of it stays in view of a camera of 640 x 480 with 525 px.

    Parameters
    ----------
    kind : str
        "reach": lifted, carried 0.2-0.4 m, held, carried back, put down. "pouring": likewise, and tilted by 60-110
        degrees. "circle": circles drawn on the table without a pause. "tremor": held for 4-7 s with a tremor of 4-9 Hz
        and 0.5-3 mm. "two_handed": two objects are carried to the middle, touch, and are carried back.
    seed : int
    repetitions : int
        Or circles.
    fps : float
        Frames per second of `times_s` and of rendered sequences.
    submovements : int, optional
        Of each way; by default 1 to 4. Not for "circle".
    tremor_hz, tremor_amplitude_m : float, optional
        Of the tremor while the object is held ("reach", "pouring", "tremor"); 0 m: none. By default random for
        "tremor", none for the others unless one of the two is given.
    origin_m : float
        Height of the object's origin over the table when it stands; 0 for `exercise_object`.
    meeting_m : float
        Distance of the two origins when the objects of "two_handed" touch: their width.

    Raises
    ------
    TypeError, ValueError
        An unknown kind, a number out of range, a tremor of an exercise without a phase "hold".

    Examples
    --------
    >>> reach = exercise("reach", seed=1, repetitions=2)
    >>> len(reach.repetitions), reach.sample([0.0, 0.1]).speeds_mps.tolist()
    (2, [[0.0, 0.0]])
    """
    if kind not in PLANS:
        raise ValueError(f"kind: expected one of {', '.join(PLANS)}, got {kind!r}")
    arguments: dict[str, Any] = {
        "seed": whole(seed, "seed", 0),
        "repetitions": whole(repetitions, "repetitions", 1, 1000),
        "fps": within(fps, "fps", 1, 10_000, "frames per second"),
        "submovements": None if submovements is None else whole(submovements, "submovements", 1, 100),
        "tremor_hz": None if tremor_hz is None else within(tremor_hz, "tremor_hz", 0.1, 1000, "Hz"),
        "tremor_amplitude_m": (
            None
            if tremor_amplitude_m is None
            else within(tremor_amplitude_m, "tremor_amplitude_m", 0, 0.02, "m")
        ),
        "origin_m": within(origin_m, "origin_m", -0.5, 0.5, "m"),
        "meeting_m": within(meeting_m, "meeting_m", 0.01, 0.2, "m"),
    }
    if kind not in TREMBLING and (tremor_hz is not None or tremor_amplitude_m):
        raise ValueError(f"tremor: expected one of the kinds {', '.join(TREMBLING)}, got {kind!r}")
    if kind == "circle" and submovements is not None:
        raise ValueError("submovements: circles have none; leave it out")
    wanted = Wishes(**{name: arguments[name] for name in Wishes.__dataclass_fields__})
    for attempt in range(VIEWS):
        rng = np.random.default_rng([arguments["seed"], list(PLANS).index(kind), attempt])
        view = random_view(rng)
        plan = PLANS[kind](wanted, rng)
        if in_view(view, plan.motions, plan.duration_s, wanted.origin_m):
            view.setflags(write=False)
            told: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in vars(plan).items()}
            return Exercise(kind, arguments, arguments["fps"], T_cam_table=view, **told)
    raise ValueError(f"{kind}: found no view of all of it in {VIEWS} tries; change seed or meeting_m")


# -- Exercises from their files


SAME = 1e-9  # s, m, Hz: the last digits of sines differ between machines


def load_exercise(path: str | os.PathLike[str]) -> Exercise:
    """Read what `Exercise.save` or ``sdftrack synth exercise`` wrote; equal to the exercise that was written.

    Parameters
    ----------
    path : str or path
        The file, or the folder that holds exercise.json.

    Raises
    ------
    FileNotFoundError, ValueError
        No such file; a file that is none of an exercise; one of a version that made other exercises.
    """
    file = Path(path)
    if file.is_dir():
        file /= "exercise.json"
    stored = read_json(file)
    with contents(file, "the file of an exercise"):
        made = exercise(stored["kind"], **stored["arguments"])
        same = _differences(made.truth(), stored) <= SAME
    if not same:
        raise ValueError(
            f"{file}: written by a version that makes other exercises of these arguments; make it anew"
        )
    return made


def _differences(a: Any, b: Any) -> float:
    """The largest difference of numbers in two values of JSON; inf where anything else differs."""
    if isinstance(a, dict) and isinstance(b, dict):
        a, b = sorted(a.items()), sorted(b.items())
    if isinstance(a, list | tuple) and isinstance(b, list | tuple) and len(a) == len(b):
        return max((_differences(x, y) for x, y in zip(a, b, strict=True)), default=0.0)
    if isinstance(a, float) and isinstance(b, float | int):
        return abs(a - b)
    return 0.0 if a == b else math.inf


# -- Where a camera stands that looks down at a table, and whether it sees all of an exercise


DISTANCE_M = (0.6, 0.9)  # along the optical axis
DOWN_RAD = (float(np.radians(38)), float(np.radians(60)))
ROLL_RAD = float(np.radians(4))
RATE_HZ = 25.0  # at which visibility is checked
# A ball that holds each of the objects, and how far its middle is above the foot.
BALL_M, MIDDLE_M = 0.09, 0.06


def random_view(rng: np.random.Generator) -> Array:
    """T_cam_table of a camera whose optical axis meets the table in the table's origin."""
    down, roll = rng.uniform(*DOWN_RAD), rng.uniform(-ROLL_RAD, ROLL_RAD)
    x, up = np.array([1.0, 0, 0]), np.array([0, -np.cos(down), -np.sin(down)])
    T = np.eye(4)
    T[:3, :3] = geometry.pose([0, 0, roll])[:3, :3] @ np.column_stack([x, np.cross(up, x), up])
    T[2, 3] = rng.uniform(*DISTANCE_M)
    return T


def in_view(T_cam_table: Array, motions: Iterable[ObjectMotion], duration_s: float, origin_m: float) -> bool:
    """Whether a hand-sized object stays inside the image."""
    times = np.arange(0, duration_s, 1 / RATE_HZ)
    for motion in motions:
        middle = motion.places(times)[0] + (MIDDLE_M - origin_m) * motion.rotations(times)[0][:, :, 2]
        p = geometry.transform_points(T_cam_table, middle)
        # To first order; the outline of a ball away from the axis is a little longer.
        reach = 1.1 * BALL_M / p[:, 2]
        K = DEFAULT_CAMERA
        for axis, focal, centre, size in ((0, K.fx, K.cx, K.width), (1, K.fy, K.cy, K.height)):
            px = focal * p[:, axis] / p[:, 2] + centre
            if (px - focal * reach).min() < 0 or (px + focal * reach).max() > size - 1:
                return False
    return True


# -- Rendered sequences of exercises


STANDS_M = 0.002  # how far the foot of an object may be from the table


def exercise_sequence(
    exercise: Exercise,
    meshes: Any,
    *,
    noise: Any = "kinect",
    camera: Camera | None = None,
    around: str | None = "table",
    occluder: Any = None,
    frames: int | None = None,
    seed: int = 0,
    color: bool = True,
    threads: int = 0,
) -> Sequence:
    """Render an exercise at the times i / fps, with exact poses and masks.

    Parameters
    ----------
    exercise : Exercise
    meshes : Mesh, SDF, path, or a list of them, one for each object
        With z up and the lowest point `origin_m` below the origin, as `exercise_object` has it (0). One shape for two
        objects is one model with two instances.
    noise, occluder, camera, color, threads
        As in :func:`sequence`. The view is that of a camera of 640 x 480 with 525 px; another one sees as much only
        if its field of view is as wide.
    around : "table", "wall" or None
        The table of the exercise and a wall, a wall, or nothing.
    frames : int, optional
        The first ones alone.
    seed : int
        Of noise, colours and surroundings.

    Examples
    --------
    >>> from sdftrack.synth import exercise as make, exercise_object
    >>> seq = exercise_sequence(make("reach", repetitions=1), exercise_object("box"), frames=2)
    >>> seq[1].depth.shape, round(seq[1].timestamp, 4)
    ((480, 640), 0.0333)
    """
    of_kind(exercise, Exercise, "exercise", "create it with st.synth.exercise")
    if around not in ("table", "wall", None):
        raise ValueError(f'around: expected "table", "wall" or None, got {around!r}')
    given = list(meshes) if isinstance(meshes, Several) and not isinstance(meshes, str) else [meshes]
    if len(given) == 1:
        given *= exercise.objects
    if len(given) != exercise.objects:
        raise ValueError(f"meshes: expected 1 or {exercise.objects} for {exercise.kind!r}, got {len(given)}")
    for mesh in given:
        _check_stands(mesh, exercise.arguments["origin_m"])
    times = exercise.times_s if frames is None else exercise.times_s[: whole(frames, "frames", 1)]
    poses = np.stack([exercise.poses(times, k) for k in range(exercise.objects)], axis=1)
    n, d = exercise.table
    table = Table((float(n[0]), float(n[1]), float(n[2])), d)
    return sequence(
        given, len(times), poses, noise, occluder, seed, camera=camera,
        clutter=table if around == "table" else around, color=color, fps=exercise.fps, threads=threads,
    )  # fmt: skip


def _check_stands(mesh: Any, origin_m: float) -> None:
    if not hasattr(mesh, "raycast"):  # a volume's box is larger than what it holds
        return
    low = float(mesh.bounds[0][2])
    if abs(low + origin_m) > STANDS_M:
        raise ValueError(
            f"meshes: expected the lowest point at z = {-origin_m:g} m, as the exercise's origin_m says, "
            f"got {low:.4f}; create it with exercise(..., origin_m={-low:.4f})"
        )
