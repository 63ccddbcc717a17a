# SPDX-License-Identifier: MIT
"""``sdftrack calibrate depth``: depth error model from recordings of a wall, a table or a known object."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sdftrack as st
from sdftrack.cli.common import Common, Meshes, show_table
from sdftrack.cli.objects import load_targets
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.progress import progress_counter
from sdftrack.cli.sources import Frames, Layout


@dataclass(frozen=True, kw_only=True)
class Depth(Meshes, Frames, Layout, Common):
    """Measure a depth camera's noise, its spatial correlation, and its bias.

    From a flat wall or table at several distances and angles, or from a known object at known poses. Use the result
    with --sensor FILE.toml, or Tracker(..., sensor=FILE.toml).
    """

    seqs: tuple[Path, ...] = argument("Folders of recorded sequences.", "SEQ...")
    out: Path | None = option(
        None, "Output file of the sensor model; a plot is written next to it.", "--out", "-o",
        metavar="FILE.toml",
    )  # fmt: skip
    model: Path | None = option(
        None,
        "A known object, at the sequence's ground-truth poses. Default: a wall or table.",
        metavar="M.ply",
    )
    overwrite: bool = option(False, "Replace FILE if it exists.", "--overwrite")
    name: str = option("calibrated", "Name of the sensor, used in results.")

    def file(self) -> Path:
        out = self.out
        if out is None or out.suffix.lower() not in (".toml", ".json"):
            raise Usage("expected a file for the result: --out sensor.toml", "--out")
        there = [path for path in (out, out.with_suffix(".png")) if path.exists()]
        if there and not self.overwrite:
            raise Usage(
                f"expected a new file, got {there[0]}, which exists; choose another or pass --overwrite",
                "--out",
            )
        return out


def depth(job: Depth) -> None:
    job.on_cpu()
    out = job.file()
    from sdftrack.calibration.plots import plot_depth_errors
    from sdftrack.viz.plots import write_plots

    with contextlib.ExitStack() as stack:
        opened = [stack.enter_context(st.open_sequence(path, **job.opening)) for path in job.seqs]
        source = _Source(opened, job)
        with progress_counter(job.quiet) as tell:
            result = st.calibrate_depth(
                source, opened[0].camera, model=source.shape, poses=source.poses, name=job.name,
                progress=lambda done: tell(done, len(source), "frames"),
            )  # fmt: skip
    result.sensor.save(out)
    plot = {out.with_suffix(".png").name: lambda: plot_depth_errors(result)}
    written = [str(out), *write_plots(out.parent, plot)]
    if not job.quiet:
        _show(result, ", ".join(written))


class _Source:
    """The selected frames of all sequences, with their cameras and object poses."""

    def __init__(self, seqs: list[Any], job: Depth) -> None:
        self.seqs = seqs
        self.numbers = [(s, i) for s, seq in enumerate(seqs) for i in range(len(seq))[job.part]]
        if not self.numbers:
            raise ValueError(f"--start, --stop: expected some frames of {job.seqs[0]}, got none")
        self.shape, self.poses = None, None
        if job.model is None:
            return
        targets = [load_targets([job.model], seq, job.unit, job.voxels)[0] for seq in seqs]
        for target, path in zip(targets, job.seqs, strict=True):
            if target.instance is None:
                raise ValueError(
                    f"--model {job.model}: expected an object of {path} with reference poses, got none; give a "
                    "sequence in the bop layout whose scene_gt.json has it"
                )
        self.shape = targets[0].sdf
        self.poses = [seqs[s].ground_truth.get(i, {}).get(targets[s].instance) for s, i in self.numbers]

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[Any]:
        for s, i in self.numbers:
            frame = self.seqs[s][i]
            yield frame if frame.camera is not None else frame.replace(camera=self.seqs[s].camera)


def _show(result: Any, files: str) -> None:
    sensor, rows = result.sensor, []
    z = [s.depth for s in result.noise]
    low, high = min(z), max(z)
    for k in range(4):
        at = low + (high - low) * k / 3
        near = [s for s in result.noise if abs(s.depth - at) < max(0.05 * at, (high - low) / 6)]
        flat = sorted(s.sd for s in near if s.tangent < 1.0)
        seen = f"{1e3 * flat[len(flat) // 2]:.2f}" if flat else "-"
        noise = [f"{1e3 * float(sensor.noise(at, math.radians(a))):.2f}" for a in (0, 30, 60)]
        bias = f"{1e3 * float(sensor.bias(at)):+.2f}" if result.surface == "object" else "not told"
        rows.append([f"{at:.2f}", seen, *noise, bias, f"{1e3 * float(sensor.systematic(at)):.2f}"])
    head = ["distance m", "noise measured mm", "model 0 deg", "30 deg", "60 deg", "bias mm", "its sd mm"]
    show_table(f"{files}: {sensor.source}", head, rows)
    print(f"the noise is correlated over {sensor.correlation_px:.1f} px; {result.used} frames used")
    if result.left_out:
        print(f"left out: {len(result.left_out)} frames, the last one: {list(result.left_out.values())[-1]}")
