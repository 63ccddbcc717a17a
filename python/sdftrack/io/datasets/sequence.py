# SPDX-License-Identifier: MIT
"""Sequences of frames in memory, on disk, or sliced from another sequence, with a common interface; their layouts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from collections.abc import Sequence as Seq
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.closing import ClosedByWith
from sdftrack._internal.rotations import RotationErrors, rigid_pose
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame
from sdftrack.symmetry import Symmetry

Pose = NDArray[np.float64]
Masks = dict[int, NDArray[np.bool_]]


class Sequence(ClosedByWith):
    """Frames with their camera and, if known, the ground truth.

    Parameters
    ----------
    frames : sequence of Frame
        A list, or any object with len() and integer indexing (read on access).
    camera : Camera or RGBDCamera
    ground_truth : {i: {k: T_cam_obj}} or (n, 4, 4) array, optional
        Poses (m) of instance k in frame i; an array is the pose of one object in every frame.
    models : {obj_id: Mesh}, optional
        Meshes in metres.
    objects : list of int, optional
        obj_id of each instance k; default: the only model, the models in order, or 1, 2, ...
    ids : list of int, optional
        Number of each image in its data set; default: 0, 1, ...
    masks : function i -> {k: (H, W) bool}, optional
    symmetries : {obj_id: Symmetry}, optional
        Symmetries given by the data set.
    layout, name : str
        Layout and name of the sequence.
    close : function, optional
        Closes the files that `frames` reads from; called once.

    Attributes
    ----------
    quantization : (m, 1/m) or None
        Sd of the depth by its storage in few bits: the first, and the second times the square of the distance.

    Examples
    --------
    >>> import numpy as np
    >>> camera = Camera(20, 20, 7.5, 5.5, 16, 12)
    >>> seq = Sequence([Frame(np.ones((12, 16), np.float32))] * 3, camera)
    >>> len(seq), len(seq[1:]), seq.camera.depth == camera
    (3, 2, True)
    """

    def __init__(
        self,
        frames: Any,
        camera: Camera | RGBDCamera,
        ground_truth: Mapping[int, Mapping[int, Any]] | NDArray[Any] | None = None,
        models: Mapping[int, Any] | None = None,
        *,
        objects: Seq[int] | None = None,
        ids: Seq[int] | None = None,
        masks: Callable[[int], Masks] | None = None,
        symmetries: Mapping[int, Symmetry] | None = None,
        layout: str = "memory",
        name: str = "",
        close: Callable[[], object] | None = None,
    ) -> None:
        if not (hasattr(frames, "__len__") and hasattr(frames, "__getitem__")):
            frames = list(frames)
        if not len(frames):
            raise ValueError("frames: expected at least one, got none")
        if isinstance(frames, list | tuple):
            for i, frame in enumerate(frames):
                if not isinstance(frame, Frame):
                    raise TypeError(f"frames[{i}]: expected st.Frame, got {type(frame).__name__}")
        if isinstance(camera, Camera):
            camera = RGBDCamera(camera)
        if not isinstance(camera, RGBDCamera):
            raise TypeError(f"camera: expected st.Camera or st.RGBDCamera, got {type(camera).__name__}")
        self._frames = frames
        self.camera = camera
        self.ground_truth = _poses(ground_truth, len(frames))
        self.models: Mapping[int, Any] = {} if models is None else models
        self.objects = _objects(objects, self.ground_truth, self.models)
        self.ids = list(range(len(frames))) if ids is None else [int(i) for i in ids]
        if len(self.ids) != len(frames):
            raise ValueError(f"ids: expected one per frame, {len(frames)}, got {len(self.ids)}")
        self._masks = masks
        self.symmetries: Mapping[int, Symmetry] = {} if symmetries is None else symmetries
        self.layout = layout
        self.name = name
        self._close = close
        self.quantization: tuple[float, float] | None = None
        self._again: tuple[Callable[..., Sequence], tuple[Any, ...]] | None = None

    def can_be_opened_again(self, opening: Callable[..., Sequence], *arguments: Any) -> Sequence:
        """This sequence; another process that it is sent to gets it by `opening(*arguments)`."""
        self._again = opening, arguments
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        # Files that are open, and functions that read them, cannot be sent to another process.
        if self._again is None:
            return (_in_memory, ({k: v for k, v in self.__dict__.items() if k not in ("_close", "_again")},))
        opening, arguments = self._again
        return (_opened_again, (opening, arguments, self.camera))

    def __len__(self) -> int:
        return len(self._frames)

    @overload
    def __getitem__(self, i: int) -> Frame: ...
    @overload
    def __getitem__(self, i: slice) -> Sequence: ...
    def __getitem__(self, i: int | slice) -> Frame | Sequence:
        if isinstance(i, slice):
            return self.part(range(len(self))[i])
        try:
            n = range(len(self))[i]  # negative numbers too
        except IndexError:
            raise IndexError(f"frame {i}: expected one of 0..{len(self) - 1}") from None
        frame = self._frames[n]
        return frame if frame.index is not None else frame.replace(index=n)

    def __iter__(self) -> Iterator[Frame]:
        return (self[i] for i in range(len(self)))

    def part(self, numbers: Seq[int]) -> Sequence:
        """The frames with these numbers, in this order, with what is known about them; read on access.

        Parameters
        ----------
        numbers : sequence of int
            Each of 0..len - 1.

        Raises
        ------
        ValueError
            No number.
        """
        if not len(numbers):
            raise ValueError(f"slice: expected at least one of the {len(self)} frames, got none")
        truth = {new: self.ground_truth[old] for new, old in enumerate(numbers) if old in self.ground_truth}
        chosen = Sequence.__new__(Sequence)
        chosen.__dict__.update(
            self.__dict__, _frames=_Picked(self, numbers), _masks=lambda i: self.masks(numbers[i]),
            ground_truth=truth, ids=[self.ids[i] for i in numbers], _close=self.close,
        )  # fmt: skip
        return chosen.can_be_opened_again(Sequence.part, self, list(numbers))

    def masks(self, i: int) -> Masks:
        """{k: (H, W) bool} masks of the instances in frame i, aligned with depth; {} if unknown."""
        i = range(len(self))[i]
        return {} if self._masks is None else self._masks(i)

    def take_unregistered_color(self) -> None:
        """Also read colour images that have no mapping to depth, of any size, to estimate that mapping from them.
        Without an effect on frames that are in memory, which have their images already."""
        take = getattr(self._frames, "take_color_of_any_size", None)
        if take is not None:
            take()

    def close(self) -> None:
        """Close open files; frames already returned stay valid. A second call does nothing."""
        close, self._close = self._close, None
        if close is not None:
            close()

    def __repr__(self) -> str:
        d = self.camera.depth
        name = f"{self.name!r}, " if self.name else ""
        return (
            f"Sequence({name}{self.layout}, {len(self)} frames, {d.width} x {d.height}, "
            f"{len(self.objects)} objects, truth for {len(self.ground_truth)})"
        )


def _opened_again(
    opening: Callable[..., Sequence], arguments: tuple[Any, ...], camera: RGBDCamera
) -> Sequence:
    sequence = opening(*arguments)
    sequence.camera = camera
    return sequence


def _in_memory(state: dict[str, Any]) -> Sequence:
    sequence = Sequence.__new__(Sequence)
    sequence.__dict__.update(state, _close=None, _again=None)
    return sequence


class _Picked:
    def __init__(self, whole: Sequence, numbers: Seq[int]) -> None:
        self._whole, self._numbers = whole, numbers

    def __len__(self) -> int:
        return len(self._numbers)

    def __getitem__(self, i: int) -> Frame:
        return self._whole[self._numbers[i]]

    def take_color_of_any_size(self) -> None:
        self._whole.take_unregistered_color()


class LazyModels(Mapping[int, Any]):
    """{obj_id: Mesh} whose files are read on first access."""

    def __init__(self, files: Mapping[int, Any], unit: str) -> None:
        self._files, self._unit = dict(sorted(files.items())), unit
        self._loaded: dict[int, Any] = {}

    def __getitem__(self, obj_id: int) -> Any:
        if obj_id not in self._files:
            raise KeyError(f"obj_id {obj_id}: this sequence has models {list(self._files)}")
        if obj_id not in self._loaded:
            self._loaded[obj_id] = self._load(self._files[obj_id])
        return self._loaded[obj_id]

    def _load(self, file: Any) -> Any:
        from sdftrack.mesh import Mesh

        return Mesh.load(file, unit=self._unit)

    def __iter__(self) -> Iterator[int]:
        return iter(self._files)

    def __len__(self) -> int:
        return len(self._files)

    def __contains__(self, obj_id: object) -> bool:
        return obj_id in self._files

    def __repr__(self) -> str:
        return f"models {list(self._files)}"


def _poses(truth: Any, count: int) -> dict[int, dict[int, Pose]]:
    if truth is None:
        return {}
    if not isinstance(truth, Mapping):
        stack = np.asarray(truth, dtype=np.float64)
        if stack.shape != (count, 4, 4):
            raise ValueError(f"ground_truth: expected shape ({count}, 4, 4), got {stack.shape}")
        truth = {i: {0: T} for i, T in enumerate(stack)}
    for i in truth:
        if not 0 <= i < count:
            raise ValueError(f"ground_truth: expected frame numbers 0..{count - 1}, got {i}")
    errors = RotationErrors()
    poses = {
        int(i): {int(k): rigid_pose(T, f"ground_truth[{i}][{k}]", errors) for k, T in truth[i].items()}
        for i in sorted(truth)
    }
    errors.tell(4)
    return poses


def _objects(
    objects: Seq[int] | None, truth: dict[int, dict[int, Pose]], models: Mapping[int, Any]
) -> list[int]:
    count, known = 1 + max((k for poses in truth.values() for k in poses), default=-1), list(models)
    if objects is not None:
        if len(objects) < count:
            raise ValueError(f"objects: expected one for each of {count} instances, got {list(objects)}")
        return [int(o) for o in objects]
    if not truth:
        return known
    if len(known) == 1:
        return known * count
    return known[:count] if len(known) >= count else list(range(1, count + 1))


@dataclass(frozen=True)
class Layout:
    """Detection and reader of a layout, and the keyword arguments that the reader takes besides the path."""

    name: str
    marks: str
    detect: Callable[[Path], bool]
    open: Callable[..., Sequence]
    options: tuple[str, ...] = ()


LAYOUTS: dict[str, Layout] = {}


def register(
    name: str, marks: str, detect: Callable[[Path], bool], options: tuple[str, ...] = ()
) -> Callable[[Callable[..., Sequence]], Callable[..., Sequence]]:
    """Decorator that makes `function(path, **options) -> Sequence` the reader of layout `name`. `marks` briefly names
    the files by which `detect(path)` recognises the layout, for messages. The path is a folder or a file."""

    def add(function: Callable[..., Sequence]) -> Callable[..., Sequence]:
        LAYOUTS[name] = Layout(name, marks, detect, function, options)
        return function

    return add
