# SPDX-License-Identifier: MIT
"""What the writers of all layouts share: a folder, frames one after the other, index files at the end, and a journal
from which an interrupted recording is continued or finished."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, TextIO

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.closing import ClosedByWith
from sdftrack._internal.systems import reserve
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame, as_given
from sdftrack.io.frames import write_color, write_depth_units
from sdftrack.io.writers.video import VideoWriter, has_encoder, last_image

COLOR_FILES = ("png", "jpg", "video")
FRAME_PERIOD_S = 1 / 30  # where a sequence has no times
Array = NDArray[np.float64]
LARGEST = 65535


@dataclass(frozen=True)
class Contents:
    """What a sequence holds besides its frames; `objects`: the obj_id of each instance k."""

    camera: RGBDCamera
    objects: list[int] = field(default_factory=list)
    models: Mapping[int, Any] = field(default_factory=dict)


class LayoutWriter(ClosedByWith):
    """Writes a sequence into a folder: `add` each frame, then `finish`.

    The folder exists, and is empty unless `resume`. What was added is kept if the program ends early: ``resume=True``
    goes on with it, and `count`, the number of frames so far, includes it. `close` without `finish` leaves it to be
    continued. `color` is a kind of image file, or "video": one file ``color.mkv``, about a seventh of jpg.

    ValueError for something that the layout cannot represent. OSError when the disk is full: what was added before can
    be finished and read.
    """

    name: ClassVar[str]
    folders: ClassVar[tuple[str, ...]]
    units: ClassVar[tuple[tuple[int, ...], tuple[int, ...]]]  # arguments of DepthUnits
    holds_video: ClassVar[bool] = True

    def __init__(self, folder: Path, contents: Contents, color: str = "png", resume: bool = False) -> None:
        self.check_color(color)
        self.check_contents(contents)
        self.folder, self.contents, self._suffix = folder, contents, f".{color}"
        self._units = DepthUnits(*self.units)
        header = {
            "layout": self.name, "camera": repr(contents.camera), "objects": contents.objects, "color": color,
        }  # fmt: skip
        held = last_image(folder) if resume and color == "video" else -1
        # An image of the video is in the file when the next one has come: a frame without its image is not whole.
        self.journal = Journal(folder, header, resume, lambda entry: (entry.get("video") or -1) <= held)
        for name in self.folders:
            (folder / name).mkdir(exist_ok=True)
        self._video = (
            VideoWriter(folder, (self.journal.last or {}).get("video")) if color == "video" else None
        )
        if not resume:
            self.write_models()

    @property
    def count(self) -> int:
        return self.journal.count

    @property
    def rounded_m(self) -> float:
        return self._units.rounded_m

    def add(
        self, frame: Frame, poses: Mapping[int, Array] | None = None,
        masks: Mapping[int, NDArray[np.bool_]] | None = None, im_id: int | None = None,
    ) -> None:  # fmt: skip
        """Write one frame, with true poses T_cam_obj (m) and masks of the instances k. `im_id` is the number of the
        image; by default the number of frames so far."""
        number = self.count if im_id is None else im_id
        entry = self.write_frame(as_given(frame), dict(sorted((poses or {}).items())), masks or {}, number)
        if self._video is not None:
            entry["video"] = self._video.last  # where a continuation goes on
        self.journal.add(entry)

    def finish(self, last: Callable[[], object] | None = None) -> None:
        """Write the index files; the folder is then a sequence of this layout. `last` writes what else belongs to it: a
        program that is killed before leaves a recording to be continued."""
        self.journal.free_reserve()
        if self._video is not None:
            self._video.finish()
        self.write_index(self.journal.entries())
        for name in self.folders:
            with contextlib.suppress(OSError):  # it holds files
                (self.folder / name).rmdir()
        if last is not None:
            last()
        self.journal.remove()

    def close(self) -> None:
        self.journal.close()
        if self._video is not None:
            self._video.close()

    @classmethod
    def check_color(cls, color: str) -> None:
        if color not in COLOR_FILES:
            raise ValueError(f"color: expected one of {', '.join(COLOR_FILES)}, got {color!r}")
        if color == "video" and not cls.holds_video:
            raise ValueError(
                f"color: the {cls.name} layout holds images one by one; use png or jpg, got video"
            )
        if color == "video" and not has_encoder():
            raise ValueError("color: this build of PyAV has no H.264 encoder (libx264); use png or jpg")

    @classmethod
    def lost_of_color(cls, camera: RGBDCamera) -> str:
        """What is lost of the colour of this camera, a sentence for a warning; "" if nothing is."""
        if camera.aligned:
            return ""
        return f"colour is omitted: the {cls.name} layout requires it to be aligned to depth; mcap holds both images"

    @classmethod
    def check_contents(cls, contents: Contents) -> None:
        """Raise ValueError for contents that the layout cannot represent."""

    def write_models(self) -> None:
        for mesh in self.contents.models.values():
            mesh.save(self.folder / "model.ply")

    def write_frame(
        self, frame: Frame, poses: dict[int, Array], masks: Mapping[int, NDArray[np.bool_]], im_id: int
    ) -> dict[str, Any]:
        raise NotImplementedError

    def write_index(self, entries: Iterable[dict[str, Any]]) -> None:
        raise NotImplementedError

    def camera_of(self, frame: Frame) -> Camera:
        return self.contents.camera.depth if frame.camera is None else depth_camera(frame.camera)

    def write_images(self, frame: Frame, depth: Path, color: Path, number: int) -> tuple[int, str | None]:
        assert frame.depth is not None
        units, units_per_m = self._units.of(frame)
        write_depth_units(depth, units)
        return units_per_m, self.write_color(frame, color, number)

    def write_color(self, frame: Frame, path: Path, number: int) -> str | None:
        if frame.color is None or not self.contents.camera.aligned:
            return None
        if self._video is not None:
            return self._video.add(number, frame.color)
        path = path.with_suffix(self._suffix)
        write_color(path, frame.color)
        return path.name

    @classmethod
    def check_one_object(cls, contents: Contents) -> None:
        if (count := len(contents.objects)) > 1:
            raise ValueError(f"layout: {cls.name} holds one object's poses, got {count}; use 'bop'")

    def check_own_camera(self, frame: Frame) -> None:
        if frame.camera is not None and depth_camera(frame.camera) != self.contents.camera.depth:
            one = f"{self.name} holds one camera"
            raise ValueError(f"layout: {one}, but frame {frame.index} has its own; use 'bop'")

    @classmethod
    def check_no_lens(cls, camera: Camera) -> None:
        if camera.distortion:
            lens = f"the {cls.name} layout has no lens distortion"
            raise ValueError(f"camera: {lens}; rectify the images or use tum")


class DepthUnits:
    """Chooses units per metre, so that reading the file returns the bits of the depth image. `default` are in order of
    preference for depth that no unit represents exactly, e.g. of a synthetic image; `exact` are further ones that the
    layout can state: sensors deliver multiples of one of these. `rounded_m` is the step to which some image so far was
    rounded, m; 0 if all were stored exactly."""

    def __init__(self, default: tuple[int, ...], exact: tuple[int, ...] = ()) -> None:
        self._default, self._candidates = default, (*default, *exact)
        self.rounded_m = 0.0

    def exact(self, frame: Frame) -> tuple[NDArray[np.uint16], int] | None:
        """(H, W) uint16 units that return the bits of the frame's depth, and units per metre; None if none does."""
        assert frame.depth is not None
        farthest = float(frame.depth.max())
        for n, units_per_m in enumerate(self._candidates):
            if round(farthest * units_per_m) > LARGEST:
                continue
            units = _units(frame.depth, units_per_m)
            if np.array_equal(units.astype(np.float32) / np.float32(units_per_m), frame.depth):
                # The next image is probably in the same unit.
                self._candidates = (units_per_m, *self._candidates[:n], *self._candidates[n + 1 :])
                return units, units_per_m
        return None

    def of(self, frame: Frame) -> tuple[NDArray[np.uint16], int]:
        """The same, rounded where no unit is exact. ValueError beyond the range."""
        found = self.exact(frame)
        if found is not None:
            return found
        assert frame.depth is not None
        farthest = float(frame.depth.max())
        for units_per_m in self._default:
            if round(farthest * units_per_m) <= LARGEST:
                self.rounded_m = max(self.rounded_m, 1 / units_per_m)
                return _units(frame.depth, units_per_m), units_per_m
        most = LARGEST / min(self._default)
        limited = f"16 bits are limited to {most:.2f} m; crop the depth or choose another layout"
        raise ValueError(f"depth: frame {frame.index} has {farthest:.2f} m, {limited}")


def _units(depth_m: NDArray[np.float32], units_per_m: int) -> NDArray[np.uint16]:
    return np.rint(depth_m.astype(np.float64) * units_per_m).astype(np.uint16)


NAME, RESERVE = ".frames.jsonl", ".reserve"
RESERVE_STEP = 1 << 20


class Journal:
    """A hidden file in the folder of a recording that is not finished. Beside it a file keeps disk space free, so that
    a recording that has filled the disk can still be finished: the index files are about as large as the journal. A
    continuation (`resume`) must agree with the `header`: layout, camera, objects; it goes on before the first entry
    that is not `whole`."""

    def __init__(
        self, folder: Path, header: dict[str, Any], resume: bool = False,
        whole: Callable[[dict[str, Any]], bool] = lambda _: True,
    ) -> None:  # fmt: skip
        self._path, self._reserve = folder / NAME, folder / RESERVE
        self.count, self.last = 0, None
        header = json.loads(json.dumps(header))
        if resume:
            self._continue(header, whole)
        self._file: TextIO = self._path.open("a" if resume else "w", encoding="utf-8")
        self._size = self._path.stat().st_size
        self._reserved = 0
        if not resume:
            self._line(header)
        self._keep_space()

    last: dict[str, Any] | None

    @staticmethod
    def is_in(folder: Path) -> bool:
        return (folder / NAME).is_file()

    def _continue(self, header: dict[str, Any], is_whole: Callable[[dict[str, Any]], bool]) -> None:
        lines, whole = 0, 0
        with self._path.open("rb") as file:
            for line in file:
                try:
                    entry = json.loads(line)
                except ValueError:
                    break
                # Cut while it was written.
                if not line.endswith(b"\n") or not isinstance(entry, dict) or (lines and not is_whole(entry)):
                    break
                if lines == 0 and entry != header:
                    changed = ", ".join(k for k in header if entry.get(k) != header[k]) or "its contents"
                    raise ValueError(
                        f"{self._path.parent}: expected the recording that was interrupted there, got another one "
                        f"(different: {changed}); choose another folder"
                    )
                self.last = entry if lines else None
                lines, whole = lines + 1, whole + len(line)
        if not lines:
            raise ValueError(f"{self._path}: the header is missing; remove the folder and start again")
        os.truncate(self._path, whole)
        self.count = lines - 1

    def add(self, entry: dict[str, Any]) -> None:
        self._line(entry)
        self.count, self.last = self.count + 1, entry
        self._keep_space()

    def entries(self) -> Iterator[dict[str, Any]]:
        with self._path.open(encoding="utf-8") as file:
            next(file)
            for line in file:
                yield json.loads(line)

    def free_reserve(self) -> None:
        self._reserve.unlink(missing_ok=True)

    def remove(self) -> None:
        self.close()
        self.free_reserve()
        self._path.unlink(missing_ok=True)

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._file.close()

    def _line(self, entry: dict[str, Any]) -> None:
        text = json.dumps(entry, allow_nan=False) + "\n"
        try:
            self._file.write(text)
            self._file.flush()
        except BaseException:  # a full disk, or Ctrl-C
            with contextlib.suppress(OSError):
                self._file.close()  # drops what could not be written
            with contextlib.suppress(OSError):
                os.truncate(self._path, self._size)
            self._file = self._path.open("a", encoding="utf-8")
            raise
        self._size += len(text.encode())

    def _keep_space(self) -> None:
        if 2 * self._size < self._reserved:
            return
        target = self._reserved + RESERVE_STEP
        with self._reserve.open("ab") as file:
            reserve(file, target)
        self._reserved = target
