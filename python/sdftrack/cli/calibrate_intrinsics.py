# SPDX-License-Identifier: MIT
"""``sdftrack calibrate intrinsics``: intrinsics of a depth camera from a recording of a known object."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.calibrate_intrinsics_files import FILES, show, write
from sdftrack.cli.common import (
    ColorTopicOption,
    ConfigOption,
    DepthTopicOption,
    DeviceOption,
    LayoutOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    StartOption,
    StepOption,
    StopOption,
    ThreadsOption,
    Usage,
    check_cpu_only,
    opening,
)
from sdftrack.cli.init import INIT, Init, parse_inits, places
from sdftrack.cli.progress import progress_counter
from sdftrack.cli.targets import Target, about_file, load_targets
from sdftrack.cli.track import fitting

UNITS = ("m", "mm", "cm", "in")
PINHOLE = ("fx", "fy", "cx", "cy")
SIZED = (".json", ".yaml", ".yml")  # camera files that hold the size of the image
MIN_PIXELS = 200  # of a frame, as `calibrate_intrinsics` wants them
PYTHONS_ADVICE = "initial_pose=, mask= or box="  # in errors


class Residual(str, Enum):
    """`residual` of `calibrate_intrinsics`."""

    ray_hit = "ray_hit"
    point = "point"


def intrinsics(
    seq: Annotated[Path, typer.Argument(metavar="SEQ", help="Folder of a recorded sequence.")],
    model: Annotated[Path, typer.Option(metavar="M.ply", help="Mesh of the object.")],
    init: Annotated[
        str,
        typer.Option(
            metavar=INIT, help="Location of the object in the first image; auto: by its mask or a search."
        ),
    ] = "auto",
    free: Annotated[
        str,
        typer.Option(
            metavar="NAME,...",
            help="Parameters to estimate, out of fx, fy, cx, cy, skew, k1, k2, depth_scale, depth_offset.",
        ),
    ] = ",".join(PINHOLE),
    per_frame: Annotated[
        bool,
        typer.Option(
            "--per-frame", help="Weighted mean of single-frame estimates instead of a joint solution."
        ),
    ] = False,
    residual: Annotated[
        Residual,
        typer.Option(
            help="ray_hit: depth of the ray's intersection with the model; point: as in the thesis."
        ),
    ] = Residual.ray_hit,
    camera: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Initial estimate, instead of the sequence's own camera."),
    ] = None,
    guess: Annotated[
        str | None,
        typer.Option(metavar="fx,fy,cx,cy", help="Initial estimate, pixels; 10 % accuracy suffices."),
    ] = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    start: StartOption = 0,
    stop: StopOption = None,
    step: StepOption = 1,
    layout: LayoutOption = "auto",
    depth_topic: DepthTopicOption = None,
    color_topic: ColorTopicOption = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the mesh: m, mm, cm or in.")] = None,
    voxels: Annotated[int, typer.Option(min=8, help="Voxels along the longest side of the model.")] = 200,
    holes: Annotated[
        str, typer.Option(metavar="error|close", help="Open meshes: report an error, or close them.")
    ] = "error",
    max_pixels: Annotated[
        int,
        typer.Option("--max-pixels", min=MIN_PIXELS, help="Maximum number of depth pixels used per frame."),
    ] = 5000,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Estimate a depth camera's intrinsics from a known object moved in front of it (no calibration pattern).

    Writes camera.json, result.json and plots into DIR.
    """
    if out is None:
        raise Usage("expected a folder for the result: --out DIR", "--out")
    unknowns, numbers_guessed = _free(free), _guess(guess, camera)
    inits = parse_inits([init], 1)
    if unit not in (None, *UNITS):
        raise Usage(f"expected {', '.join(UNITS)}, got {unit!r}", "--unit")
    if holes not in ("error", "close"):
        raise Usage(f"expected error or close, got {holes!r}", "--holes")
    source = opening(layout, depth_topic, color_topic)
    check_cpu_only(config, device)
    import sdftrack as st
    from sdftrack.calibration.intrinsics_residuals import compare
    from sdftrack.io.out_folder import prepare_folder, refuse_folder, refuse_inputs

    refuse_folder(out, overwrite)  # now, not after the work
    refuse_inputs(out, FILES, [("SEQ", seq / "camera.json"), ("--camera", camera), ("--model", model)])
    with st.open_sequence(seq, **source) as whole:
        numbers = range(len(whole))[start:stop:step]
        if not len(numbers):
            raise ValueError(f"--start, --stop: expected some of the {len(whole)} frames of {seq}, got none")
        first = _first_guess(whole.camera, camera, numbers_guessed)
        (target,) = load_targets([model], whole, unit, voxels, holes)
        frames = _Frames(whole, numbers, first)
        place = _place(inits, target, frames, seq)
        with progress_counter(quiet) as tell:
            try:
                result = st.calibrate_intrinsics(
                    frames,
                    target.sdf,
                    first,
                    joint=not per_frame,
                    free=unknowns,
                    progress=lambda done: tell(done, len(frames), "frames"),
                    residual=residual.value,
                    max_pixels=max_pixels,
                    threads=threads,
                    **place,
                )
            except ValueError as error:
                raise ValueError(str(error).replace(PYTHONS_ADVICE, "--init")) from error
        misfits = compare(frames, target.sdf, first, result, threads)
        settings = {
            "command": "calibrate intrinsics",
            "sequence": str(seq),
            "model": str(model),
            "init": init,
            "first_guess": {name: getattr(first, name) for name in PINHOLE},
            "frames": [numbers.start, numbers.stop, numbers.step],
            "voxels": voxels,
            "residual": residual.value,
            "max_pixels": max_pixels,
        }
        prepare_folder(out, overwrite)
        write(result, misfits, out, settings, [whole.ids[i] for i in numbers])
    if not quiet:
        show(result, misfits, first, len(numbers), out)


class _Frames:
    """Depth of selected frames of a sequence, with one camera."""

    def __init__(self, seq: Any, numbers: range, camera: Any) -> None:
        self.seq, self.numbers, self.camera = seq, numbers, camera

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, i: int) -> Any:
        frame = self.seq[self.numbers[i]]
        if frame.depth is None:
            return frame
        return fitting(frame.replace(camera=self.camera, color=None), self.camera)

    def __iter__(self) -> Iterator[Any]:
        return (self[i] for i in range(len(self)))


def _free(text: str) -> tuple[str, ...]:
    from sdftrack.calibration.lens import check_free

    try:
        return check_free([name.strip() for name in text.split(",")])
    except ValueError as error:
        raise Usage(str(error).removeprefix("free: "), "--free") from None


def _guess(text: str | None, camera: Path | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    if camera is not None:
        raise Usage("expected one of --guess and --camera, got both", "--guess")
    try:
        values = tuple(float(v) for v in text.split(","))
    except ValueError:
        values = ()
    if len(values) != 4 or not all(map(math.isfinite, values)) or min(values[:2]) <= 0:
        raise Usage(f"expected fx,fy,cx,cy in pixels, fx and fy above 0, got {text!r}", "--guess")
    return values


def _first_guess(own: Any, file: Path | None, values: tuple[float, ...] | None) -> Any:
    """The sequence's depth camera, or a replacement of the same size."""
    from sdftrack.camera import Camera, depth_camera

    depth = depth_camera(own)
    if values is not None:
        fx, fy, cx, cy = values
        return dataclasses.replace(depth, fx=fx, fy=fy, cx=cx, cy=cy)
    if file is None:
        return depth
    size = () if file.suffix.lower() in SIZED else (depth.width, depth.height)
    with about_file("--camera", file):
        camera = Camera.load(file, *size)
    if camera.shape != depth.shape:
        raise ValueError(
            f"--camera {file}: expected the size of the sequence's depth images {depth.width} x {depth.height}, "
            f"got {camera.width} x {camera.height}"
        )
    return camera


def _place(inits: list[Init], target: Target, frames: _Frames, folder: Path) -> dict[str, Any]:
    """--init as arguments of `calibrate_intrinsics`."""
    kinds = {"poses": "initial_pose", "masks": "mask", "boxes": "box"}
    told = places(inits, [target], frames[0], folder, frames.numbers[0], frames.seq)
    return {kinds[kind]: values[0] for kind, values in told.items() if values is not None}
