# SPDX-License-Identifier: MIT
"""The parts of a run of `sdftrack live`: the camera, what follows the object, and the files."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sdftrack.cli.common import contour_settings, reconstructor_settings, tracker_settings
from sdftrack.cli.init import box_inside, mask_file
from sdftrack.cli.live_camera import open_from
from sdftrack.cli.live_usage import Task

__all__ = ["camera_of", "follower_of", "recorder_of", "settings_of"]

WAITING = 2  # frames of a camera; more would be older when they are used


def settings_of(task: Task, config: Path | None, sensor: str | None) -> dict[str, Any]:
    """Keyword arguments for what follows the object, from --config and --sensor."""
    if task.contour:
        return contour_settings(config, alone=True)
    return reconstructor_settings(config) if task.reconstruct else tracker_settings(config, sensor)


def camera_of(
    task: Task,
    address: str,
    width: int | None,
    height: int | None,
    fps: float | None,
    intrinsics: Path | None,
) -> Any:
    """The camera, open."""
    with warnings.catch_warnings():
        if task.contour:  # an outline needs no intrinsics, so that guessed ones are as good
            warnings.filterwarnings("ignore", "webcam .*: its intrinsics are not known", UserWarning)
        enough = task.contour or task.mode == "rgb"
        return open_from(address, width, height, fps, WAITING, color_alone=enough, camera=intrinsics)


def follower_of(
    task: Task, camera: Any, options: dict[str, Any], settings: dict[str, Any]
) -> tuple[Any, list[Any]]:
    """The follower, and the shapes that the page shows.

    `options`: unit, voxels, device and threads; `settings`: see `settings_of`.
    """
    if task.contour:
        return _outline(task, settings)
    if task.reconstruct:
        return _reconstructor(task, camera, options, settings)
    return _tracker(task, camera, options, settings)


def _tracker(
    task: Task, camera: Any, options: dict[str, Any], settings: dict[str, Any]
) -> tuple[Any, list[Any]]:
    import sdftrack as st
    from sdftrack.cli.live_followers import TrackerFollower, unknown_sequence
    from sdftrack.cli.targets import load_targets

    targets = load_targets(task.models, unknown_sequence(camera), options["unit"], options["voxels"])
    shapes = [t.sdf for t in targets]
    where = {"device": options["device"], "threads": options["threads"]}
    tracker = st.Tracker(
        shapes, camera, mode=task.mode, names=[t.name for t in targets], **{**settings, **where}
    )
    return TrackerFollower(tracker, targets, task.inits), shapes


def _reconstructor(
    task: Task, camera: Any, options: dict[str, Any], settings: dict[str, Any]
) -> tuple[Any, list[Any]]:
    import sdftrack as st
    from sdftrack.cli.live_followers import ReconstructorFollower

    star = st.Reconstructor(
        camera, voxels=options["voxels"], mode=task.mode, threads=options["threads"], **settings
    )
    where: dict[str, Any] | None = None
    if task.inits is not None:
        shape = camera.depth.shape
        one = task.inits[0]
        where = {"box": box_inside(one, shape)} if one.kind == "box" else {"mask": mask_file(one, shape)}
    return ReconstructorFollower(star, where), [_unseen()]


def _outline(task: Task, settings: dict[str, Any]) -> tuple[Any, list[Any]]:
    import sdftrack as st
    from sdftrack.cli.live_outline import OutlineFollower

    tracker = st.contour.ContourTracker(**settings)
    return OutlineFollower(tracker, None if task.inits is None else task.inits[0]), [_unseen()]


def _unseen() -> Any:
    """A shape for a page whose object has none yet."""
    import sdftrack as st

    return st.SDF.sphere(0.01, voxels=16)


def recorder_of(
    task: Task,
    out: Path,
    overwrite: bool,
    source: Any,
    follower: Any,
    shapes: list[Any],
    video: bool,
    address: str,
) -> Callable[[], Any]:
    """A function that makes the recorder; a folder that cannot be written into is refused here."""
    import sdftrack as st
    from sdftrack.io.out_folder import refuse_folder

    refuse_folder(out, overwrite)
    if task.contour:
        return _outline_files(task, out, overwrite, follower, video, address)
    settings = {"command": "live", "camera": address, "name": source.name}
    return functools.partial(
        st.Recorder, out, source.camera, shapes, video, overwrite, names=follower.names, settings=settings, live=True
    )  # fmt: skip


def _outline_files(
    task: Task, out: Path, overwrite: bool, follower: Any, video: bool, address: str
) -> Callable[[], Any]:
    from sdftrack.cli.contour_files import ContourFiles, refuse_places
    from sdftrack.cli.live_outline import OutlineFiles

    inits = task.inits or []
    refuse_places(out, [("--init", Path(one.text)) for one in inits if one.kind == "mask"])
    settings = {"source": address, "init": [one.text for one in inits], **follower.options}
    return lambda: OutlineFiles(ContourFiles(out, overwrite, None, None, settings, video), follower)
