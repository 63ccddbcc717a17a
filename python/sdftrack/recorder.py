# SPDX-License-Identifier: MIT
"""Tracking results on disk: poses, trajectories, a video and a report, each whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack.io.video import PART, VideoFile
from sdftrack.results import TrackResult

__all__ = ["Recorder"]

BOP_HEADER = "scene_id,im_id,obj_id,score,R,t,time"
Array = NDArray[np.float64]


class Recorder:
    """Write the files of ``sdftrack track`` from a loop of one's own.

    ``poses.csv`` (BOP results), ``trajectory_<k>.txt`` (TUM format of T_cam_obj), ``ground_truth_<k>.txt``
    where the truth is given, ``overlay.mp4`` and ``report.json`` appear when the recorder is closed, also if
    the loop raises. Until then they carry temporary names; a disk that is full leaves none of them.

    Parameters
    ----------
    directory : path
        New or empty, unless `overwrite`. Only files of the names above are ever replaced.
    camera : Camera or RGBDCamera
        For the video; a frame's own camera goes first.
    shapes : SDF or list of SDF, optional
        For the video, which is left out without them.
    video : bool
        Whether to write ``overlay.mp4``.
    overwrite : bool
        Whether `directory` may hold files.
    obj_ids, names : sequence, optional
        Per object; by default all 1..M by position, and "object_<k>".
    meshes : list of Mesh or None, optional
        Drawn at the poses, see `draw`.
    scene_id : int
        For ``poses.csv``.
    settings : mapping, optional
        Goes into ``report.json`` as it is (plain values).
    bop_name : str, optional
        Also write ``poses.csv`` under this name, as bop_toolkit wants it: ``sdftrack_<dataset>-<split>.csv``.
    fps : float, optional
        Of the video; by default from the timestamps, else 30.

    Raises
    ------
    FileExistsError
        `directory` holds files and `overwrite` is false, or it is a file.
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
    ) -> None:
        self.directory = Path(directory)
        self._stale = prepare_folder(self.directory, overwrite)
        self._camera = camera
        self._shapes = (
            None if shapes is None else list(shapes) if isinstance(shapes, (list, tuple)) else [shapes]
        )
        self._obj_ids, self._names, self._meshes = obj_ids, names, meshes
        self._scene_id, self._bop_name = int(scene_id), bop_name
        self._settings = dict(settings or {})
        self._sections: dict[str, Any] = {}
        self._beside: list[str] = []
        self._rows: list[str] = []
        self._frames: list[dict[str, Any]] = []
        self._trajectories: dict[int, list[str]] = {}
        self._truths: dict[int, list[str]] = {}
        self._video = VideoFile(self.directory / "overlay.mp4", fps) if video and self._shapes else None
        self._closed = False

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Recorder({str(self.directory)!r}, {len(self._frames)} frames)"

    def add(
        self,
        frame: Any,
        result: TrackResult,
        im_id: int | None = None,
        truth: Mapping[int, ArrayLike] | None = None,
        shapes: Any = None,
    ) -> NDArray[np.uint8] | None:
        """Record one frame.

        Parameters
        ----------
        frame : Frame
        result : TrackResult
        im_id : int, optional
            Number of the image; by default the frame's index, else the count of frames.
        truth : {k: (4, 4)}, optional
            True T_cam_obj of the k-th object, where known.
        shapes : SDF or list of SDF, optional
            As they are in this frame, where they grow: drawn in place of the recorder's own.

        Returns
        -------
        The picture that went into the video, or None.
        """
        if self._closed:
            raise ValueError("recorder: expected an open one, got one that is closed; make another")
        index = getattr(frame, "index", None)
        im_id = int(im_id if im_id is not None else index if index is not None else len(self._frames))
        stamp = result.timestamp if result.timestamp is not None else getattr(frame, "timestamp", None)
        time = float(stamp) if stamp is not None else float(im_id)
        objects = []
        for k in range(len(result.poses)):
            objects.append(self._object(result, k))
            if str(result.status[k]) in ("ok", "weak"):
                self._rows.append(self._bop_row(result, k, im_id))
                self._trajectories.setdefault(k, []).append(tum_row(time, result.poses[k]))
            else:
                self._trajectories.setdefault(k, [])
        for k, T in (truth or {}).items():
            self._truths.setdefault(int(k), []).append(tum_row(time, np.asarray(T, np.float64)))
        self._frames.append(
            {
                "im_id": im_id,
                "timestamp": _number(stamp),
                "seconds": _number(result.seconds),
                "objects": objects,
            }
        )
        if self._video is None:
            return None
        from sdftrack.viz import draw

        drawn = self._shapes if shapes is None else shapes
        picture = draw(frame, result, drawn, self._camera, self._meshes, names=self._names)
        try:
            self._video.add(picture, stamp)
        except OSError as error:
            self._abandon()
            raise _clear(error, self.directory) from error
        return picture

    def note(self, section: str, values: Mapping[str, Any]) -> None:
        """Add a section of plain values to ``report.json``, beside its settings and frames."""
        if section in ("version", "settings", "frames"):
            raise ValueError(f"section: expected a name of one's own, got {section!r}, which the report has")
        self._sections[section] = plain(values)

    def wrote(self, *names: str) -> None:
        """Files that the caller has put into the folder: the report lists them, so that they can be replaced."""
        self._beside += [name for name in names if name not in self._beside]

    def close(self) -> None:
        """Finish the files and give them their names. Calling it again does nothing."""
        if self._closed:
            return
        try:
            written = self._write_parts()
        except OSError as error:
            self._abandon()
            raise _clear(error, self.directory) from error
        except BaseException:
            self._abandon()
            raise
        self._closed = True
        for name in written:
            os.replace(self._part(name), self.directory / name)
        for name in self._stale - set(written) - set(self._beside):
            (self.directory / name).unlink(missing_ok=True)

    def _write_parts(self) -> list[str]:
        """All files under their temporary names, so that the renames come together at the end."""
        poses = "\n".join([BOP_HEADER, *self._rows]) + "\n"
        texts = {"poses.csv": poses}
        if self._bop_name:
            texts[self._bop_name] = poses
        for k, lines in sorted(self._trajectories.items()):
            texts[f"trajectory_{k}.txt"] = "".join(line + "\n" for line in lines)
        for k, lines in sorted(self._truths.items()):
            texts[f"ground_truth_{k}.txt"] = "".join(line + "\n" for line in lines)
        names = list(texts)
        if self._video is not None and self._video.finish():
            names.append("overlay.mp4")
        names.append("report.json")
        from sdftrack import __version__

        report = {
            "version": __version__,
            "settings": {**plain(self._settings), "files": names + self._beside},
            **self._sections,
            "frames": self._frames,
        }
        texts["report.json"] = json.dumps(report, indent=1, allow_nan=False) + "\n"
        for name, text in texts.items():
            with open(self._part(name), "w", encoding="utf-8") as f:
                f.write(text)
                f.flush()
                os.fsync(f.fileno())  # a full disk shows here, before anything has been renamed
        return names

    def _part(self, name: str) -> Path:
        return self.directory / f".{name}{PART}"

    def _abandon(self) -> None:
        self._closed = True
        if self._video is not None:
            self._video.drop()
        for part in self.directory.glob(f".*{PART}"):
            part.unlink(missing_ok=True)

    def _obj_id(self, k: int) -> int:
        return int(self._obj_ids[k]) if self._obj_ids is not None else k + 1

    def _bop_row(self, result: TrackResult, k: int, im_id: int) -> str:
        T = result.poses[k]
        R = " ".join(f"{v:.9f}" for v in T[:3, :3].ravel())
        t = " ".join(f"{1e3 * v:.6f}" for v in T[:3, 3])
        score = _number(result.confidence[k]) or 0.0
        seconds = _number(result.seconds)
        time = "-1" if seconds is None else f"{seconds:.6f}"
        return f"{self._scene_id},{im_id},{self._obj_id(k)},{score:.6f},{R},{t},{time}"

    def _object(self, result: TrackResult, k: int) -> dict[str, Any]:
        return {
            "obj_id": self._obj_id(k),
            "k": k,
            "name": self._names[k] if self._names is not None else f"object_{k}",
            "status": str(result.status[k]),
            "reason": str(result.reason[k]),
            "confidence": _number(result.confidence[k]),
            "energy": _number(result.energy),
            "inliers": _number(result.inliers[k]),
            "pose": plain(result.poses[k]) if np.isfinite(result.poses[k]).all() else None,
            "covariance": plain(result.covariances[k]) if np.isfinite(result.covariances[k]).all() else None,
        }


def refuse_folder(directory: Path, overwrite: bool) -> None:
    """The errors of `prepare_folder` before the work, and nothing made where there would be none."""
    if directory.exists() and not (directory.is_dir() and not any(directory.iterdir())):
        prepare_folder(directory, overwrite)


def prepare_folder(directory: Path, overwrite: bool) -> set[str]:
    """Make the folder; refuse one that holds files unless `overwrite`. Returns the names an earlier run wrote
    there."""
    if directory.exists() and not directory.is_dir():
        raise FileExistsError(f"out: expected a folder, got the file {directory}")
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(error.errno, f"out: cannot make the folder {directory}: {error.strerror}") from None
    for part in directory.glob(f".*{PART}"):  # left by a run that was killed
        part.unlink(missing_ok=True)
    if not any(directory.iterdir()):
        return set()
    if not overwrite:
        raise FileExistsError(
            f"out: expected a new or empty folder, got {directory} with files in it; "
            "choose another, or overwrite=True"
        )
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
        old = json.loads((directory / "report.json").read_text(encoding="utf-8"))["settings"]["files"]
        return {str(name) for name in old if Path(str(name)).name == str(name)}
    return set()


def tum_row(time: float, T: Array) -> str:
    """``timestamp tx ty tz qx qy qz qw``, metres."""
    q = quaternion(T[:3, :3])
    return f"{time:.6f} " + " ".join(f"{v:.9f}" for v in (*T[:3, 3], *q))


def quaternion(R: Array) -> Array:
    """(qx, qy, qz, qw) of a rotation, qw >= 0 (Bar-Itzhack: the dominant eigenvector, good for any angle)."""
    K = np.array(
        [
            [R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
            [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
            [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0],
            [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R[0, 0] + R[1, 1] + R[2, 2]],
        ]
    )
    q: Array = np.linalg.eigh(K)[1][:, -1]  # reads the lower triangle
    return q if q[3] >= 0 else -q


def plain(value: Any) -> Any:
    """Numpy, paths and NaN as JSON can hold them."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, set)):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int, str)) else str(value)


def _number(value: Any) -> float | None:
    return float(value) if value is not None and np.isfinite(value) else None


def _clear(error: OSError, directory: Path) -> OSError:
    if error.errno == errno.ENOSPC or "no space left" in str(error).lower():
        return OSError(
            errno.ENOSPC, f"out: no space left on the disk of {directory}; free some or choose another folder"
        )
    return OSError(error.errno or errno.EIO, f"out: cannot write into {directory}: {error.strerror or error}")
