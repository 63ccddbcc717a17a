# SPDX-License-Identifier: MIT
"""``sdftrack track``: poses of known objects in recorded sequences, with video and report."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import sdftrack as st
from sdftrack.cli.common import Common, Holes, Meshes, Sensor, exit_if_lost, tracker_settings
from sdftrack.cli.init import (
    INIT,
    NAME,
    Init,
    StartError,
    begin,
    error_with_picture,
    parse_inits,
    save_start_picture,
)
from sdftrack.cli.objects import Target, check_symmetry, give_symmetries, load_mesh, load_targets
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.progress import progress_counter
from sdftrack.cli.sources import Frames, Layout, Rate, each_sequence, first_readable


@dataclass(frozen=True, kw_only=True)
class Track(Meshes, Rate, Frames, Layout, Sensor, Common):
    """Track known shapes in recorded sequences.

    Writes poses.csv (BOP), trajectory_<k>.txt (TUM), overlay.mp4, report.json and report.html into DIR; several
    sequences get a folder each. The exit code is 3 where an object is lost in all frames.
    """

    seq: tuple[Path, ...] = argument("Folders of recorded sequences.", "SEQ")
    model: tuple[Path, ...] = option(..., "Mesh; repeat for several objects.", metavar="M.ply")
    count: tuple[int, ...] = option(
        (), "Number of copies of the --model; once, or repeated for every model.", min=1, metavar="N"
    )
    init: tuple[str, ...] = option(
        (),
        "Location of the objects in the first image: ground truth (default); the recording's own masks (default "
        "where it has no poses); automatic search; a file; a mask, box or click in the depth image, repeated for every "
        "--model.",
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
        counts = self.count or (1,) * len(self.model)
        if len(counts) != len(self.model):
            raise Usage(f"expected one per --model ({len(self.model)}), got {len(counts)}", "--count")
        return [path for path, count in zip(self.model, counts, strict=True) for _ in range(count)]

    def inits(self, seq: Any = None, first: int = 0) -> list[Init]:
        """--init; its default for a sequence is its masks, where it has no poses but masks in the first frame."""
        masked = seq is not None and not seq.ground_truth and self.mode != "rgb" and seq.masks(first)
        inits = parse_inits(self.init or (["mask"] if masked else ["gt"]), len(self.models()))
        if self.mode == "rgb" and any(i.kind not in ("gt", "poses") for i in inits):
            no_search = "--mode rgb uses no depth, so it cannot search for an object"
            raise Usage(f"expected gt or a file of poses: {no_search}", "--init")
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
            unused = "depth mode does not use colour images"
            raise Usage(f"expected --mode rgbd, rgb or auto: {unused}", "--outline")
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
    exit_if_lost(lost)


def _track_one(folder: Path, out: Path, job: Track, options: dict[str, Any]) -> list[str]:
    from sdftrack.cli.followed import Followed, StatusCounts

    with st.open_sequence(folder, **job.opening) as seq:
        numbers, frame = first_readable(job.numbers(seq, folder), seq, folder, job.fps)
        inits = job.inits(seq, numbers[0])
        if seq.quantization is not None and options.get("sensor") is not None:
            options = {**options, "sensor": options["sensor"].quantized(*seq.quantization)}
        targets = load_targets(job.models(), seq, job.unit, job.voxels, job.holes, job.colored)
        give_symmetries(targets, seq, job.symmetry, job.colored)
        names = [t.name for t in targets]
        tracker = st.Tracker(
            [t.sdf for t in targets], seq.camera, mode=job.mode, names=names,
            symmetry=[t.symmetry for t in targets], scale="free" if job.scale == "free" else None, **options,
        )  # fmt: skip
        meshes = [load_mesh(p, "--overlay-mesh", job.unit) for p in job.overlay_mesh]
        run = Followed(job, folder, out, seq, numbers, frame)
        camera, counts = seq.camera if frame.camera is None else frame.camera, StatusCounts()
        # Before the folder is made: a start that cannot be leaves nothing behind.
        try:
            first, selection = begin(tracker, inits, targets, frame, folder, numbers[0], seq)
        except StartError as error:
            raise error_with_picture(error, out, job.overwrite, frame, camera) from None
        run.results = [first]

        def truth(i: int) -> dict[int, Any]:
            known = seq.ground_truth.get(i, {})
            return {k: known[t.instance] for k, t in enumerate(targets) if t.instance in known}

        recorder = run.recorder(
            tracker.shapes, _settings(job, inits, targets, tracker), obj_ids=[t.obj_id for t in targets],
            names=names, meshes=meshes + [None] * (len(targets) - len(meshes)) if meshes else None,
            bop_name=_bop_name(folder) if seq.layout == "bop" else None,
        )  # fmt: skip
        with recorder, progress_counter(job.quiet) as tell:
            if selection:
                save_start_picture(out / NAME, frame, camera, selection, first, tracker.shapes)
            run.follow(tracker.track, truth, lambda: list(tracker.shapes), counts.add, recorder, tell)
            if tracker.color_delay:
                recorder.note("color_delay", dataclasses.asdict(tracker.color_delay))
            if job.scale == "free":
                recorder.note("scales", [_scale_record(scale) for scale in tracker.scales])
        if not job.quiet:
            run.show(names, run.truths, {k: t.symmetry for k, t in enumerate(targets) if t.symmetry})
            _tell(tracker, names)
            if selection and "lost" in map(str, first.status):
                print(f"the regions selected as objects in the first frame: {out / NAME}")
        kinds = [i.kind for i in inits]
        if not job.quiet:
            run.tell_remedies(names, kinds)
        return list(run.lost_throughout(names, kinds))


def _settings(job: Track, inits: list[Init], targets: list[Target], tracker: Any) -> dict[str, Any]:
    symmetries = [t.symmetry.to_dict() if t.symmetry else None for t in targets]
    return {
        "command": "track", "models": [str(t.path) for t in targets], "known_models": [t.known for t in targets],
        **({} if job.symmetry == "none" else {"symmetries": symmetries}),
        **({} if job.scale == "known" else {"scale": job.scale}), "instances": [t.instance for t in targets],
        "init": inits[0].text if len(inits) == 1 else [i.text for i in inits], "mode": tracker.mode,
        "voxels": job.voxels, "colored": job.colored,
        **({} if tracker.sensor is None else {"sensor": tracker.sensor.to_dict()}),
        "tracker": tracker.options.to_dict(),
    }  # fmt: skip


def _tell(tracker: Any, names: list[str]) -> None:
    delay = tracker.color_delay
    if delay and delay.significant:
        print(
            f"{delay}: the two images of a frame are not simultaneous, or the depth camera filters over time"
        )
    for name, scale in zip(names, tracker.scales, strict=True):
        if scale is not None:
            print(f"{name}: {scale}")


def _scale_record(scale: Any) -> dict[str, Any] | None:
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
