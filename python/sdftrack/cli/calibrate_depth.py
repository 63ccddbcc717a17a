# SPDX-License-Identifier: MIT
"""``sdftrack calibrate depth``: depth error model from recordings of a wall, a table or a known object."""

from __future__ import annotations

import math
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
from sdftrack.cli.targets import load_targets

UNITS = ("m", "mm", "cm", "in")


def depth(
    seqs: Annotated[list[Path], typer.Argument(metavar="SEQ...", help="Folders of recorded sequences.")],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE.toml",
            help="Output file of the sensor model; a plot is written next to it.",
        ),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            metavar="M.ply",
            help="A known object, at the sequence's ground-truth poses. Default: a wall or table.",
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace FILE if it exists.")] = False,
    name: Annotated[str, typer.Option(help="Name of the sensor, used in results.")] = "calibrated",
    start: StartOption = 0,
    stop: StopOption = None,
    step: StepOption = 1,
    layout: LayoutOption = "auto",
    depth_topic: DepthTopicOption = None,
    color_topic: ColorTopicOption = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the mesh: m, mm, cm or in.")] = None,
    voxels: Annotated[int, typer.Option(min=8, help="Voxels along its longest side.")] = 200,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Measure a depth camera's noise, its spatial correlation, and its bias.

    From a flat wall or table at several distances and angles, or from a known object at known poses. Use the result
    with --sensor FILE.toml, or Tracker(..., sensor=FILE.toml).
    """
    check_cpu_only(config, device)
    if out is None or out.suffix.lower() not in (".toml", ".json"):
        raise Usage("expected a file for the result: --out sensor.toml", "--out")
    if out.exists() and not overwrite:
        raise Usage(
            f"expected a new file, got {out}, which exists; choose another or pass --overwrite", "--out"
        )
    if unit not in (None, *UNITS):
        raise Usage(f"expected {', '.join(UNITS)}, got {unit!r}", "--unit")
    arguments = opening(layout, depth_topic, color_topic)
    import sdftrack as st
    from sdftrack.calibration.depth_plots import plot_depth_errors
    from sdftrack.viz.plots import save_figure

    opened = [st.open_sequence(path, **arguments) for path in seqs]
    try:
        source = _Source(opened, seqs, slice(start, stop, step), model, unit, voxels)
        with progress_counter(quiet) as tell:
            result = st.calibrate_depth(
                source,
                opened[0].camera,
                model=source.shape,
                poses=source.poses,
                name=name,
                progress=lambda done: tell(done, len(source), "frames"),
            )
    finally:
        for seq in opened:
            seq.close()
    result.sensor.save(out)
    picture = out.with_suffix(".png")
    save_figure(plot_depth_errors(result), picture)
    if not quiet:
        _show(result, out, picture)


class _Source:
    """The selected frames of all sequences, with their cameras and object poses."""

    def __init__(
        self,
        seqs: list[Any],
        paths: list[Path],
        part: slice,
        model: Path | None,
        unit: str | None,
        voxels: int,
    ) -> None:
        self.seqs = seqs
        self.numbers = [(s, i) for s, seq in enumerate(seqs) for i in range(len(seq))[part]]
        if not self.numbers:
            raise ValueError(f"--start, --stop: expected some frames of {paths[0]}, got none")
        self.shape, self.poses = None, None
        if model is None:
            return
        targets = [load_targets([model], seq, unit, voxels, "error")[0] for seq in seqs]
        for target, path in zip(targets, paths, strict=True):
            if target.instance is None:
                raise ValueError(
                    f"--model {model}: expected an object of {path} with reference poses, got none; give a sequence in "
                    "the bop layout whose scene_gt.json has it"
                )
        self.shape = targets[0].sdf
        self.poses = [seqs[s].ground_truth.get(i, {}).get(targets[s].instance) for s, i in self.numbers]

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[Any]:
        for s, i in self.numbers:
            frame = self.seqs[s][i]
            yield frame if frame.camera is not None else frame.replace(camera=self.seqs[s].camera)


def _show(result: Any, out: Path, picture: Path) -> None:
    sensor = result.sensor
    z = [s.depth for s in result.noise]
    low, high = min(z), max(z)
    rows = []
    for k in range(4):
        at = low + (high - low) * k / 3
        near = [s for s in result.noise if abs(s.depth - at) < max(0.05 * at, (high - low) / 6)]
        flat = sorted(s.sd for s in near if s.tangent < 1.0)
        seen = f"{1e3 * flat[len(flat) // 2]:.2f}" if flat else "-"
        rows.append(
            [
                f"{at:.2f}",
                seen,
                *(f"{1e3 * float(sensor.noise(at, math.radians(a))):.2f}" for a in (0, 30, 60)),
                f"{1e3 * float(sensor.bias(at)):+.2f}" if result.surface == "object" else "not told",
                f"{1e3 * float(sensor.systematic(at)):.2f}",
            ]
        )
    head = ["distance m", "noise measured mm", "model 0 deg", "30 deg", "60 deg", "bias mm", "its sd mm"]
    show_table(f"{out}, {picture.name}: {sensor.source}", head, rows)
    print(f"the noise is correlated over {sensor.correlation_px:.1f} px; {result.used} frames used")
    if result.left_out:
        print(f"left out: {len(result.left_out)} frames, the last one: {list(result.left_out.values())[-1]}")
