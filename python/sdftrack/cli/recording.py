# SPDX-License-Identifier: MIT
"""What `record`, `convert` and `synth` share: the folder of a recording, which can be continued, and its summary."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, NamedTuple

from sdftrack._internal.files import PART_PREFIX, write_json
from sdftrack.cli.common import Common
from sdftrack.cli.options import Usage, option
from sdftrack.cli.progress import progress

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
    """Options of a recording that is written."""

    to: str | None = option(
        None,
        "Layout to write.",
        metavar="bop|tum|open3d|mcap",
        show_default="the one that holds everything",
        check=_known_layout,
    )
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
    """A frame, and what is known about it; arguments of `LayoutWriter.add`."""

    frame: Any
    poses: Mapping[int, Any] | None = None
    masks: Mapping[int, Any] | None = None
    im_id: int | None = None


def items_of(seq: Any, done: int, label: str, quiet: bool) -> Iterator[Item]:
    """The frames of a sequence from the `done`-th one on, with progress."""
    for i in progress(range(done, len(seq)), len(seq) - done, label, quiet):
        yield Item(seq[i], seq.ground_truth.get(i), seq.masks(i), seq.ids[i])


def opened(
    out: Path,
    contents: Any,
    to: str | None = None,
    color: str = "png",
    resume: bool = False,
    overwrite: bool = False,
) -> Any:
    """A `LayoutWriter` for the folder, which is new, empty, interrupted, or overwritten."""
    from sdftrack.io.writers import WRITERS
    from sdftrack.io.writers.journal import Journal

    kind = WRITERS[to or _fitting(contents)]
    if resume:
        if not Journal.is_in(out):
            raise ValueError(
                f"--resume: {out} holds no interrupted recording; leave out --resume to begin one"
            )
        _hold(out)
        return kind(out, contents, color, resume=True)
    kind.check_color(color)
    kind.check_contents(contents)  # before the folder is made: a refusal leaves nothing behind
    _make_empty(out, overwrite)
    return kind(out, contents, color)


def _fitting(contents: Any) -> str:
    """BOP holds everything but a lens and colour of another camera."""
    camera = contents.camera
    if camera.T_color_depth is not None and find_spec("mcap") and find_spec("rosbags"):
        return "mcap"
    return "tum" if camera.depth.distortion else "bop"


def _hold(out: Path) -> None:
    """Hold the folder until the end of the command, and remove images that were cut while they were written."""
    from sdftrack.io.folder_lock import lock_folder

    lock_folder(out)
    for part in out.rglob(f"{PART_PREFIX}*"):
        part.unlink(missing_ok=True)


def _make_empty(out: Path, overwrite: bool) -> None:
    from sdftrack.io.folder_lock import LOCK
    from sdftrack.io.out_folder import prepare_folder, refuse_folder
    from sdftrack.io.writers.journal import Journal

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
    """Add the items and finish the recording, also if the disk is full or on Ctrl-C.

    OSError after what could be written was finished; an interruption of a command that has no other end is its end.
    """
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
        _tell(writer)


def _tell(writer: Any) -> None:
    print(f"{writer.count} frames written to {writer.folder}, layout {writer.name}")
    if writer.rounded_m:
        print(
            f"  depth is rounded to {1e3 * writer.rounded_m:g} mm, which is the layout's unit; --to names others"
        )
