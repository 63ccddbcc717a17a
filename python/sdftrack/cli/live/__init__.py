# SPDX-License-Identifier: MIT
"""The options of ``sdftrack live``, what they exclude, and a run from the camera to the last line."""

from __future__ import annotations

import contextlib
import functools
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

import sdftrack as st
from sdftrack.cli.common import (
    ALL_LOST,
    Common,
    Meshes,
    Sensor,
    above_zero,
    contour_settings,
    reconstructor_settings,
    refuse_cuda,
    tracker_settings,
)
from sdftrack.cli.init import Init, parse_init, parse_inits, place_of
from sdftrack.cli.options import Usage, option
from sdftrack.cli.sources import CameraSize, is_webcam

if TYPE_CHECKING:
    from sdftrack.cli.live.followers import Follower

__all__ = ["Live", "live"]

WAITING = 2  # frames of a camera; more would be older when they are used
INIT = "auto|view|poses.json|mask.png|box:x,y,w,h|click:x,y"


@dataclass(frozen=True, kw_only=True)
class Live(CameraSize, Meshes, Sensor, Common):
    """Follow known shapes (--model), an unknown one (--reconstruct) or an outline (--contour) in front of a camera.

    A page in the browser shows the poses; a click on an object, or a box around it, starts it again. With --out the
    files of ``track`` (of ``contour`` with --contour) are written, and recordings that are started on the page. End
    with Ctrl-C; the exit code is 3 where an object was lost in all frames.
    """

    # Named as the arguments of `open_camera`, whose advice about them thus names the options.
    address: str = option(
        "realsense:",
        "realsense:, realsense:SERIAL, replay:RECORDING, or webcam:0 for --contour and --mode rgb.",
        "--camera",
        metavar="CAMERA",
    )
    camera: Path | None = option(
        None, "Intrinsics of a webcam; other cameras know theirs.", "--intrinsics", metavar="CAMERA.json"
    )
    model: tuple[Path, ...] = option((), "Mesh; repeat for several objects.", metavar="M.ply")
    reconstruct: bool = option(False, "Reconstruct an unknown object instead.")
    contour: bool = option(False, "Follow an outline in the colour images instead.")
    init: tuple[str, ...] = option(
        (),
        "Location of the objects in the first image: automatic search (default); shown in the browser "
        "(default of --reconstruct and --contour); a file; a mask, box or click in the depth image, repeated for "
        "every --model. --contour: a mask or box in the colour image; --mode rgb: poses.json.",
        metavar=INIT,
    )
    viewer: bool = option(True, "Show a page in the browser.", "--viewer/--no-viewer")
    host: str = option(
        "localhost", "Address of the page; others than localhost can be reached from the network."
    )
    port: int = option(8080, "Port of the page; 0: any.", min=0, max=65535)
    stream: tuple[str, ...] = option(
        (),
        "Send the poses to other programs; repeatable.",
        metavar="ws://HOST:PORT|osc://HOST:PORT|mcap:FILE|foxglove://HOST:PORT",
    )
    seconds: float | None = option(
        None, "Stop after this time; default: Ctrl-C.", check=above_zero("a time in seconds")
    )
    motion: bool = option(False, "Speed, path and repetitions so far, on the page and in ws:// streams.")
    loop: bool = option(False, "Play a recording, --camera replay:..., again and again.")
    mode: Literal["auto", "depth", "rgbd", "rgb"] = option(
        "auto", "Depth only, with colour if available, or colour alone."
    )
    no_video: bool = option(False, "Do not write overlay.mp4.")

    @property
    def by_color(self) -> bool:
        return not self.contour and (self.mode == "rgb" or is_webcam(self.address))

    @property
    def replays(self) -> bool:
        return self.address.partition(":")[0] == "replay"

    def check(self) -> None:
        if bool(self.model) + self.reconstruct + self.contour != 1:
            raise Usage("expected either --model M.ply (repeatable), --reconstruct or --contour", "--model")
        if self.contour and self.mode != "auto":
            alone = "--contour, which follows colours alone"
            raise Usage(f"expected no --mode with {alone}, got {self.mode}", "--mode")
        if self.reconstruct and self.mode == "rgb":
            raise Usage("expected auto, depth or rgbd: a reconstruction needs depth, got rgb", "--mode")
        webcam = is_webcam(self.address)
        if webcam and self.reconstruct:
            no_depth = "a shape cannot be reconstructed from colour alone"
            raise Usage(f"expected a camera with depth, got a webcam: {no_depth}", "--reconstruct")
        if webcam and self.mode not in ("auto", "rgb"):
            needs = f"a webcam has colour alone, and mode {self.mode} needs depth"
            raise Usage(f"expected rgb: {needs}", "--mode")
        if not webcam and self.camera is not None:
            own = "other cameras know their intrinsics"
            raise Usage(f"expected --camera webcam:... with it: {own}", "--intrinsics")
        if self.loop and not self.replays:
            raise Usage("expected --camera replay:RECORDING with it", "--loop")
        self.inits()
        if not self.model:
            refuse_cuda(self.device)
        if self.contour and self.stream:
            raise Usage("expected none with --contour: an outline has no pose to send", "--stream")

    def inits(self) -> list[Init] | None:
        """How it starts; None: shown by the user on the page."""
        if self.by_color:
            inits = [parse_init(text, INIT) for text in self.init if text != "view"]
            if len(inits) != 1 or inits[0].kind != "poses":
                no_search = "--init poses.json: without depth there is no search for an object"
                got = " ".join(self.init or ["none"])
                raise Usage(f"expected a file of start poses, {no_search}, got {got}", "--init")
            return inits
        texts = list(self.init) or (["auto"] if self.model else ["view"])
        got = " ".join(texts)
        if texts == ["view"]:
            if not self.viewer:
                nobody = "without a page nobody can show the object"
                raise Usage(f"expected box:x,y,w,h, or a mask.png: {nobody}", "--init")
            return None
        if not self.model:
            what, image = ("--contour", "colour") if self.contour else ("--reconstruct", "depth")
            inits = [parse_init(text, INIT, image=image) for text in texts]
            if len(inits) != 1 or inits[0].kind not in ("box", "mask"):
                raise Usage(f"expected view, box:x,y,w,h or mask.png with {what}, got {got}", "--init")
            return inits
        if "gt" in texts or "view" in texts:
            raise Usage(f"expected {INIT.replace('|', ', ')}, got {got}", "--init")
        return parse_inits(texts, len(self.model))


def live(job: Live) -> None:
    job.check()
    from sdftrack.cli.live.run import LiveFiles, Run
    from sdftrack.live.streams import open_stream

    settings = _settings(job)
    with contextlib.ExitStack() as stack:
        source = stack.enter_context(_camera(job))
        follower, shapes = _follower(job, source, settings)
        source = follower.frames_of(source)
        new_recorder = _recorder(job, source, follower, shapes)
        page = None
        if job.viewer:
            page = stack.enter_context(_page(shapes, source.camera, follower.names, job.host, job.port))
        streams = [stack.enter_context(open_stream(s, follower.names, source.camera)) for s in job.stream]
        if not job.quiet:
            _tell_start(source, page, streams)
        files = LiveFiles(job.out, source.camera)
        run = Run(source, follower, page, streams, new_recorder, files, job.quiet, job.motion)
        began = time.monotonic()
        with contextlib.suppress(KeyboardInterrupt):  # the usual end
            run.run(job.seconds)
        if not job.quiet:
            run.tell(time.monotonic() - began)
    if run.lost:
        print(f"sdftrack: lost in all frames: {', '.join(run.lost)}", file=sys.stderr)
        raise typer.Exit(ALL_LOST)


def _page(shapes: list[Any], camera: Any, names: list[str], host: str, port: int) -> Any:
    from sdftrack.viz.viewer import Viewer

    return Viewer(shapes, camera, names, host=host, port=port)


def _tell_start(source: Any, page: Any, streams: list[Any]) -> None:
    print(f"camera: {source.name}", file=sys.stderr)
    for what in (page, *streams):
        if what is not None and what.note:
            print(what.note, file=sys.stderr)
    if page is not None:
        print(f"open {page.url} in a browser; end with Ctrl-C", file=sys.stderr)
    for one in streams:
        print(f"stream: {one.address}", file=sys.stderr)
    sys.stderr.flush()


def _settings(job: Live) -> dict[str, Any]:
    if job.contour:
        return contour_settings(job.config, alone=True)
    return reconstructor_settings(job.config) if job.reconstruct else tracker_settings(job.config, job.sensor)


def _camera(job: Live) -> Any:
    with warnings.catch_warnings():
        if job.contour:  # an outline needs no intrinsics, so that guessed ones are as good
            warnings.filterwarnings("ignore", "webcam .*: its intrinsics are not known", UserWarning)
        enough = job.contour or job.by_color
        # A recording waits for the user to show the object, as the scene before a camera does.
        more = {"loop": job.loop, "hold": job.inits() is None} if job.replays else {}
        return job.opened(job.address, WAITING, color_alone=enough, camera=job.camera, **more)


def _follower(job: Live, source: Any, settings: dict[str, Any]) -> tuple[Follower, list[Any]]:
    """The follower of what a camera shows, and the shapes that the page shows."""
    from sdftrack.cli.live import followers
    from sdftrack.cli.objects import load_targets

    inits, camera = job.inits(), source.camera
    one = None if inits is None else inits[0]
    unseen = [st.SDF.sphere(0.01, voxels=16)]  # for a page whose object has no shape yet
    if job.contour:
        return followers.OutlineFollower(st.contour.ContourTracker(**settings), one), unseen
    if job.reconstruct:
        star = st.Reconstructor(camera, voxels=job.voxels, mode=job.mode, threads=job.threads, **settings)
        where = None if one is None else place_of(one, camera.depth.shape)
        return followers.ReconstructorFollower(star, where), unseen
    targets = load_targets(job.model, followers.unknown_sequence(camera), job.unit, job.voxels)
    shapes, names = [t.sdf for t in targets], [t.name for t in targets]
    settings |= {"device": job.device, "threads": job.threads, "names": names}
    tracker = st.Tracker(shapes, camera, mode="rgb" if job.by_color else job.mode, **settings)
    return followers.TrackerFollower(tracker, targets, inits), shapes


def _recorder(job: Live, source: Any, follower: Any, shapes: list[Any]) -> Callable[[], Any] | None:
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
    from sdftrack.cli.contour import ContourFiles, refuse_places
    from sdftrack.cli.live.followers import OutlineFiles

    inits = job.inits() or []
    refuse_places(out, [("--init", Path(one.text)) for one in inits if one.kind == "mask"])
    settings = {"source": job.address, "init": [one.text for one in inits], **follower.options}
    video = not job.no_video
    return lambda: OutlineFiles(ContourFiles(out, job.overwrite, None, None, settings, video), follower)
