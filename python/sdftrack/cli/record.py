# SPDX-License-Identifier: MIT
"""``sdftrack record`` and ``convert``: the frames of a camera, or of a recording in another layout, in a folder that
can be continued."""

from __future__ import annotations

import itertools
import math
import re
import sys
import time
import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, NamedTuple

import sdftrack as st
from sdftrack._internal.files import PART_PREFIX, write_json
from sdftrack.cli.common import Common, above_zero
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.progress import progress
from sdftrack.cli.sources import CameraSize, Frames, Layout

WAITING = 60  # frames that may wait for the disk: 2 s


NAME = "recording.json"  # says that the files are ours
OURS = re.compile(
    r"recording\.json|exercise\.json|\.frames\.jsonl|\.reserve|scene_(camera|gt)\.json|camera\.json|intrinsic\.json|trajectory\.log|"
    r"(depth|rgb|groundtruth)\.txt|model\.ply|models/obj_\d{6}\.ply|mask_visib/\d{6}_\d{6}\.png|\.?sequence\.mcap|metadata\.yaml|"
    r"(depth|rgb|color)/[\d.-]+\.(png|jpg)|color(_\d{6,})?\.mkv|\.obj_\d{6}\.ply"
)


def _known_layout(value: str) -> str:
    from sdftrack.io.writers import WRITERS

    if value not in WRITERS:
        raise Usage(f"expected one of {', '.join(WRITERS)}, got {value!r}")
    return value


@dataclass(frozen=True, kw_only=True)
class Recording(Common):
    to: str | None = option(
        None, "Layout to write.", metavar="bop|tum|open3d|mcap",
        show_default="the one that holds everything", check=_known_layout,
    )  # fmt: skip
    resume: bool = option(False, "Continue the recording in DIR that was interrupted.")
    color: Literal["png", "jpg", "video"] = option(
        "png", "Colour images: png is lossless, jpg smaller; video: color.mkv, smallest."
    )

    def writer(self, contents: Any) -> Any:
        """A `LayoutWriter` for --out, with a warning of what the layout omits of colour."""
        writer = opened(self.folder, contents, self.to, self.color, self.resume, self.overwrite)
        if lost := writer.lost_of_color(contents.camera):
            warnings.warn(lost, stacklevel=2)
        return writer


class Item(NamedTuple):
    frame: Any
    poses: Mapping[int, Any] | None = None
    masks: Mapping[int, Any] | None = None
    im_id: int | None = None


def items_of(seq: Any, done: int, label: str, quiet: bool) -> Iterator[Item]:
    for i in progress(range(done, len(seq)), len(seq) - done, label, quiet):
        yield Item(seq[i], seq.ground_truth.get(i), seq.masks(i), seq.ids[i])


def opened(
    out: Path, contents: Any, to: str | None = None, color: str = "png", resume: bool = False,
    overwrite: bool = False,
) -> Any:  # fmt: skip
    """A `LayoutWriter` for the folder, which is new, empty, interrupted, or overwritten."""
    from sdftrack.io.writers import WRITERS
    from sdftrack.io.writers.base import Journal

    camera = contents.camera
    if to is None:  # BOP holds everything but a lens and colour of another camera
        apart = camera.T_color_depth is not None and find_spec("mcap") and find_spec("rosbags")
        to = "mcap" if apart else "tum" if camera.depth.distortion else "bop"
    kind = WRITERS[to]
    if resume:
        if not Journal.is_in(out):
            begin = "leave out --resume to begin one"
            raise ValueError(f"--resume: {out} holds no interrupted recording; {begin}")
        _hold(out)
        return kind(out, contents, color, resume=True)
    kind.check_color(color)
    kind.check_contents(contents)  # before the folder is made: a refusal leaves nothing behind
    _make_empty(out, overwrite)
    return kind(out, contents, color)


def _hold(out: Path) -> None:
    """Hold the folder until the end of the command, and remove images that were cut while they were written."""
    from sdftrack.io.out_folder import lock_folder

    lock_folder(out)
    for part in out.rglob(f"{PART_PREFIX}*"):
        part.unlink(missing_ok=True)


def _make_empty(out: Path, overwrite: bool) -> None:
    from sdftrack.io.out_folder import LOCK, prepare_folder, refuse_folder
    from sdftrack.io.writers.base import Journal

    if Journal.is_in(out) and not overwrite:
        raise FileExistsError(
            f"out: {out} holds an interrupted recording; pass --resume to continue, or overwrite=True"
        )
    refuse_folder(out, overwrite)
    if out.is_dir():
        _hold(out)
    files = [path for path in out.rglob("*") if not path.is_dir() and path.name != LOCK]
    if files and not ((out / NAME).is_file() or Journal.is_in(out)):
        raise FileExistsError(
            f"out: expected an earlier recording in {out}, got other files; choose another folder"
        )
    for path in files:
        if OURS.fullmatch(path.relative_to(out).as_posix()):
            path.unlink()
    prepare_folder(out, overwrite)


def write_all(writer: Any, items: Iterable[Item], source: str, command: str, quiet: bool) -> None:
    """Add the items and finish the recording, also if the disk is full or on Ctrl-C. OSError after what could be
    written was finished; an interruption of a command that has no other end is its end."""
    failure: BaseException | None = None
    try:
        for item in items:
            writer.add(*item)
    except (KeyboardInterrupt, OSError) as error:
        failure = error
    if not writer.count:
        writer.close()
        raise failure or ValueError(f"{source}: expected at least one frame, got none")
    if isinstance(failure, KeyboardInterrupt) and command != "record":
        writer.close()  # to be continued
        raise failure
    # While there is neither this file nor the journal, the folder is nobody's, and --overwrite refuses it.
    writer.finish(
        lambda: write_json(
            writer.folder / NAME,
            {"command": command, "source": source, "layout": writer.name, "frames": writer.count},
        )
    )
    if isinstance(failure, OSError):
        raise OSError(
            failure.errno,
            f"{failure.strerror or failure}; {writer.count} frames before that are in {writer.folder}",
        )
    if not quiet:
        print(f"{writer.count} frames written to {writer.folder}, layout {writer.name}")
        if writer.rounded_m:
            unit = f"{1e3 * writer.rounded_m:g} mm, which is the layout's unit"
            print(f"  depth is rounded to {unit}; --to names others")


@dataclass(frozen=True, kw_only=True)
class Record(CameraSize, Recording):
    """Record a camera until Ctrl-C: depth without loss, colour, camera and times.

    A full disk ends the recording; what was written before is complete and can be read. --resume continues after an
    interruption.
    """

    source: str = argument("realsense:, realsense:SERIAL or replay:RECORDING.", "CAMERA")
    seconds: float | None = option(
        None, "Stop after this time; default: Ctrl-C.", check=above_zero("a time in seconds")
    )
    frames: int | None = option(None, "Stop after this number of frames.", min=1)


def record(job: Record) -> None:
    from sdftrack.io.writers import Contents

    _ = job.folder  # there has to be one
    job.on_cpu()
    with job.opened(job.source, WAITING) as camera:
        with job.writer(Contents(camera.camera)) as writer:
            if not job.quiet:
                print(f"recording {camera.name}; end with Ctrl-C", file=sys.stderr, flush=True)
            items = itertools.islice(_items(camera, job), job.frames)
            write_all(writer, items, job.source, "record", job.quiet)
        if camera.dropped:
            print(
                f"sdftrack: warning: {camera.dropped} of {camera.taken} frames were dropped: the disk or the "
                "processor is too slow; use --color jpg, or fewer frames per second",
                file=sys.stderr,
            )


def _items(camera: Any, job: Record) -> Iterator[Item]:
    end = math.inf if job.seconds is None else time.monotonic() + job.seconds
    for frame in progress(camera, 0, "recording", job.quiet, lambda: f"{camera.dropped} dropped"):
        if time.monotonic() >= end:
            return
        yield Item(frame)


@dataclass(frozen=True, kw_only=True)
class Convert(Frames, Layout, Recording):
    """Write a recorded sequence in another layout: depth, colour, camera, times, poses, masks and models.

    Depth is stored without a change where the layout has a unit that represents it, and the result says where not.
    If the command is interrupted, --resume continues it.
    """

    seq: Path = argument("Recorded sequence.", "SEQ")
    depth_glob: str | None = option(
        None, "Depth images below SEQ of no known layout, in millimetres; quote it.", metavar="PATTERN"
    )
    color_glob: str | None = option(None, "Colour images below SEQ, likewise.", metavar="PATTERN")
    camera: Path | None = option(
        None, "Camera of those images. Default: a camera file in SEQ.", metavar="FILE"
    )

    @property
    def opening(self) -> dict[str, Any]:
        globs = {"depth_glob": self.depth_glob, "color_glob": self.color_glob, "camera": self.camera}
        if self.depth_glob is not None:
            return {"layout": "folders", **globs}
        if self.color_glob is not None or self.camera is not None:
            raise Usage("expected --depth-glob with --color-glob and --camera", "--depth-glob")
        return super().opening


def convert(job: Convert) -> None:
    from sdftrack.io.writers import Contents

    out = job.folder
    job.on_cpu()
    with st.open_sequence(job.seq, **job.opening) as whole:
        if out.resolve() == job.seq.resolve():
            raise ValueError(f"--out: expected another folder than the sequence {job.seq}, got the same")
        part = whole[job.part]
        with job.writer(Contents(part.camera, part.objects, part.models)) as writer:
            items = items_of(part, writer.count, job.seq.name, job.quiet)
            write_all(writer, items, str(job.seq), "convert", job.quiet)
