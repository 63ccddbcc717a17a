# SPDX-License-Identifier: MIT
"""``sdftrack track``: recorded sequences and meshes in, poses, video and report out."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from sdftrack.cli.common import (
    ConfigOption,
    Device,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    ThreadsOption,
    Usage,
    check_layout,
    progress,
    show_table,
    tracker_settings,
)

LATER_INITS = ("auto", "mask", "box:", "click:")
FARTHEST_M = 50.0  # beyond the depth cameras there are
EVENTS = 5  # lines about trouble after the table
Pose = NDArray[np.float64]


@dataclass
class Target:
    """One object to track: its mesh, volume, names and the instance of the ground truth that it is."""

    name: str
    path: Path
    mesh: Any
    sdf: Any
    obj_id: int
    instance: int | None


@dataclass(frozen=True)
class Job:
    """What was asked for, the same for every sequence."""

    models: list[Path]
    init: str
    overlay: list[Path]
    overwrite: bool
    part: slice
    layout: str
    unit: str | None
    voxels: int
    holes: str
    video: bool
    options: dict[str, Any]
    quiet: bool


def track(
    seq: Annotated[list[str], typer.Argument(metavar="SEQ", help="Folders of recorded sequences.")],
    model: Annotated[list[Path], typer.Option(metavar="M.ply", help="Mesh; again for several objects.")],
    init: Annotated[str, typer.Option(metavar="gt|poses.json", help="First poses.")] = "gt",
    mode: Annotated[str, typer.Option(metavar="depth", help="What is tracked.")] = "depth",
    overlay_mesh: Annotated[
        list[Path] | None,
        typer.Option(metavar="MESH.ply", help="Drawn at the pose; the k-th at the k-th object."),
    ] = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    start: Annotated[int, typer.Option(min=0, help="First frame.")] = 0,
    stop: Annotated[int | None, typer.Option(help="Frame to end before.")] = None,
    step: Annotated[int, typer.Option(min=1, help="Every n-th frame.")] = 1,
    layout: Annotated[str, typer.Option(help="auto, bop, tum, open3d, k1 or folders.")] = "auto",
    unit: Annotated[str | None, typer.Option(help="Unit of the meshes: m, mm, cm or in.")] = None,
    voxels: Annotated[
        int, typer.Option(min=8, help="Voxels along the longest side of a model's volume.")
    ] = 200,
    holes: Annotated[
        str, typer.Option(metavar="error|close", help="An open mesh: refuse it, or close it.")
    ] = "error",
    no_video: Annotated[bool, typer.Option("--no-video", help="Leave out overlay.mp4.")] = False,
    config: ConfigOption = None,
    device: DeviceOption = Device.auto,
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Track known shapes through recorded sequences.

    Writes poses.csv (BOP), trajectory_<k>.txt (TUM), overlay.mp4 and report.json into DIR; several sequences get
    a folder each.
    """
    _check_usage(init, mode, unit, holes, out, overlay_mesh, model)
    check_layout(layout)
    assert out is not None
    options = {**tracker_settings(config), "device": device.value, "threads": threads}
    part = slice(start, stop, step)
    job = Job(
        models=model,
        init=init,
        overlay=overlay_mesh or [],
        overwrite=overwrite,
        part=part,
        layout=layout,
        unit=unit,
        voxels=voxels,
        holes=holes,
        video=not no_video,
        options=options,
        quiet=quiet,
    )
    folders = [Path(s) for s in seq]
    failed: list[str] = []
    for folder, target in zip(folders, _folders(folders, out), strict=True):
        try:
            _track_one(folder, target, job)
        except (OSError, ValueError, TypeError, RuntimeError) as error:
            if len(folders) == 1:
                raise
            told = " ".join(str(error).split())
            failed.append(told if told.startswith(str(folder)) else f"{folder}: {told}")
    if failed:
        raise RuntimeError(f"{len(failed)} of {len(folders)} sequences failed: " + "; ".join(failed))


def _check_usage(
    init: str,
    mode: str,
    unit: str | None,
    holes: str,
    out: Path | None,
    overlay: list[Path] | None,
    models: list[Path],
) -> None:
    if out is None:
        raise Usage("expected a folder for the results: --out DIR", "--out")
    if mode not in ("depth", "auto"):
        raise Usage(f"expected depth, got {mode!r}; this version tracks by depth alone", "--mode")
    if init != "gt" and not init.endswith(".json"):
        if init.startswith(LATER_INITS) or init.endswith(".png"):
            raise Usage(
                f"expected gt or a poses.json, got {init!r}; this version starts from known poses", "--init"
            )
        raise Usage(f"expected gt or a poses.json, got {init!r}", "--init")
    if unit not in (None, "m", "mm", "cm", "in"):
        raise Usage(f"expected m, mm, cm or in, got {unit!r}", "--unit")
    if holes not in ("error", "close"):
        raise Usage(f"expected error or close, got {holes!r}", "--holes")
    if overlay and len(overlay) > len(models):
        raise Usage(f"expected at most one per --model ({len(models)}), got {len(overlay)}", "--overlay-mesh")


def _folders(sequences: list[Path], out: Path) -> list[Path]:
    if len(sequences) == 1:
        return [out]
    names: list[str] = []
    for folder in sequences:
        name = folder.resolve().name
        taken = names.count(name)
        names.append(name)
        if taken:
            names[-1] = f"{name}_{taken}"
    return [out / name for name in names]


def _track_one(folder: Path, out: Path, job: Job) -> None:
    import sdftrack as st

    with st.open_sequence(folder, layout=job.layout) as seq:
        numbers = range(len(seq))[job.part]
        if not len(numbers):
            raise ValueError(f"--start, --stop: expected some of the {len(seq)} frames of {folder}, got none")
        targets = load_targets(job.models, seq, job.unit, job.voxels, job.holes)
        poses = _first_poses(job.init, targets, folder, numbers[0], seq)
        meshes: list[Any] = [_loaded(p, "--overlay-mesh", job.unit) for p in job.overlay]
        names, sdfs = [t.name for t in targets], [t.sdf for t in targets]
        tracker = st.Tracker(sdfs, seq.camera, mode="depth", names=names, **job.options)
        results: list[Any] = []
        with st.Recorder(
            out,
            seq.camera,
            sdfs,
            job.video,
            job.overwrite,
            obj_ids=[t.obj_id for t in targets],
            names=names,
            meshes=meshes + [None] * (len(targets) - len(meshes)) if meshes else None,
            scene_id=int(folder.resolve().name) if folder.resolve().name.isdigit() else 0,
            settings=_settings(folder, job, targets, numbers, seq, tracker),
            bop_name=_bop_name(folder) if seq.layout == "bop" else None,
        ) as recorder:
            for i in progress(numbers, len(numbers), folder.name or str(folder), job.quiet):
                frame = fitting(seq[i], seq.camera)
                result = tracker.track(frame) if results else tracker.start(frame, poses=poses)
                truth = seq.ground_truth.get(i, {})
                known = {k: truth[t.instance] for k, t in enumerate(targets) if t.instance in truth}
                recorder.add(frame, result, im_id=seq.ids[i], truth=known)
                results.append(result)
        if not job.quiet:
            _summary(folder, targets, results, numbers, seq, out)


def _settings(
    folder: Path, job: Job, targets: list[Target], numbers: range, seq: Any, tracker: Any
) -> dict[str, Any]:
    """What report.json says about how it was made."""
    return {
        "command": "track",
        "sequence": str(folder),
        "layout": seq.layout,
        "models": [str(t.path) for t in targets],
        "instances": [t.instance for t in targets],
        "init": job.init,
        "mode": "depth",
        "frames": [numbers.start, numbers.stop, numbers.step],
        "voxels": job.voxels,
        "threads": job.options["threads"],
        "tracker": tracker.options.to_dict(),
    }


def fitting(frame: Any, camera: Any) -> Any:
    """The frame, or an unreadable one in its place where its size is not the camera's."""
    from sdftrack.frame import Frame

    lens = frame.camera if frame.camera is not None else camera
    shape = getattr(lens, "depth", lens).shape
    if frame.depth is None or frame.depth.shape == shape:
        return frame
    size = " x ".join(map(str, frame.depth.shape[::-1]))
    return Frame.unreadable(
        f"the depth image is {size}, the camera {shape[1]} x {shape[0]}", frame.timestamp, frame.index
    )


def load_targets(
    models: list[Path], seq: Any, unit: str | None, voxels: int, holes: Any = "error"
) -> list[Target]:
    """Meshes with their volumes (one per distinct file) and the ground truth's instances."""
    import sdftrack as st

    loaded: dict[Path, tuple[Any, Any, int | None]] = {}
    targets: list[Target] = []
    used: set[int] = set()
    foreign: list[Path] = []
    for path in models:
        key = path.resolve()
        if key not in loaded:
            mesh = _loaded(path, "--model", unit)
            own = own_obj_id(mesh, seq, known_unit=unit is not None)
            mesh = mesh if own is None else seq.models[own]
            with about_file("--model", path):
                sdf = st.SDF.from_mesh(mesh, voxels=voxels, holes=holes, unit="m" if unit == "m" else None)
            loaded[key] = (mesh, sdf, own)
        mesh, sdf, own = loaded[key]
        if own is None and key not in foreign:
            foreign.append(key)
        obj_id = own if own is not None else 1 + foreign.index(key)
        instance = _next_instance(own, seq, used)
        name = path.stem if [p.resolve() for p in models].count(key) == 1 else f"{path.stem} {len(targets)}"
        targets.append(Target(name, path, mesh, sdf, obj_id, instance))
    return targets


@contextlib.contextmanager
def about_file(option: str, path: Path) -> Iterator[None]:
    """Errors and warnings inside speak of the option and the file."""

    def told(text: str) -> str:
        text = text.removeprefix("mesh: ")
        return f"{option}: {text}" if str(path) in text else f"{option} {path}: {text}"

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            yield
        except (TypeError, ValueError, FileNotFoundError) as error:
            raise type(error)(told(str(error))) from error
    for warning in caught:
        warnings.warn(told(str(warning.message)), warning.category, stacklevel=3)


def _loaded(path: Path, option: str, unit: str | None) -> Any:
    from sdftrack.mesh import Mesh

    with about_file(option, path):
        return Mesh.load(path, unit=unit)


def own_obj_id(mesh: Any, seq: Any, known_unit: bool = False) -> int | None:
    """obj_id under which the sequence has this mesh; where its unit is not known, also when read in another."""
    from sdftrack.mesh import UNITS

    ratios = [1.0] if known_unit else list(UNITS.values())
    for obj_id, own in seq.models.items():
        if own.vertices.shape == mesh.vertices.shape and np.array_equal(own.faces, mesh.faces):
            size = np.ptp(own.vertices, axis=0).max()
            if any(np.allclose(r * mesh.vertices, own.vertices, rtol=0, atol=1e-5 * size) for r in ratios):
                return int(obj_id)
    return None


def _next_instance(own: int | None, seq: Any, used: set[int]) -> int | None:
    for k, obj_id in enumerate(seq.objects):
        if k not in used and own in (None, obj_id):
            used.add(k)
            return k
    return None


def _first_poses(init: str, targets: list[Target], folder: Path, first: int, seq: Any) -> list[Pose]:
    if init != "gt":
        return read_poses(Path(init), len(targets))
    truth = seq.ground_truth.get(first, {})
    poses = []
    for t in targets:
        if t.instance is None:
            raise ValueError(
                f"--init gt: {folder} has no (further) ground truth for {t.path}; pass --init poses.json"
            )
        if t.instance not in truth:
            known = [i for i, entry in seq.ground_truth.items() if t.instance in entry]
            hint = (
                f"; it is known in frame {known[0]}: --start {known[0]}"
                if known
                else "; pass --init poses.json"
            )
            raise ValueError(f"--init gt: no ground truth of {t.path} in frame {first} of {folder}{hint}")
        poses.append(np.asarray(truth[t.instance], np.float64))
    return poses


def read_poses(path: Path, count: int) -> list[Pose]:
    """First poses from ``{"T_cam_obj": [4x4, ...]}``, in the order of the models."""
    from sdftrack.geometry import rigid
    from sdftrack.io.files import read_json

    if not path.is_file():
        raise FileNotFoundError(f"--init: no such file: {path}")
    value = read_json(path)
    poses = value.get("T_cam_obj") if isinstance(value, dict) else None
    if not isinstance(poses, list):
        raise ValueError(f'--init {path}: expected {{"T_cam_obj": [4x4, ...]}}, in the order of the models')
    if len(poses) != count:
        raise ValueError(
            f"--init {path}: expected T_cam_obj to list one 4x4 matrix per --model ({count}), got {len(poses)}"
        )
    read = []
    for k, p in enumerate(poses):
        try:
            matrix = np.asarray(p, np.float64)
        except (TypeError, ValueError):
            raise ValueError(f"--init {path}: T_cam_obj[{k}]: expected a 4x4 matrix of numbers") from None
        try:
            T = rigid(matrix, f"T_cam_obj[{k}]")
        except (TypeError, ValueError) as error:
            raise ValueError(f"--init {path}: {error}") from None
        _check_place(T, f"--init {path}: T_cam_obj[{k}]")
        read.append(T)
    return read


def _check_place(T: Pose, name: str) -> None:
    distance, z = float(np.linalg.norm(T[:3, 3])), float(T[2, 3])
    if distance > FARTHEST_M:
        raise ValueError(
            f"{name}: the object is {distance:.4g} m away; translations are metres, are these mm?"
        )
    if z <= 0:
        raise ValueError(
            f"{name}: the object is behind the camera (z = {z:.4g} m); expected T_cam_obj, object to camera"
        )


def _bop_name(folder: Path) -> str:
    """``sdftrack_<dataset>-<split>.csv`` from <dataset>/<split>/<scene>; a lone scene is its own data set."""
    scene = folder.resolve()
    split = scene.parent.name
    if scene.name.isdigit() and split.split("_")[0] in ("train", "val", "test"):
        return f"sdftrack_{scene.parent.parent.name}-{split}.csv"
    return f"sdftrack_{scene.name}-test.csv"


def _summary(
    folder: Path, targets: list[Target], results: list[Any], numbers: range, seq: Any, out: Path
) -> None:
    from sdftrack.metrics import pose_error

    rows = []
    for k, t in enumerate(targets):
        status = [str(r.status[k]) for r in results]
        errors = []
        for i, r in zip(numbers, results, strict=True):
            truth = seq.ground_truth.get(i, {})
            if t.instance in truth and str(r.status[k]) in ("ok", "weak"):
                errors.append(pose_error(r.poses[k], truth[t.instance]))
        counts = [str(status.count(s)) for s in ("ok", "weak", "lost", "bad_frame")]
        mean = np.mean(errors, axis=0) if errors else (np.nan, np.nan)
        accuracy = [f"{1e3 * mean[0]:.2f}", f"{np.rad2deg(mean[1]):.2f}"] if errors else ["-", "-"]
        rows.append([t.name, *counts, *accuracy])
    head = ["object", "ok", "weak", "lost", "bad frame", "mean mm", "mean deg"]
    milliseconds = 1e3 * float(np.median([r.seconds for r in results]))
    show_table(f"{folder}: {len(results)} frames, {milliseconds:.2f} ms per frame -> {out}", head, rows)
    events = list(_events([t.name for t in targets], results, [seq.ids[i] for i in numbers]))
    for line in events[:EVENTS]:
        print(line)
    if len(events) > EVENTS:
        print(f"and {len(events) - EVENTS} more, see report.json")


def _events(names: list[str], results: list[Any], ids: list[int]) -> Iterator[str]:
    """Where an object stops being ok: one line for each run of frames with one status."""
    for k, name in enumerate(names):
        begin = 0
        status = [str(r.status[k]) for r in results]
        for i in range(1, len(status) + 1):
            if i < len(status) and status[i] == status[begin]:
                continue
            if status[begin] not in ("ok", "weak"):
                which = f"image {ids[begin]}" if i - begin == 1 else f"images {ids[begin]} to {ids[i - 1]}"
                yield f"{name} {status[begin]}, {which}: {results[begin].reason[k]}"
            begin = i
