# SPDX-License-Identifier: MIT
"""``sdftrack demo``: tracking of a synthetic scene, with figures; needs no data."""

from __future__ import annotations

import re
import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import sdftrack as st
from sdftrack._internal.files import write_text
from sdftrack.cli.common import Common, show_table, text_table, tracker_settings
from sdftrack.cli.options import option
from sdftrack.cli.progress import progress

DEFAULT_OUT = Path("sdftrack-demo")
# Parts of the time that the strip shows; in the middle a hand passes.
STRIP = (0.0, 0.2, 0.594, 0.612, 0.627, 0.95)
VOXELS = 160
SEQUENCE, KEPT_FRAMES = "sequence", 30
PART_OF_SEQUENCE = re.compile(
    r"scene_(camera|gt)\.json|(depth|rgb)/\d{6}\.png|mask_visib/\d{6}_\d{6}\.png|models/obj_\d{6}\.ply"
)
TURN_VOXELS, ROUNDS = 128, 1  # half a millimetre on the mean, in a quarter of the demo's minute
WHOLE_TURN = 60  # frames
PLACE_M, TILT_RAD = (0.0, -0.05, 0.22), 0.6  # over the table
ON_DUCK_M = 0.02

if TYPE_CHECKING:  # `--help` needs no numpy
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Demo(Common):
    """Synthesise a hand-held duck over a cluttered table, track it by depth, and write a report.

    Then the duck rotates once in front of the camera, and its shape is reconstructed: mesh.ply, mesh.png.
    The first frames are kept in the folder sequence, for trying ``sdftrack track``.
    Without --out the folder is ./sdftrack-demo; files of an earlier demo are replaced.
    """

    frames: int = option(240, "Number of frames.", min=12)
    seed: int = option(0, "Random seed of noise and colours.", min=0)


def demo(job: Demo) -> None:
    from sdftrack.io.out_folder import earlier_files
    from sdftrack.synth.demo_scene import make_scene

    folder = DEFAULT_OUT if job.out is None else job.out
    earlier = set() if job.out is not None else earlier_files(folder, "report.json", "demo")
    job = replace(job, out=folder, overwrite=job.overwrite or bool(earlier))
    options = {**tracker_settings(job.config), "device": job.device, "threads": job.threads}
    if not _may_replace(folder / SEQUENCE):
        raise FileExistsError(
            f"out: expected no files of others in {folder / SEQUENCE}, which the demo replaces; choose another folder"
        )
    job.make_out()  # now, not after the work
    if not job.quiet:
        print("making the scene and the duck's signed distances", flush=True)
    scene = make_scene(job.frames, job.seed, job.threads)
    sdf = st.SDF.from_mesh(scene.duck, voxels=VOXELS)
    tracker = st.Tracker(sdf, scene.camera, mode="depth", names=["duck"], **options)
    settings = {
        "command": "demo", "frames": job.frames, "seed": job.seed, "voxels": VOXELS, "threads": job.threads,
        "tracker": tracker.options.to_dict(),
    }  # fmt: skip
    with st.Recorder(
        folder, scene.camera, sdf, True, job.overwrite, names=["duck"], settings=settings
    ) as recorder:
        results, pictures, first = _track(job, scene, sdf, tracker, recorder)
        # With the mask of the duck in the first frame.
        masks = {0: {0: duck_mask(first[0], sdf, scene.camera, scene.poses[0])}}
        poses = scene.poses[: len(first)]
        own = st.Sequence(first, scene.camera, poses, {1: scene.duck}, masks=lambda i: masks.get(i, {}))
        shutil.rmtree(folder / SEQUENCE, ignore_errors=True)
        st.save_sequence(folder / SEQUENCE, own)
        row, summary = _reconstruct(job, scene, sdf, recorder)
    _report(job, scene, sdf, results, pictures, row, summary)


def _track(
    job: Demo, scene: Any, sdf: Any, tracker: Any, recorder: Any
) -> tuple[list[Any], list[Any], list[Any]]:
    shown = {round(s * (job.frames - 1)) for s in STRIP}
    results: list[Any] = []
    pictures, first = [], []
    for i, frame in enumerate(progress(scene.frames(), job.frames, "tracking", job.quiet)):
        result = tracker.track(frame) if i else tracker.start(frame, poses=[scene.poses[0]])
        recorder.add(frame, result, truth={0: scene.poses[i]})
        if i in shown:
            pictures.append(st.draw(frame, result, sdf, scene.camera, names=["duck"]))
        results.append(result)
        if i < KEPT_FRAMES:
            first.append(frame)
    return results, pictures, first


def _report(
    job: Demo, scene: Any, sdf: Any, results: list[Any], pictures: list[Any], row: list[str], summary: str
) -> None:
    import numpy as np

    from sdftrack.io.frames import write_color
    from sdftrack.viz.plots import plot_run, plot_sdf_slices, strip, write_plots

    folder = job.folder
    errors = st.metrics.pose_error(np.array([r.poses[0] for r in results]), scene.poses)
    write_color(folder / "frames.png", strip(pictures))
    drawn = {"errors.png": lambda: plot_run(*errors, results), "sdf_slices.png": lambda: plot_sdf_slices(sdf)}
    plots = write_plots(folder, drawn)
    milliseconds = 1e3 * np.array([r.seconds for r in results[1:]])
    status = [str(r.status[0]) for r in results]
    counts = ", ".join(f"{status.count(s)} {s}" for s in ("ok", "weak", "lost"))
    title = f"a hand-held duck, {job.frames} frames of 640 x 480, by depth alone"
    head = ["", "mean", "median", "max"]
    rows = [
        _row("translation error (mm)", 1e3 * errors[0]), _row("rotation error (deg)", np.rad2deg(errors[1])),
        _row("time per frame (ms)", milliseconds),
        ["frames per second", f"{1e3 / milliseconds.mean():.0f}", "", ""], [f"status: {counts}", "", "", ""], row,
    ]  # fmt: skip
    write_text(folder / "table.txt", text_table(title, head, rows) + "\n")
    if job.quiet:
        return
    show_table(title, head, rows)
    print(f"reconstruction: {summary}")
    print(f"look at {folder / 'overlay.mp4'}, and beside it {', '.join(['mesh.png', 'frames.png', *plots])}")
    seq = folder / SEQUENCE
    print(
        f"try it: sdftrack track {seq} --model {seq / 'models/obj_000001.ply'} "
        f"--init {seq / 'mask_visib/000000_000000.png'} --out tracked"
    )


def _row(name: str, values: Any) -> list[str]:
    import numpy as np

    return [name, *(f"{v:.2f}" for v in (np.mean(values), np.median(values), np.max(values)))]


def _may_replace(sequence: Path) -> bool:
    """Whether it is not there, or holds nothing but what an earlier demo saved."""
    if sequence.is_symlink() or (sequence.exists() and not sequence.is_dir()):
        return False
    return all(
        path.is_dir() or PART_OF_SEQUENCE.fullmatch(path.relative_to(sequence).as_posix()) is not None
        for path in sequence.rglob("*")
    )


def _reconstruct(job: Demo, scene: Any, sdf: Any, recorder: Any) -> tuple[list[str], str]:
    """Rotate the duck once, alone, and reconstruct it; returns a row of the table, and a sentence."""
    import numpy as np

    from sdftrack.io.frames import write_color
    from sdftrack.synth.demo_scene import alone
    from sdftrack.viz.turntable import four_sides

    frames = min(WHOLE_TURN, job.frames // 4 + 8)
    # Round the duck's upright axis, tilted up and down so that its underside is seen too.
    a = 2 * np.pi * np.arange(frames) / WHOLE_TURN
    turned = alone(scene, PLACE_M, np.stack([TILT_RAD * np.sin(2 * a), np.zeros(frames), a], axis=1))
    star = st.Reconstructor(scene.camera, voxels=TURN_VOXELS, threads=job.threads)
    results: list[Any] = []
    for i, frame in enumerate(progress(turned.frames(), len(turned), "reconstructing", job.quiet)):
        mask = None if i else duck_mask(frame, sdf, scene.camera, turned.poses[0])
        results.append(star.track(frame) if i else star.start(frame, mask=mask))
    star.refine(rounds=ROUNDS)
    mesh, quality, pose, min_seen = star.mesh(), star.quality(), results[0].pose, star.options.min_seen
    T_duck_obj = np.linalg.solve(turned.poses[0], pose)
    assert mesh.seen is not None
    seen = mesh.vertices[mesh.seen >= min_seen]
    off_m = np.abs(sdf(seen @ T_duck_obj[:3, :3].T + T_duck_obj[:3, 3]))
    mesh.save(job.folder / "mesh.ply")
    write_color(job.folder / "mesh.png", four_sides(mesh, pose, threads=job.threads, min_seen=min_seen))
    recorder.wrote("mesh.ply", "mesh.png")
    section = {
        "summary": quality.summary, "seen_share": quality.seen_share, "mean_distance_m": float(off_m.mean()),
        "largest_distance_m": float(off_m.max()), "frames": frames, "voxels": TURN_VOXELS,
        "seconds_per_frame": float(np.mean([r.seconds for r in results[1:]])), "T_duck_obj": T_duck_obj,
    }  # fmt: skip
    recorder.note("reconstruction", section)
    return _row("reconstructed surface (mm)", 1e3 * off_m), quality.summary


def duck_mask(frame: Any, sdf: Any, camera: Any, T: Array) -> NDArray[np.bool_]:
    import numpy as np

    depth = sdf.render(camera, T)[0]
    return (depth > 0) & (np.abs(frame.depth - depth) < ON_DUCK_M)
