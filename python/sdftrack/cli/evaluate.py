# SPDX-License-Identifier: MIT
"""``sdftrack evaluate``: comparison of recorded results with a sequence's ground truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

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
    ThreadsOption,
    check_cpu_only,
    opening,
    show_table,
)
from sdftrack.cli.symmetries import check_symmetry, symmetries_of


def evaluate(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="Output folder of sdftrack track or reconstruct.")
    ],
    seq: Annotated[str, typer.Argument(metavar="SEQ", help="The sequence with ground truth.")],
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    layout: LayoutOption = "auto",
    depth_topic: DepthTopicOption = None,
    color_topic: ColorTopicOption = None,
    symmetry: Annotated[
        str,
        typer.Option(
            help="recorded (from the results, else from the data set), auto (else detected in the shape), none, or a "
            "models_info.json."
        ),
    ] = "recorded",
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Compare results with ground truth: a table, plots, result.json (default: in DIR/evaluation)."""
    import sdftrack as st
    from sdftrack._internal.files import write_json, write_text
    from sdftrack.evaluation.report import (
        HEAD,
        compare,
        plot_errors,
        plot_trajectories,
        read_results,
        table_rows,
    )
    from sdftrack.evaluation.tables import text_table
    from sdftrack.recorder import prepare_folder

    source = opening(layout, depth_topic, color_topic)
    check_cpu_only(config, device)
    if symmetry != "recorded":
        check_symmetry(symmetry)
    report = read_results(directory)
    with st.open_sequence(seq, **source) as sequence:
        objects = [int(o["obj_id"]) for o in report["frames"][0]["objects"]] if report["frames"] else []
        known = None if symmetry == "recorded" else symmetries_of(symmetry, sequence, objects)
        scores = compare(report, sequence, known)
    out = directory / "evaluation" if out is None else out
    prepare_folder(out, overwrite)
    title = f"{directory} against {seq}"
    rows = table_rows(scores)
    write_text(out / "table.txt", text_table(title, HEAD, rows) + "\n")
    plot_errors(scores, out / "errors.png")
    plot_trajectories(scores, out / "trajectory.png")
    write_json(
        out / "result.json",
        {
            "version": st.__version__,
            "results": str(directory),
            "sequence": str(seq),
            "objects": [s.to_dict() for s in scores],
        },
    )
    if not quiet:
        show_table(title, HEAD, rows)
        for score in scores:
            print(score.told())
        print(f"written to {out}")
