# SPDX-License-Identifier: MIT
"""The parts of a run of `sdftrack live`: the camera, what follows the object, and the files."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdftrack.cli.common import contour_settings, reconstructor_settings, tracker_settings
from sdftrack.cli.init import box_inside, mask_file

if TYPE_CHECKING:
    from sdftrack.cli.live.command import Live
    from sdftrack.cli.live.followers import Follower

__all__ = ["camera_of", "follower_of", "recorder_of", "settings_of"]

WAITING = 2  # frames of a camera; more would be older when they are used


def settings_of(job: Live) -> dict[str, Any]:
    """Keyword arguments for what follows the object, from --config and --sensor."""
    if job.contour:
        return contour_settings(job.config, alone=True)
    return reconstructor_settings(job.config) if job.reconstruct else tracker_settings(job.config, job.sensor)


def camera_of(job: Live) -> Any:
    """The camera, open."""
    with warnings.catch_warnings():
        if job.contour:  # an outline needs no intrinsics, so that guessed ones are as good
            warnings.filterwarnings("ignore", "webcam .*: its intrinsics are not known", UserWarning)
        enough = job.contour or job.by_color
        return job.opened(job.address, WAITING, color_alone=enough, camera=job.camera)


def follower_of(job: Live, source: Any, settings: dict[str, Any]) -> tuple[Follower, list[Any]]:
    """The follower of what a camera shows, and the shapes that the page shows; `settings`: see `settings_of`."""
    import sdftrack as st
    from sdftrack.cli.live.followers import ReconstructorFollower, TrackerFollower, unknown_sequence
    from sdftrack.cli.live.outline import OutlineFollower
    from sdftrack.cli.objects import load_targets

    inits, camera = job.inits(), source.camera
    one = None if inits is None else inits[0]
    unseen = [st.SDF.sphere(0.01, voxels=16)]  # for a page whose object has no shape yet
    if job.contour:
        return OutlineFollower(st.contour.ContourTracker(**settings), one), unseen
    if job.reconstruct:
        star = st.Reconstructor(camera, voxels=job.voxels, mode=job.mode, threads=job.threads, **settings)
        where: dict[str, Any] | None = None
        if one is not None:
            shape = camera.depth.shape
            where = {"box": box_inside(one, shape)} if one.kind == "box" else {"mask": mask_file(one, shape)}
        return ReconstructorFollower(star, where), unseen
    targets = load_targets(job.model, unknown_sequence(camera), job.unit, job.voxels)
    shapes = [t.sdf for t in targets]
    mode = "rgb" if job.by_color else job.mode
    names = [t.name for t in targets]
    where = {"device": job.device, "threads": job.threads}
    tracker = st.Tracker(shapes, camera, mode=mode, names=names, **{**settings, **where})
    return TrackerFollower(tracker, targets, inits), shapes


def recorder_of(job: Live, source: Any, follower: Any, shapes: list[Any]) -> Callable[[], Any] | None:
    """A function that makes the recorder; a folder that cannot be written into is refused here."""
    import sdftrack as st
    from sdftrack.io.out_folder import refuse_folder

    if job.out is None:
        return None
    refuse_folder(job.out, job.overwrite)
    if job.contour:
        return _outline_files(job, job.out, follower)
    settings = {"command": "live", "camera": job.address, "name": source.name}
    about = {"names": follower.names, "settings": settings, "live": True}
    return functools.partial(
        st.Recorder, job.out, source.camera, shapes, not job.no_video, job.overwrite, **about
    )


def _outline_files(job: Live, out: Path, follower: Any) -> Callable[[], Any]:
    from sdftrack.cli.contour_files import ContourFiles, refuse_places
    from sdftrack.cli.live.outline import OutlineFiles

    inits = job.inits() or []
    refuse_places(out, [("--init", Path(one.text)) for one in inits if one.kind == "mask"])
    settings = {"source": job.address, "init": [one.text for one in inits], **follower.options}
    video = not job.no_video
    return lambda: OutlineFiles(ContourFiles(out, job.overwrite, None, None, settings, video), follower)
