# SPDX-License-Identifier: MIT
"""``sdftrack calibrate intrinsics``: intrinsics of a depth camera from a recording of a known object."""

from __future__ import annotations

import dataclasses
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import sdftrack as st
from sdftrack._internal.files import write_json
from sdftrack.cli.common import Common, Holes, Meshes, show_table
from sdftrack.cli.init import INIT, parse_inits, places
from sdftrack.cli.objects import Target, load_targets
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.progress import progress_counter
from sdftrack.cli.sources import Frames, Layout, Selected, fitting, load_camera, parse_intrinsics

FILES = ("camera.json", "result.json", "coverage.png", "estimates.png", "residuals.png")
PINHOLE = ("fx", "fy", "cx", "cy")
MIN_PIXELS = 200  # of a frame, as `calibrate_intrinsics` wants them
PYTHONS_ADVICE = "initial_pose=, mask= or box="  # in errors


@dataclass(frozen=True, kw_only=True)
class Intrinsics(Meshes, Frames, Layout, Common):
    """Estimate a depth camera's intrinsics from a known object moved in front of it (no calibration pattern).

    Writes camera.json, result.json and plots into DIR.
    """

    seq: Path = argument("Folder of a recorded sequence.", "SEQ")
    model: Path = option(..., "Mesh of the object.", metavar="M.ply")
    init: str = option(
        "auto", "Location of the object in the first image; auto: by its mask or a search.", metavar=INIT
    )
    free: str = option(
        ",".join(PINHOLE),
        "Parameters to estimate, out of fx, fy, cx, cy, skew, k1, k2, depth_scale, depth_offset.",
        metavar="NAME,...",
    )
    per_frame: bool = option(False, "Weighted mean of single-frame estimates instead of a joint solution.")
    residual: Literal["ray_hit", "point"] = option(
        "ray_hit", "ray_hit: depth of the ray's intersection with the model; point: as in the thesis."
    )
    camera: Path | None = option(
        None, "Initial estimate, instead of the sequence's own camera.", metavar="FILE"
    )
    guess: str | None = option(
        None, "Initial estimate, pixels; 10 % accuracy suffices.", metavar="fx,fy,cx,cy"
    )
    holes: Holes = option("error", "Open meshes: report an error, or close them.")
    max_pixels: int = option(5000, "Maximum number of depth pixels used per frame.", min=MIN_PIXELS)

    def unknowns(self) -> tuple[str, ...]:
        from sdftrack.calibration.lens import check_free

        try:
            return check_free([name.strip() for name in self.free.split(",")])
        except ValueError as error:
            raise Usage(str(error).removeprefix("free: "), "--free") from None

    def guessed(self) -> tuple[float, float, float, float] | None:
        if self.guess is None:
            return None
        if self.camera is not None:
            raise Usage("expected one of --guess and --camera, got both", "--guess")
        return parse_intrinsics(self.guess, "--guess")


def intrinsics(job: Intrinsics) -> None:
    out, seq = job.folder, job.seq
    job.unknowns(), job.guessed()
    inits = parse_inits([job.init], 1)
    job.on_cpu()
    from sdftrack.calibration.intrinsics_residuals import compare

    inputs = [("SEQ", seq / "camera.json"), ("--camera", job.camera), ("--model", job.model)]
    job.refuse_out(FILES, inputs)
    with st.open_sequence(seq, **job.opening) as whole:
        numbers = job.numbers(whole, seq)
        first = _first_guess(job, whole.camera)
        (target,) = load_targets([job.model], whole, job.unit, job.voxels, job.holes)

        def depth_alone(frame: Any, number: int) -> Any:
            return frame if frame.depth is None else fitting(frame.replace(camera=first, color=None), first)

        frames = Selected(whole, numbers, depth_alone)
        result = _calibrated(
            job, frames, first, target, places(inits, [target], frames[0], seq, numbers[0], whole)
        )
        misfits = compare(frames, target.sdf, first, result, job.threads)
        settings = {
            "command": "calibrate intrinsics", "sequence": str(seq), "model": str(job.model), "init": job.init,
            "first_guess": {name: getattr(first, name) for name in PINHOLE},
            "frames": [numbers.start, numbers.stop, numbers.step], "voxels": job.voxels, "residual": job.residual,
            "max_pixels": job.max_pixels,
        }  # fmt: skip
        job.make_out()
        _write(result, misfits, out, settings, [whole.ids[i] for i in numbers])
    if not job.quiet:
        _show(result, misfits, first, len(numbers), out)


def _calibrated(job: Intrinsics, frames: Selected, first: Any, target: Target, told: dict[str, Any]) -> Any:
    kinds = {"poses": "initial_pose", "masks": "mask", "boxes": "box"}
    place = {kinds[kind]: values[0] for kind, values in told.items() if values is not None}
    with progress_counter(job.quiet) as tell:
        try:
            return st.calibrate_intrinsics(
                frames, target.sdf, first, joint=not job.per_frame, free=job.unknowns(),
                progress=lambda done: tell(done, len(frames), "frames"), residual=job.residual,
                max_pixels=job.max_pixels, threads=job.threads, **place,
            )  # fmt: skip
        except ValueError as error:
            raise ValueError(str(error).replace(PYTHONS_ADVICE, "--init")) from error


def _write(result: Any, misfits: Any, out: Path, settings: dict[str, Any], im_ids: list[int]) -> None:
    from sdftrack.calibration.plots import plot_coverage, plot_estimates, plot_residuals
    from sdftrack.viz.plots import write_plots

    before, after = misfits
    residuals = {"first_guess": before.to_dict(), "calibrated": after.to_dict()}
    result.camera.save(out / "camera.json")
    values = {"settings": settings, **result.to_dict(), "residuals": residuals}
    write_json(out / "result.json", {**values, "im_ids": [im_ids[i] for i in result.frames]})
    plots = {
        "coverage.png": lambda: plot_coverage(result),
        "estimates.png": lambda: plot_estimates(result),
        "residuals.png": lambda: plot_residuals(before, after, result),
    }
    write_plots(out, plots)


def _first_guess(job: Intrinsics, own: Any) -> Any:
    from sdftrack.camera import depth_camera
    from sdftrack.camera.files import warn_if_doubtful

    depth, values = depth_camera(own), job.guessed()
    if values is not None:
        fx, fy, cx, cy = values
        camera = dataclasses.replace(depth, fx=fx, fy=fy, cx=cx, cy=cy)
        warn_if_doubtful(camera, "--guess")
        return camera
    if job.camera is None:
        return depth
    return load_camera(job.camera, depth.shape, "the sequence's depth images")


def _show(result: Any, misfits: Any, first: Any, given: int, out: Path) -> None:
    from sdftrack.calibration.lens import UNKNOWNS, core_lens

    guessed = dict(zip(UNKNOWNS, core_lens(first).values, strict=True))
    rows = [
        [name, f"{guessed[name]:.5g}", f"{value:.6g}", f"{low:.6g} to {high:.6g}"]
        for name, value, (low, high) in zip(result.free, result.values, result.interval95, strict=True)
    ]
    residual = [f"{1e3 * m.median_m:.2f}" if m.frames else "not found" for m in misfits]
    rows.append(["residual mm", *residual, ""])
    rows.append(["frames used", "", str(len(result.frames)), f"of {given}"])
    show_table(f"{out}: {', '.join(FILES)}", ["", "first guess", result.status, "95 %"], rows)
    if result.left_out:
        kinds = Counter(reason.split(":")[0] for reason in result.left_out.values())
        print(f"left out: {', '.join(f'{n} {kind}' for kind, n in kinds.items())}")
    if result.extra:
        print(f"camera.json does not hold {', '.join(result.extra)}: see result.json")
    for name, bias, (low, high) in zip(result.free, result.bias, result.interval95, strict=True):
        if abs(bias) > 0.5 * (high - low):
            print(
                f"noise biases {name} by about {bias:+.3g}, which exceeds its interval: see bias in result.json"
            )
    if result.status == "weak":
        print("weak: neither the result nor its intervals are reliable until this is fixed")
    for sentence in result.observability.advice:
        print(f"advice: {sentence}")
