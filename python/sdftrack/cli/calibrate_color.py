# SPDX-License-Identifier: MIT
"""``sdftrack calibrate color``: depth-to-colour registration from a recording of a coloured ball on a wand."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

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
    show_table,
)
from sdftrack.cli.progress import progress_counter

FILES = ("camera.json", "result.json", "residuals.png", "coverage.png", "path.png")
STEPS = 100  # of the progress


def color(
    seq: Annotated[Path, typer.Argument(metavar="SEQ", help="Folder of a recorded sequence.")],
    ball_radius: Annotated[float, typer.Option(metavar="R", help="Radius of the ball, metres.")],
    ball_color: Annotated[
        str | None, typer.Option(metavar="r,g,b", help="0 to 255; default: the most saturated moving object.")
    ] = None,
    color_camera: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Known colour camera: only its pose is estimated; its distortion is used."
        ),
    ] = None,
    time_offset: Annotated[
        bool, typer.Option("--time-offset", help="Also estimate the delay of colour relative to depth.")
    ] = False,
    fps: Annotated[
        float | None, typer.Option(metavar="N", help="Frames per second, if the sequence has no timestamps.")
    ] = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    start: StartOption = 0,
    stop: StopOption = None,
    step: StepOption = 1,
    layout: LayoutOption = "auto",
    depth_topic: DepthTopicOption = None,
    color_topic: ColorTopicOption = None,
    seed: Annotated[int, typer.Option(min=0, help="Random seed of the search for consistent pairs.")] = 0,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Estimate the depth-to-colour mapping from a coloured ball moved in front of both cameras.

    Writes camera.json (with the mapping, in the format of a sequence folder), result.json and plots into DIR.
    """
    if out is None:
        raise Usage("expected a folder for the result", "--out")
    wanted = _color(ball_color)
    if not math.isfinite(ball_radius) or ball_radius <= 0:
        raise Usage(f"expected metres above 0, got {ball_radius:g}", "--ball-radius")
    if fps is not None and not (math.isfinite(fps) and fps > 0):
        raise Usage(f"expected frames per second above 0, got {fps:g}", "--fps")
    source = opening(layout, depth_topic, color_topic)
    check_cpu_only(config, device)
    import sdftrack as st
    from sdftrack.io.out_folder import prepare_folder, refuse_folder, refuse_inputs

    refuse_folder(out, overwrite)  # now, not after the work
    refuse_inputs(out, FILES, [("SEQ", seq / "camera.json"), ("--color-camera", color_camera)])
    lens = None if color_camera is None else st.Camera.load(color_camera)
    with _opened(seq, source) as whole:
        numbers = range(len(whole))[start:stop:step]
        if not len(numbers):
            raise ValueError(f"--start, --stop: expected some of the {len(whole)} frames of {seq}, got none")
        frames = _Frames(whole, numbers, fps)
        with progress_counter(quiet) as tell:
            result = st.calibrate_color_to_depth(
                frames,
                whole.camera.depth,
                ball_radius,
                wanted,
                color_camera=lens,
                time_offset=time_offset,
                progress=lambda share: tell(round(STEPS * share), STEPS, "ball"),
                threads=threads,
                seed=seed,
            )
        prepare_folder(out, overwrite)
        settings = {
            "command": "calibrate color",
            "sequence": str(seq),
            "ball_radius_m": ball_radius,
            "ball_color": None if wanted is None else list(wanted),
            "color_camera": None if color_camera is None else str(color_camera),
            "frames": [numbers.start, numbers.stop, numbers.step],
            "seed": seed,
        }
        _write(result, whole.camera, out, settings, _depth_scale(seq))
    if not quiet:
        _show(result, out)


class _Frames:
    """Frames of a sequence, with timestamps from `fps` if they have none."""

    def __init__(self, seq: Any, numbers: range, fps: float | None) -> None:
        self._seq, self._numbers, self._fps = seq, numbers, fps

    def __len__(self) -> int:
        return len(self._numbers)

    def __getitem__(self, i: int) -> Any:
        frame = self._seq[self._numbers[i]]
        if self._fps is None or frame.timestamp is not None:
            return frame
        return frame.replace(timestamp=self._numbers[i] / self._fps)

    def __iter__(self) -> Iterator[Any]:
        return (self[i] for i in range(len(self)))


def _color(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        values = tuple(float(v) for v in text.split(","))
    except ValueError:
        values = ()
    if len(values) != 3 or not all(0 <= v <= 255 for v in values):
        raise Usage(f"expected r,g,b from 0 to 255, got {text!r}", "--ball-color")
    return values


def _opened(path: Path, arguments: dict[str, Any]) -> Any:
    """The sequence with its colour images of any size, because they are not registered yet."""
    import sdftrack as st

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*colour images of .* are ignored")
        seq = st.open_sequence(path, **arguments)
    seq.take_unregistered_color()
    return seq


def _depth_scale(path: Path) -> float:
    """Depth scale of a camera.json of the k1 layout, so that the new file can replace it; else millimetres."""
    from sdftrack._internal.text_files import read_json

    file = path / "camera.json"
    values = read_json(file) if file.is_file() else {}
    scale = values.get("depth_scale_m") if isinstance(values, dict) else None
    return float(scale) if isinstance(scale, (int, float)) else 0.001


def _write(result: Any, before: Any, out: Path, settings: dict[str, Any], depth_scale_m: float) -> None:
    from sdftrack._internal.files import write_json
    from sdftrack.calibration.color_plots import plot_coverage, plot_path, plot_residuals
    from sdftrack.viz.plots import save_figure

    write_json(out / "camera.json", result.camera_dict(depth_scale_m))
    write_json(out / "result.json", {"settings": settings, **result.to_dict()})
    save_figure(plot_residuals(result, before), out / "residuals.png")
    save_figure(plot_coverage(result), out / "coverage.png")
    save_figure(plot_path(result), out / "path.png")


def _show(result: Any, out: Path) -> None:
    import numpy as np

    K, t = result.K_color, result.T_color_depth[:3, 3]
    rows = [
        ["pairs kept", f"{int(np.count_nonzero(result.pairs.kept))} of {len(result.pairs)}"],
        ["rms px", f"{result.rms_px:.3f}"],
        ["colour camera fx fy cx cy", f"{K[0, 0]:.1f} {K[1, 1]:.1f} {K[0, 2]:.1f} {K[1, 2]:.1f}"],
        ["depth camera position in its frame, mm", " ".join(f"{1e3 * v:+.1f}" for v in t)],
    ]
    if result.time_offset_sd_s:
        late = f"{1e3 * result.time_offset_s:+.2f} +- {1e3 * result.time_offset_sd_s:.2f}"
        rows.append(["delay of colour, ms", late])
    show_table(f"{out}: {', '.join(FILES)}", ["", "value"], rows)
