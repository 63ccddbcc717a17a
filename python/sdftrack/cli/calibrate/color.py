# SPDX-License-Identifier: MIT
"""``sdftrack calibrate color``: depth-to-colour registration from a recording of a coloured ball on a wand."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sdftrack as st
from sdftrack._internal.files import write_json
from sdftrack._internal.text_files import read_json
from sdftrack.cli.common import Common, above_zero, floats, show_table
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.progress import progress_counter
from sdftrack.cli.sources import Frames, Layout, Selected

FILES = ("camera.json", "result.json", "residuals.png", "coverage.png", "path.png")
STEPS = 100  # of the progress


@dataclass(frozen=True, kw_only=True)
class Color(Frames, Layout, Common):
    """Estimate the depth-to-colour mapping from a coloured ball moved in front of both cameras.

    Writes camera.json (with the mapping, in the format of a sequence folder), result.json and plots into DIR.
    """

    seq: Path = argument("Folder of a recorded sequence.", "SEQ")
    ball_radius: float = option(..., "Radius of the ball, metres.", metavar="R", check=above_zero("metres"))
    ball_color: str | None = option(
        None, "0 to 255; default: the most saturated moving object.", metavar="r,g,b"
    )
    color_camera: Path | None = option(
        None, "Known colour camera: only its pose is estimated; its distortion is used.", metavar="FILE"
    )
    time_offset: bool = option(False, "Also estimate the delay of colour relative to depth.")
    fps: float | None = option(
        None,
        "Frames per second, if the sequence has no timestamps.",
        metavar="N",
        check=above_zero("frames per second"),
    )
    seed: int = option(0, "Random seed of the search for consistent pairs.", min=0)

    def rgb(self) -> tuple[float, ...] | None:
        if self.ball_color is None:
            return None
        values = floats(self.ball_color, 3)
        if not values or not all(0 <= v <= 255 for v in values):
            raise Usage(f"expected r,g,b from 0 to 255, got {self.ball_color!r}", "--ball-color")
        return values

    def timed(self, frame: Any, number: int) -> Any:
        if self.fps is None or frame.timestamp is not None:
            return frame
        return frame.replace(timestamp=number / self.fps)


def color(job: Color) -> None:
    from sdftrack.calibration.plots import plot_ball_path, plot_color_coverage, plot_color_residuals
    from sdftrack.viz.plots import write_plots

    out, seq, rgb = job.folder, job.seq, job.rgb()
    job.on_cpu()
    job.refuse_out(FILES, [("SEQ", seq / "camera.json"), ("--color-camera", job.color_camera)])
    lens = None if job.color_camera is None else st.Camera.load(job.color_camera)
    with _opened(seq, job.opening) as whole, progress_counter(job.quiet) as tell:
        numbers = job.numbers(whole, seq)
        result = st.calibrate_color_to_depth(
            Selected(whole, numbers, job.timed), whole.camera.depth, job.ball_radius, rgb, color_camera=lens,
            time_offset=job.time_offset, progress=lambda share: tell(round(STEPS * share), STEPS, "ball"),
            threads=job.threads, seed=job.seed,
        )  # fmt: skip
        job.make_out()
        settings = {
            "command": "calibrate color", "sequence": str(seq), "ball_radius_m": job.ball_radius,
            "ball_color": None if rgb is None else list(rgb),
            "color_camera": None if job.color_camera is None else str(job.color_camera),
            "frames": [numbers.start, numbers.stop, numbers.step], "seed": job.seed,
        }  # fmt: skip
        write_json(out / "camera.json", result.camera_dict(_depth_scale(seq)))
        write_json(out / "result.json", {"settings": settings, **result.to_dict()})
        plots = {
            "residuals.png": lambda: plot_color_residuals(result, whole.camera),
            "coverage.png": lambda: plot_color_coverage(result),
            "path.png": lambda: plot_ball_path(result),
        }
        write_plots(out, plots)
    if not job.quiet:
        _show(result, out)


def _opened(path: Path, arguments: dict[str, Any]) -> Any:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*colour images of .* are ignored")
        seq = st.open_sequence(path, **arguments)
    seq.take_unregistered_color()
    return seq


def _depth_scale(path: Path) -> float:
    """Depth scale of a camera.json of the k1 layout, so that the new file can replace it; else millimetres."""
    file = path / "camera.json"
    values = read_json(file) if file.is_file() else {}
    scale = values.get("depth_scale_m") if isinstance(values, dict) else None
    return float(scale) if isinstance(scale, (int, float)) else 0.001


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
