# SPDX-License-Identifier: MIT
"""``sdftrack evaluate``: comparison of recorded results with a sequence's ground truth."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import sdftrack as st
from sdftrack._internal.files import write_json, write_text
from sdftrack.cli.common import Common, show_table, text_table
from sdftrack.cli.objects import check_symmetry, symmetry_of
from sdftrack.cli.options import argument, option
from sdftrack.cli.sources import Layout

VOXELS = 80  # of a model whose symmetries are looked for


@dataclass(frozen=True, kw_only=True)
class Evaluate(Layout, Common):
    """Compare results with ground truth: a table, plots, result.json (default: in DIR/evaluation)."""

    directory: Path = argument("Output folder of sdftrack track or reconstruct.", "DIR")
    seq: str = argument("The sequence with ground truth.", "SEQ")
    symmetry: str = option(
        "recorded",
        "recorded (from the results, else from the data set), auto (else detected in the shape), none, or a "
        "models_info.json.",
    )


def evaluate(job: Evaluate) -> None:
    from sdftrack.evaluation.report import HEAD, compare, plot_errors, plot_trajectories, table_rows
    from sdftrack.io.report_file import read_results
    from sdftrack.viz.plots import write_plots

    job.on_cpu()
    if job.symmetry != "recorded":
        check_symmetry(job.symmetry)
    report = read_results(job.directory)
    job = replace(job, out=job.out or job.directory / "evaluation")
    job.refuse_out()
    with st.open_sequence(job.seq, **job.opening) as sequence:
        objects = [int(o["obj_id"]) for o in report["frames"][0]["objects"]] if report["frames"] else []
        scores = compare(report, sequence, _symmetries(job.symmetry, sequence, objects))
    out, title, rows = job.make_out(), f"{job.directory} against {job.seq}", table_rows(scores)
    write_text(out / "table.txt", text_table(title, HEAD, rows) + "\n")
    plots = {"errors.png": plot_errors, "trajectory.png": plot_trajectories}
    write_plots(out, {name: functools.partial(plot, scores) for name, plot in plots.items()})
    about = {"version": st.__version__, "results": str(job.directory), "sequence": job.seq}
    write_json(out / "result.json", {**about, "objects": [s.to_dict() for s in scores]})
    if not job.quiet:
        show_table(title, HEAD, rows)
        for score in scores:
            print(score.told())
        print(f"written to {job.out}")


def _symmetries(text: str, seq: Any, objects: list[int]) -> dict[int, Any] | None:
    if text == "recorded":
        return None
    if text == "none":
        return {}
    known = {k for k in objects if text != "auto" or k in seq.symmetries or k in seq.models}

    def found(k: int) -> Any:
        return symmetry_of(text, seq, k, True, lambda: st.SDF.from_mesh(seq.models[k], voxels=VOXELS))

    return {k: found(k) for k in known}
