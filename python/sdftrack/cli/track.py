# SPDX-License-Identifier: MIT
"""``sdftrack track``: poses of known objects in recorded sequences, with video and report."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import typer

import sdftrack as st
from sdftrack._internal.background import read_ahead
from sdftrack.cli.common import ALL_LOST, Common, Holes, Meshes, Sensor, tracker_settings
from sdftrack.cli.init import (
    INIT,
    NAME,
    Init,
    Selection,
    StartError,
    begin,
    error_with_picture,
    parse_inits,
    save_start_picture,
)
from sdftrack.cli.objects import Target, check_symmetry, give_symmetries, load_mesh, load_targets
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.progress import progress
from sdftrack.cli.sources import Frames, Layout, each_sequence, fitting


@dataclass(frozen=True, kw_only=True)
class Track(Meshes, Frames, Layout, Sensor, Common):
    """Track known shapes in recorded sequences.

    Writes poses.csv (BOP), trajectory_<k>.txt (TUM), overlay.mp4 and report.json into DIR; several sequences get
    a folder each. The exit code is 3 where an object is lost in all frames.
    """

    seq: tuple[Path, ...] = argument("Folders of recorded sequences.", "SEQ")
    model: tuple[Path, ...] = option(..., "Mesh; repeat for several objects.", metavar="M.ply")
    count: tuple[int, ...] = option(
        (), "Number of copies of the --model; once, or repeated for every model.", min=1, metavar="N"
    )
    init: tuple[str, ...] = option(
        (),
        "Location of the objects in the first image: ground truth (default); automatic search; a file; "
        "a mask, box or click in the depth image, repeated for every --model.",
        metavar=INIT,
    )
    mode: Literal["auto", "depth", "rgbd", "rgb"] = option(
        "auto", "Depth only; with colour if available; or only the outline in the colour image."
    )
    outline: bool | None = option(
        None,
        "Also use the outline in the colour image, if depth is biased or missing.",
        "--outline/--no-outline",
        show_default="on, except with --mode depth",
    )
    overlay_mesh: tuple[Path, ...] = option(
        (), "Mesh drawn at the pose; the k-th one at the k-th object.", metavar="MESH.ply"
    )
    holes: Holes = option("error", "Open meshes: report an error, or close them.")
    colored: bool = option(
        False, "Use the models' colours, which resolve rotations that their shapes do not."
    )
    symmetry: str = option(
        "none",
        "Symmetries for the errors: from the data set or detected in the shape; none; a BOP file.",
        metavar="auto|none|models_info.json",
        check=check_symmetry,
    )
    scale: Literal["known", "free"] = option(
        "known", "Size of the objects: that of the meshes; or estimated, and the meshes have only their form."
    )
    no_video: bool = option(False, "Do not write overlay.mp4.")

    def models(self) -> list[Path]:
        """The mesh of each object."""
        counts = self.count or (1,) * len(self.model)
        if len(counts) != len(self.model):
            raise Usage(f"expected one per --model ({len(self.model)}), got {len(counts)}", "--count")
        return [path for path, count in zip(self.model, counts, strict=True) for _ in range(count)]

    def inits(self) -> list[Init]:
        """Where the objects are."""
        inits = parse_inits(self.init or ["gt"], len(self.models()))
        if self.mode == "rgb" and any(i.kind not in ("gt", "poses") for i in inits):
            raise Usage(
                "expected gt or a file of poses: --mode rgb uses no depth, so it cannot search for an object",
                "--init",
            )
        return inits

    def check(self) -> None:
        """Usage error for options that do not go together."""
        models, _ = self.models(), self.folder
        if len(self.overlay_mesh) > len(models):
            got = len(self.overlay_mesh)
            raise Usage(f"expected at most one per --model ({len(models)}), got {got}", "--overlay-mesh")
        if self.colored and self.mode == "depth":
            raise Usage("expected --mode rgbd or auto: depth mode does not use colours", "--colored")
        self.inits()
        if self.outline and self.mode == "depth":
            raise Usage(
                "expected --mode rgbd, rgb or auto: depth mode does not use colour images", "--outline"
            )
        if self.scale == "free" and (self.mode == "rgb" or self.overlay_mesh):
            raise Usage(
                "expected known with --mode rgb or --overlay-mesh: a scale is estimated from depth, and only the "
                "--model is enlarged by it",
                "--scale",
            )
        if self.outline is False and self.mode == "rgb":
            raise Usage("expected --outline: --mode rgb uses nothing else", "--no-outline")


def track(job: Track) -> None:
    job.check()
    options = {**tracker_settings(job.config, job.sensor), "device": job.device, "threads": job.threads}
    if job.outline is not None:
        options["outline"] = job.outline
    lost: list[str] = []
    each_sequence(job.seq, job.folder, lambda folder, out: lost.extend(_track_one(folder, out, job, options)))
    if lost:
        for line in lost:
            print(f"sdftrack: {line}", file=sys.stderr)
        raise typer.Exit(ALL_LOST)


def _track_one(folder: Path, out: Path, job: Track, options: dict[str, Any]) -> list[str]:
    """Returns one line of advice for each object that is lost in all frames."""

    with st.open_sequence(folder, **job.opening) as seq:
        numbers = job.numbers(seq, folder)
        targets = load_targets(job.models(), seq, job.unit, job.voxels, job.holes, job.colored)
        give_symmetries(targets, seq, job.symmetry, job.colored)
        tracker = st.Tracker(
            [t.sdf for t in targets],
            seq.camera,
            mode=job.mode,
            names=[t.name for t in targets],
            symmetry=[t.symmetry for t in targets],
            scale="free" if job.scale == "free" else None,
            **options,
        )
        run = _Run(job, folder, out, seq, numbers, targets, tracker)
        meshes = [load_mesh(p, "--overlay-mesh", job.unit) for p in job.overlay_mesh]
        # Before the folder is made: a start that cannot be leaves nothing behind.
        frame, selection = run.begin()
        with run.recorder(meshes) as recorder:
            if selection:
                run.save_start(frame, selection)
            run.follow(frame, recorder)
        return run.tell(selection)


@dataclass
class _Run:
    """The frames of one sequence."""

    job: Track
    folder: Path
    out: Path
    seq: Any
    numbers: range
    targets: list[Target]
    tracker: Any
    results: list[Any] = field(default_factory=list)
    truths: list[dict[int, Any]] = field(default_factory=list)

    def begin(self) -> tuple[Any, Selection]:
        """The first frame, and where objects were looked for in it."""
        frame = fitting(self.seq[self.numbers[0]], self.seq.camera)
        inits = self.job.inits()
        try:
            result, selection = begin(
                self.tracker, inits, self.targets, frame, self.folder, self.numbers[0], self.seq
            )
        except StartError as error:
            raise error_with_picture(
                error, self.out, self.job.overwrite, frame, self.camera_of(frame)
            ) from None
        self.results = [result]
        return frame, selection

    def camera_of(self, frame: Any) -> Any:
        return self.seq.camera if frame.camera is None else frame.camera

    def save_start(self, frame: Any, selection: Selection) -> None:
        camera, shapes = self.camera_of(frame), self.tracker.shapes
        save_start_picture(self.out / NAME, frame, camera, selection, self.results[0], shapes)

    def recorder(self, meshes: list[Any]) -> Any:
        """The files, in a folder that is made now."""

        name = self.folder.resolve().name
        return st.Recorder(
            self.out,
            self.seq.camera,
            self.tracker.shapes,
            not self.job.no_video,
            self.job.overwrite,
            obj_ids=[t.obj_id for t in self.targets],
            names=[t.name for t in self.targets],
            meshes=meshes + [None] * (len(self.targets) - len(meshes)) if meshes else None,
            scene_id=int(name) if name.isdecimal() else 0,
            settings=self.settings(),
            bop_name=_bop_name(self.folder) if self.seq.layout == "bop" else None,
        )

    def follow(self, frame: Any, recorder: Any) -> None:
        """Track and record; `frame` is the first one."""
        from sdftrack.cli.track_summary import StatusCounts

        counts, label = StatusCounts(), self.folder.name or str(self.folder)
        further = read_ahead(fitting(self.seq[i], self.seq.camera) for i in self.numbers[1:])
        with contextlib.closing(further) as frames:
            for i in progress(self.numbers, len(self.numbers), label, self.job.quiet, counts):
                if i != self.numbers[0]:
                    frame = next(frames)
                    self.results.append(self.tracker.track(frame))
                counts.add(self.results[-1])
                known = self.seq.ground_truth.get(i, {})
                truth = {k: known[t.instance] for k, t in enumerate(self.targets) if t.instance in known}
                self.truths.append(truth)
                recorder.add(
                    frame,
                    self.results[-1],
                    im_id=self.seq.ids[i],
                    truth=truth,
                    shapes=list(self.tracker.shapes),
                )
        if self.tracker.color_delay:
            recorder.note("color_delay", dataclasses.asdict(self.tracker.color_delay))
        if self.job.scale == "free":
            recorder.note("scales", [_scale_record(scale) for scale in self.tracker.scales])

    def settings(self) -> dict[str, Any]:
        """Settings for report.json."""
        job, inits = self.job, self.job.inits()
        symmetries = [t.symmetry.to_dict() if t.symmetry else None for t in self.targets]
        return {
            "command": "track",
            "sequence": str(self.folder),
            "layout": self.seq.layout,
            "models": [str(t.path) for t in self.targets],
            "known_models": [t.known for t in self.targets],
            **({} if job.symmetry == "none" else {"symmetries": symmetries}),
            **({} if job.scale == "known" else {"scale": job.scale}),
            "instances": [t.instance for t in self.targets],
            "init": inits[0].text if len(inits) == 1 else [i.text for i in inits],
            "mode": self.tracker.mode,
            "frames": [self.numbers.start, self.numbers.stop, self.numbers.step],
            "voxels": job.voxels,
            "colored": job.colored,
            "threads": job.threads,
            **({} if self.tracker.sensor is None else {"sensor": self.tracker.sensor.to_dict()}),
            "tracker": self.tracker.options.to_dict(),
        }

    def tell(self, selection: Selection) -> list[str]:
        """Print the summary; returns the advice about objects that were never found."""
        from sdftrack.cli.track_summary import lost_throughout, show_summary

        names = [t.name for t in self.targets]
        if not self.job.quiet:
            symmetries = {k: t.symmetry for k, t in enumerate(self.targets) if t.symmetry}
            ids = [self.seq.ids[i] for i in self.numbers]
            show_summary(self.folder, names, self.results, self.truths, ids, self.out, symmetries)
            delay = self.tracker.color_delay
            if delay and delay.significant:
                print(
                    f"{delay}: the two images of a frame are not simultaneous, or the depth camera filters over time"
                )
            for name, scale in zip(names, self.tracker.scales, strict=True):
                if scale is not None:
                    print(f"{name}: {scale}")
            if selection and "lost" in map(str, self.results[0].status):
                print(f"the regions selected as objects in the first frame: {self.out / NAME}")
        return list(lost_throughout(self.folder, names, self.results, [i.kind for i in self.job.inits()]))


def _scale_record(scale: Any) -> dict[str, Any] | None:
    """Of report.json; None: not known."""
    if scale is None or not math.isfinite(scale.sd):
        return None
    return {"scale": scale.scale, "sd": scale.sd, "interval95": list(scale.interval95)}


def _bop_name(folder: Path) -> str:
    """``sdftrack_<dataset>-<split>.csv`` from <dataset>/<split>/<scene>; a single scene is its own data set."""
    scene = folder.resolve()
    split = scene.parent.name
    if scene.name.isdecimal() and split.split("_")[0] in ("train", "val", "test"):
        return f"sdftrack_{scene.parent.parent.name}-{split}.csv"
    return f"sdftrack_{scene.name}-test.csv"
