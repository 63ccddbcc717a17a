# SPDX-License-Identifier: MIT
"""``sdftrack demo``: tracking of a synthetic scene, with figures; needs no data."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.common import (
    ConfigOption,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    ThreadsOption,
    show_table,
    tracker_settings,
)
from sdftrack.cli.progress import progress

DEFAULT_OUT = Path("sdftrack-demo")
STRIP = (
    0.0,
    0.2,
    0.594,
    0.612,
    0.627,
    0.95,
)  # parts of the time that the strip shows; in the middle a hand passes
VOXELS = 160
SEQUENCE, KEPT_FRAMES = "sequence", 30
PART_OF_SEQUENCE = re.compile(
    r"scene_(camera|gt)\.json|(depth|rgb)/\d{6}\.png|mask_visib/\d{6}_\d{6}\.png|models/obj_\d{6}\.ply"
)


def demo(
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    frames: Annotated[int, typer.Option(min=12, help="Number of frames.")] = 240,
    seed: Annotated[int, typer.Option(min=0, help="Random seed of noise and colours.")] = 0,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Synthesise a hand-held duck over a cluttered table, track it by depth, and write a report.

    Then the duck rotates once in front of the camera, and its shape is reconstructed: mesh.ply, mesh.png.
    The first frames are kept in the folder sequence, for trying ``sdftrack track``.
    Without --out the folder is ./sdftrack-demo; files of an earlier demo are replaced.
    """
    import numpy as np

    import sdftrack as st
    from sdftrack._internal.files import write_text
    from sdftrack.cli.demo_turn import WHOLE_TURN, duck_mask, reconstruct_duck
    from sdftrack.evaluation.pose_errors import pose_errors
    from sdftrack.evaluation.tables import text_table
    from sdftrack.recorder import prepare_folder
    from sdftrack.synth.demo_scene import make_scene
    from sdftrack.viz.pictures import plot_run, plot_sdf_slices, save_picture, strip
    from sdftrack.viz.turntable import four_sides

    folder = DEFAULT_OUT if out is None else out
    overwrite = overwrite or (out is None and _ours(folder))
    options = {**tracker_settings(config), "device": device, "threads": threads}
    shown = {round(s * (frames - 1)) for s in STRIP}
    pictures, results, first = [], [], []
    settings = {"command": "demo", "frames": frames, "seed": seed, "voxels": VOXELS, "threads": threads}
    if not _may_replace(folder / SEQUENCE):
        raise FileExistsError(
            f"out: expected no files of others in {folder / SEQUENCE}, which the demo replaces; choose another folder"
        )
    prepare_folder(folder, overwrite)  # a folder that will not do is an error before the work, not after it
    if not quiet:
        print("making the scene and the duck's signed distances", flush=True)
    scene = make_scene(frames, seed, threads)
    sdf = st.SDF.from_mesh(scene.duck, voxels=VOXELS)
    tracker = st.Tracker(sdf, scene.camera, mode="depth", names=["duck"], **options)
    settings["tracker"] = tracker.options.to_dict()
    with st.Recorder(
        folder, scene.camera, sdf, True, overwrite, names=["duck"], settings=settings
    ) as recorder:
        for i, frame in enumerate(progress(scene.frames(), frames, "tracking", quiet)):
            result = tracker.track(frame) if i else tracker.start(frame, poses=[scene.poses[0]])
            recorder.add(frame, result, truth={0: scene.poses[i]})
            if i in shown:
                pictures.append(st.draw(frame, result, sdf, scene.camera, names=["duck"]))
            results.append(result)
            if i < KEPT_FRAMES:
                first.append(frame)
        masks = {0: {0: duck_mask(first[0], sdf, scene.camera, scene.poses[0])}}
        sequence = st.Sequence(
            first, scene.camera, scene.poses[: len(first)], {1: scene.duck}, masks=lambda i: masks.get(i, {})
        )
        shutil.rmtree(folder / SEQUENCE, ignore_errors=True)
        st.save_sequence(folder / SEQUENCE, sequence)
        found = reconstruct_duck(scene, sdf, min(WHOLE_TURN, frames // 4 + 8), threads, quiet)
        found.mesh.save(folder / "mesh.ply")
        save_picture(
            folder / "mesh.png", four_sides(found.mesh, found.pose, threads=threads, min_seen=found.min_seen)
        )
        recorder.wrote("mesh.ply", "mesh.png")
        recorder.note("reconstruction", found.section())
    errors = pose_errors(np.array([r.poses[0] for r in results]), scene.poses)
    save_picture(folder / "frames.png", strip(pictures))
    plot_sdf_slices(folder / "sdf_slices.png", sdf)
    plot_run(folder / "errors.png", errors.translation_m, errors.rotation_rad, results)
    title = f"a hand-held duck, {frames} frames of 640 x 480, by depth alone"
    head, rows = ["", "mean", "median", "max"], [*_rows(errors, results), found.row()]
    write_text(folder / "table.txt", text_table(title, head, rows) + "\n")
    if not quiet:
        show_table(title, head, rows)
        print(f"reconstruction: {found.summary}")
        print(
            f"look at {folder / 'overlay.mp4'}, mesh.png, frames.png, errors.png and sdf_slices.png beside it"
        )
        seq = folder / SEQUENCE
        print(
            f"try it: sdftrack track {seq} --model {seq / 'models/obj_000001.ply'} "
            f"--init {seq / 'mask_visib/000000_000000.png'} --out tracked"
        )


def _rows(errors: Any, results: list[Any]) -> list[list[str]]:
    import numpy as np

    def three(name: str, a: Any, digits: int) -> list[str]:
        return [name, *(f"{v:.{digits}f}" for v in (np.mean(a), np.median(a), np.max(a)))]

    milliseconds = 1e3 * np.array([r.seconds for r in results[1:]])
    status = [str(r.status[0]) for r in results]
    counts = ", ".join(f"{status.count(s)} {s}" for s in ("ok", "weak", "lost"))
    return [
        three("translation error (mm)", 1e3 * errors.translation_m, 2),
        three("rotation error (deg)", np.rad2deg(errors.rotation_rad), 2),
        three("time per frame (ms)", milliseconds, 2),
        ["frames per second", f"{1e3 / milliseconds.mean():.0f}", "", ""],
        [f"status: {counts}", "", "", ""],
    ]


def _ours(folder: Path) -> bool:
    """Whether an earlier demo wrote this folder."""
    try:
        report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        return bool(report["settings"]["command"] == "demo")
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _may_replace(sequence: Path) -> bool:
    """Whether it is not there, or holds nothing but what an earlier demo saved."""
    if sequence.is_symlink() or (sequence.exists() and not sequence.is_dir()):
        return False
    return all(
        path.is_dir() or PART_OF_SEQUENCE.fullmatch(path.relative_to(sequence).as_posix()) is not None
        for path in sequence.rglob("*")
    )
