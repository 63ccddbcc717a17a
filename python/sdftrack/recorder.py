# SPDX-License-Identifier: MIT
"""Write tracking results to disk: poses, trajectories, a video and a report, each complete or not at all."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from array import array
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sdftrack._internal.background import Background
from sdftrack._internal.closing import ClosedByWith
from sdftrack._internal.files import PART
from sdftrack._internal.text_files import reason_of
from sdftrack.io.out_folder import OutFolder, cannot_write
from sdftrack.io.report_file import BOP_HEADER, bop_row, number_or_none, object_entry, plain, tum_line
from sdftrack.io.video import VideoFile
from sdftrack.results import TrackResult
from sdftrack.viz.page import History, run_page

WAITING = 3  # frames that may wait to be drawn


class Recorder(ClosedByWith):
    """Write the files of ``sdftrack track`` from your own tracking loop.

    ``poses.csv`` (BOP results), ``trajectory_<k>.txt`` (TUM format of T_cam_obj) of frames with times,
    ``ground_truth_<k>.txt`` if ground truth is given, ``overlay.mp4``, ``report.json``, and ``report.html``, a page
    about how each object was followed, appear when the recorder is closed, even if the loop raises an exception, whose
    message is then ``stopped`` in ``report.json``. Until then they have temporary names; if the disk is full, none of
    them is left behind.
    Rows go to disk as they come, and the video is drawn and encoded by another thread, so that a recorder neither
    slows the loop nor grows; its errors are raised by the next `add`, or by `close`.

    Parameters
    ----------
    directory : path
        New or empty, unless `overwrite`. Only files with the names above are replaced.
    camera : Camera or RGBDCamera
        For the video; a frame's own camera takes precedence.
    shapes : SDF or list of SDF, optional
        For the video, which is omitted without them.
    video : bool
        Whether to write ``overlay.mp4``.
    overwrite : bool
        Whether `directory` may contain files.
    obj_ids, names : sequence, optional
        One per object; default: 1..M by position, and "object_<k>".
    meshes : list of Mesh or None, optional
        Drawn at the poses, see `draw`.
    scene_id : int
        For ``poses.csv``.
    settings : mapping, optional
        Copied to ``report.json`` unchanged (plain values).
    bop_name : str, optional
        Also write ``poses.csv`` under this name, as bop_toolkit requires: ``sdftrack_<dataset>-<split>.csv``.
    fps : float, optional
        Frame rate of the video; default: from the timestamps, else 30.
    live : bool
        Whether frames come from a camera: then the video omits frames for which there is no time. Otherwise `add`
        waits.

    Attributes
    ----------
    omitted : int
        Number of frames that the video does not have.

    Raises
    ------
    FileExistsError
        `directory` contains files and `overwrite` is false, it is a file, or another run is writing into it.
    OSError
        The disk is full or not writable; nothing is left behind.

    Examples
    --------
    >>> with st.Recorder("out", camera, sdf) as recorder:  # doctest: +SKIP
    ...     for frame in sequence:
    ...         recorder.add(frame, tracker.track(frame))
    """

    def __init__(
        self,
        directory: str | os.PathLike[str],
        camera: Any,
        shapes: Any = None,
        video: bool = True,
        overwrite: bool = False,
        *,
        obj_ids: Sequence[int] | None = None,
        names: Sequence[str] | None = None,
        meshes: Sequence[Any] | None = None,
        scene_id: int = 0,
        settings: Mapping[str, Any] | None = None,
        bop_name: str | None = None,
        fps: float | None = None,
        live: bool = False,
    ) -> None:
        self.directory = Path(directory)
        self._camera = camera
        self._shapes = (
            None if shapes is None else list(shapes) if isinstance(shapes, (list, tuple)) else [shapes]
        )
        self._obj_ids, self._names, self._meshes = obj_ids, names, meshes
        self._scene_id, self._bop_name = int(scene_id), bop_name
        self._settings = dict(settings or {})
        self._sections: dict[str, Any] = {}
        self._stopped = ""
        self._beside: list[str] = []
        self._closed = False
        self.omitted, self._live = 0, live
        self._folder = OutFolder(self.directory, overwrite)
        self._frames = Spool(self.directory / "frames")  # of report.json
        self._rows = Spool(self.directory / "poses.csv")
        self._rows.add(BOP_HEADER)
        self._seconds = array("f")
        self._histories: list[History] = []
        self._tracks: dict[str, Spool] = {}  # trajectories and ground truth by file name
        self._video = VideoFile(self.directory / "overlay.mp4", fps) if video and self._shapes else None
        self._drawing = None if self._video is None else Background(self._draw, WAITING, "video")

    def __repr__(self) -> str:
        return f"Recorder({str(self.directory)!r}, {self._frames.count} frames)"

    def add(
        self,
        frame: Any,
        result: TrackResult,
        im_id: int | None = None,
        truth: Mapping[int, ArrayLike] | None = None,
        shapes: Any = None,
    ) -> None:
        """Record one frame.

        Parameters
        ----------
        frame : Frame
        result : TrackResult
        im_id : int, optional
            Number of the image; default: the frame's index, else the number of frames so far.
        truth : {k: (4, 4)}, optional
            True T_cam_obj of the k-th object, where known.
        shapes : SDF or list of SDF, optional
            The shapes in this frame, if they change over time; drawn instead of the recorder's own.
        """
        if self._closed:
            raise ValueError("recorder: expected an open recorder, got a closed one; create a new one")
        index = getattr(frame, "index", None)
        im_id = int(im_id if im_id is not None else index if index is not None else self._frames.count)
        stamp = result.timestamp if result.timestamp is not None else getattr(frame, "timestamp", None)
        try:
            self._add_rows(result, im_id, stamp, truth or {})
            drawn = self._shapes if shapes is None else shapes
            if self._drawing is not None and not self._drawing.put(
                (frame, result, drawn, stamp), wait=not self._live
            ):
                self.omitted += 1
        except OSError as error:
            self._abandon()
            raise cannot_write(error, self.directory) from error

    def _add_rows(
        self, result: TrackResult, im_id: int, stamp: float | None, truth: Mapping[int, ArrayLike]
    ) -> None:
        objects = []
        for k in range(len(result.poses)):
            name = self._names[k] if self._names is not None else f"object_{k}"
            objects.append(object_entry(result, k, self._obj_id(k), name))
            if k == len(self._histories):
                self._histories.append(History(name))
            self._histories[k].add(result, k, im_id)
            track = None if stamp is None else self._track(f"trajectory_{k}.txt")
            if str(result.status[k]) in ("ok", "weak"):
                self._rows.add(bop_row(result, k, self._scene_id, im_id, self._obj_id(k)))
                if track is not None and stamp is not None:
                    track.add(tum_line(float(stamp), result.poses[k], ".9f"))
        for k, T in truth.items():
            if stamp is None:
                break
            self._track(f"ground_truth_{int(k)}.txt").add(tum_line(stamp, np.asarray(T, np.float64), ".9f"))
        entry = {
            "im_id": im_id,
            "timestamp": number_or_none(stamp),
            "seconds": number_or_none(result.seconds),
            "objects": objects,
        }
        self._frames.add(json.dumps(entry, allow_nan=False))
        self._seconds.append(float(result.seconds))

    def _track(self, name: str) -> Spool:
        if name not in self._tracks:
            self._tracks[name] = Spool(self.directory / name)
        return self._tracks[name]

    def _draw(self, item: tuple[Any, TrackResult, Any, float | None]) -> None:
        from sdftrack.viz import draw

        frame, result, shapes, stamp = item
        assert self._video is not None
        self._video.add(draw(frame, result, shapes, self._camera, self._meshes, names=self._names), stamp)

    def note(self, section: str, values: Mapping[str, Any]) -> None:
        """Add a section of plain values to ``report.json``, in addition to its settings and frames."""
        if section in ("version", "settings", "stopped", "frames"):
            raise ValueError(
                f"section: expected a new section name, got {section!r}, which the report already uses"
            )
        self._sections[section] = plain(values)

    def wrote(self, *names: str) -> None:
        """Register files that the caller wrote into the folder; the report lists them, so they may be replaced."""
        self._beside += [name for name in names if name not in self._beside]

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close; of a loop that was left by an exception, the report says by which."""
        if error is not None:
            self._stopped = reason_of(error)
        self.close()

    def close(self) -> None:
        """Finish the files and give them their names. Calling it again does nothing."""
        if self._closed:
            return
        try:
            written = self._write_parts()
        except OSError as error:
            self._abandon()
            raise cannot_write(error, self.directory) from error
        except BaseException:
            self._abandon()
            raise
        self._closed = True
        try:
            for name in written:
                os.replace(self._part(name), self.directory / name)
            for name in self._folder.stale - set(written) - set(self._beside):
                (self.directory / name).unlink(missing_ok=True)
        finally:
            self._folder.release()

    def _write_parts(self) -> list[str]:
        """All files under their temporary names, so that the renames come together at the end."""
        names = ["poses.csv", *sorted(self._tracks)]
        for spool in (self._rows, *self._tracks.values()):
            spool.finish()
        if self._bop_name:
            shutil.copyfile(self._rows.part, self._part(self._bop_name))
            names.insert(1, self._bop_name)
        if self._drawing is not None and self._video is not None:
            self._drawing.close()
            if self._video.finish():
                names.append("overlay.mp4")
        names += ["report.html", "report.json"]
        self._write_page("overlay.mp4" if "overlay.mp4" in names else "")
        self._write_report(names)
        return names

    def _write_page(self, video: str) -> None:
        title = Path(str(self._settings.get("sequence", self.directory))).name
        seconds = np.array(self._seconds)
        milliseconds = 1e3 * float(np.median(seconds[np.isfinite(seconds)])) if len(seconds) else 0.0
        page = Spool(self.directory / "report.html")
        page.add(run_page(title, self._histories, len(seconds), milliseconds, video))
        page.finish()

    def _write_report(self, names: list[str]) -> None:
        from sdftrack import __version__

        head = {
            "version": __version__,
            "settings": {**plain(self._settings), "files": names + self._beside},
            **({"stopped": self._stopped} if self._stopped else {}),
            **self._sections,
        }
        report = Spool(self.directory / "report.json")
        report.add(json.dumps(head, indent=1, allow_nan=False).removesuffix("\n}") + ',\n "frames": [')
        for n, line in enumerate(self._frames.lines(), 1):
            report.add(f"  {line}{',' if n < self._frames.count else ''}")
        report.add(" ]\n}")
        report.finish()
        self._frames.drop()

    def _part(self, name: str) -> Path:
        return self.directory / f".{name}{PART}"

    def _abandon(self) -> None:
        self._closed = True
        if self._drawing is not None:
            with contextlib.suppress(Exception):  # the first error is the one that is reported
                self._drawing.close()
        if self._video is not None:
            self._video.drop()
        for spool in (self._frames, self._rows, *self._tracks.values()):
            with contextlib.suppress(OSError):
                spool.drop()
        for part in self.directory.glob(f".*{PART}"):
            part.unlink(missing_ok=True)
        self._folder.release()

    def _obj_id(self, k: int) -> int:
        return int(self._obj_ids[k]) if self._obj_ids is not None else k + 1


class Spool:
    """A text file under a temporary name beside `path`."""

    def __init__(self, path: Path) -> None:
        self.part = path.with_name(f".{path.name}{PART}")
        self.count = 0
        self._file = self.part.open("w+", encoding="utf-8")

    def add(self, line: str) -> None:
        self._file.write(line + "\n")
        self.count += 1

    def lines(self) -> Iterator[str]:
        """The lines so far, without their ends."""
        self._file.flush()
        with self.part.open(encoding="utf-8") as file:
            for line in file:
                yield line.rstrip("\n")

    def finish(self) -> None:
        """Close the file. OSError where the disk is full, before anything has been renamed."""
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()

    def drop(self) -> None:
        try:
            self._file.close()
        finally:
            self.part.unlink(missing_ok=True)
