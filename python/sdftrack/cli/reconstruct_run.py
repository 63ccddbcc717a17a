# SPDX-License-Identifier: MIT
"""One sequence of ``sdftrack reconstruct``, from its second frame to the output files and the summary."""

from __future__ import annotations

import contextlib
import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack._internal.background import read_ahead
from sdftrack.cli.progress import Tell, progress_counter
from sdftrack.cli.reconstruct_files import (
    write_mesh_files,
    write_refined,
    write_shape,
    write_sides,
    write_turntable,
)
from sdftrack.cli.reconstruct_then import follow_further
from sdftrack.cli.track import fitting
from sdftrack.cli.track_summary import show_summary

__all__ = ["Run"]

NAME = "object"
REFINE_STEPS = 100


@dataclass
class Run:
    """A run of a reconstructor that was started on the first of the frames with `numbers`."""

    folder: Path
    out: Path
    job: Any
    seq: Any
    numbers: range
    star: Any
    instance: int | None  # of the sequence's ground truth, where known
    results: list[Any]
    truths: list[dict[int, Any]] = field(default_factory=list)
    refined: Any = None
    later: list[Any] = field(default_factory=list)  # further recordings
    name: str = NAME

    def go(self, frame: Any) -> None:
        """Track, refine, write, report; results so far are written even if a step fails."""
        import sdftrack as st

        job, seq = self.job, self.seq
        with (
            st.Recorder(
                self.out,
                seq.camera,
                self.star.shape if job.video else None,
                job.video,
                job.overwrite,
                obj_ids=[self.obj_id],
                names=[self.name],
                scene_id=self.scene_id(self.folder),
                settings=self.settings(self.folder, seq, self.numbers, job.init, self.instance),
            ) as recorder,
            contextlib.ExitStack() as stack,
            progress_counter(job.quiet) as tell,
        ):
            try:
                self._follow(frame, recorder, tell)
                for number, further in enumerate(job.then, 2):
                    self.later.append(follow_further(self, further, number, stack, tell))
            finally:
                # Also before the refinement, so that nothing that comes later can take it away.
                self._keep(recorder)
                if len(self.results) < len(self.numbers) and not job.quiet:
                    print(
                        f"ended after {len(self.results)} of {len(self.numbers)} frames, kept in {self.out}"
                    )
            if job.refine:
                self._refine(recorder, tell)
            if job.video:
                recorder.wrote(
                    *write_turntable(
                        self.out,
                        self.star.mesh(),
                        self._first,
                        job.threads,
                        self.star.options.min_seen,
                        tell,
                    )
                )
        if not job.quiet:
            self._tell()

    @property
    def obj_id(self) -> int:
        known = self.instance is not None and self.instance < len(self.seq.objects)
        return int(self.seq.objects[self.instance]) if known else 1

    @staticmethod
    def scene_id(folder: Path) -> int:
        name = folder.resolve().name
        return int(name) if name.isdigit() else 0

    def _follow(self, frame: Any, recorder: Any, tell: Tell) -> None:
        label = self.folder.name or str(self.folder)
        further = read_ahead(fitting(self.seq[i], self.seq.camera) for i in self.numbers[1:])
        with contextlib.closing(further) as frames:
            for n, i in enumerate(self.numbers):
                if n:
                    frame = next(frames)
                    self.results.append(self.star.track(frame))
                self.truths.append(self._truth(i))
                grown = self.star.shape if self.job.video else None
                recorder.add(
                    frame, self.results[n], im_id=self.seq.ids[i], truth=self.truths[n], shapes=grown
                )
                tell(n + 1, len(self.numbers), label, _moved(self.results[n].shape_change))

    def _truth(self, i: int) -> dict[int, Any]:
        """The true pose of the reconstruction's object frame, aligned in the first image."""
        known = self.seq.ground_truth
        first = known.get(self.numbers[0], {}).get(self.instance)
        here = known.get(i, {}).get(self.instance)
        if first is None or here is None:
            return {}
        return {0: np.asarray(here) @ np.linalg.solve(first, self.results[0].pose)}

    def _refine(self, recorder: Any, tell: Tell) -> None:
        def told(share: float) -> None:
            tell(round(REFINE_STEPS * share), REFINE_STEPS, "refining")

        self.refined = self.star.refine(told)
        self._keep(recorder)
        times = [self._time(n) for n in range(len(self.results))]
        own = {n: T for n, T in self.refined.poses.items() if n < len(self.results)}
        recorder.wrote(*write_refined(self.out, own, times))
        for further in self.later:
            further.write_refined(self.refined.poses)

    def _time(self, n: int) -> float:
        stamp = self.results[n].timestamp
        return float(self.seq.ids[self.numbers[n]] if stamp is None else stamp)

    @property
    def _first(self) -> Any:
        """The pose in the first image, which defines the first view of the images."""
        return self.results[0].pose

    def _keep(self, recorder: Any) -> None:
        """Write the files of the current shape."""
        from sdftrack.reconstruction.quality import seen_part

        mesh = self.star.mesh()
        recorder.wrote(*write_shape(self.out, self.star.shape))
        recorder.wrote(
            *write_sides(self.out, mesh, self._first, self.job.threads, self.star.options.min_seen)
        )
        self._note(recorder, mesh)
        whole = seen_part(mesh, self.star.options.min_seen) if self.job.seen_only else mesh
        written = whole
        if self.job.faces is not None:
            # The whole mesh first: a ring cannot be made of four triangles.
            recorder.wrote(*write_mesh_files(self.out, whole, whole, [], None))
            written = whole.decimated(self.job.faces)
        recorder.wrote(*write_mesh_files(self.out, written, whole, self.job.formats, self.job.texture))

    def _note(self, recorder: Any, mesh: Any) -> None:
        """The section of report.json about the shape."""
        quality, volume = self.star.quality(mesh), self.star.shape
        section: dict[str, Any] = {
            "summary": quality.summary,
            "seen_share": quality.seen_share,
            "frames_fused": quality.frames,
            "complete": len(self.results) == len(self.numbers),
            "voxels": list(volume.values.shape[::-1]),
            "voxel_m": volume.voxel_size,
            "size_m": np.ptp(mesh.bounds, axis=0),
            "surface_change_m": [r.shape_change for r in self.results],
            "refined": None,
        }
        if self.refined is not None:
            section["refined"] = {
                "rounds": self.refined.rounds,
                "moved_m": self.refined.moved_m,
                "turned_rad": self.refined.turned_rad,
                "misfit_m": self.refined.misfit_m,
                "taken": self.refined.taken,
                "poses": {
                    self.seq.ids[self.numbers[n]]: T
                    for n, T in sorted(self.refined.poses.items())
                    if n < len(self.results)
                },
            }
        recorder.note("reconstruction", section)

    def settings(
        self, folder: Path, seq: Any, numbers: range, init: Any, instance: int | None
    ) -> dict[str, Any]:
        """For the report of a recording."""
        job = self.job
        return {
            "command": "reconstruct",
            "sequence": str(folder),
            "then": [str(further.folder) for further in job.then],
            "layout": seq.layout,
            "init": "mask of the sequence" if init is None else init.text,
            "instances": [instance],
            "shape": job.shape,
            "mode": job.mode,
            "frames": [numbers.start, numbers.stop, numbers.step],
            "voxels": job.voxels,
            "faces": job.faces,
            "texture": job.texture,
            "extent": job.extent,
            "refine": job.refine,
            "threads": job.threads,
            "reconstructor": dataclasses.asdict(self.star.options),
            "tracker": self.star.tracker_options.to_dict(),
        }

    def _tell(self) -> None:
        ids = [self.seq.ids[i] for i in self.numbers]
        truths = [{}, *self.truths[1:]]  # in the first image the two agree by definition
        show_summary(self.folder, [self.name], self.results, truths, ids, self.out)
        for further in self.later:
            further.tell(self.name)
        size = " x ".join(f"{1e3 * s:.0f}" for s in np.ptp(self.star.mesh().bounds, axis=0))
        print(f"{self.star.quality().summary}; it is {size} mm")
        if self.refined is not None and self.refined.moved_m:
            mm, degrees = 1e3 * self.refined.moved_m[0], np.rad2deg(self.refined.turned_rad[0])
            print(
                f"the refinement changed the poses by {mm:.2f} mm and {degrees:.2f} deg (root mean square)"
                if self.refined.taken
                else "the refinement fitted the frames worse and was rejected: poses and shape are unrefined"
            )
        print(f"look at {self.out / 'mesh.png'} and mesh.ply" + (", turntable.mp4" if self.job.video else ""))


def _moved(change_m: float) -> str:
    return f"surface moved {1e3 * change_m:.2f} mm" if np.isfinite(change_m) else "nothing added"
