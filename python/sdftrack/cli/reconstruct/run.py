# SPDX-License-Identifier: MIT
"""One sequence of ``sdftrack reconstruct``, from its first frame to the output files and the summary."""

from __future__ import annotations

import contextlib
import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import sdftrack as st
from sdftrack._internal.files import write_text
from sdftrack.cli.followed import Followed
from sdftrack.cli.init import Init
from sdftrack.cli.progress import Tell, counted, progress_counter
from sdftrack.cli.reconstruct.place import Place, find_place, load_shape
from sdftrack.cli.sources import first_readable
from sdftrack.io.report_file import tum_line

if TYPE_CHECKING:
    from sdftrack.cli.reconstruct import Reconstruct

NAME = "object"
REFINE_STEPS = 100
TURN_PICTURES, TURN_FPS = 90, 30.0


def reconstruct_one(folder: Path, out: Path, job: Reconstruct, options: dict[str, Any]) -> list[str]:
    """Reconstruct from one sequence; `options` are those of `Reconstructor`. One line of advice if all is lost."""
    with st.open_sequence(folder, **job.opening) as seq:
        recording = Recording.of(folder, out, seq, job, job.place())
        for further, place in job.further():  # checked in advance
            with st.open_sequence(further, **job.opening) as other:
                if other.camera != seq.camera:
                    expected = f"expected the camera of the first recording, {seq.camera!r}"
                    raise ValueError(f"{further}: {expected}, got {other.camera!r}")
                Recording.of(further, further, other, job, place)
        star = st.Reconstructor(
            seq.camera, load_shape(job.shape, job.unit, job.voxel_count()), job.voxel_count(), job.extent,
            job.device, mode=job.mode, threads=job.threads, **options,
        )  # fmt: skip
        # Before the folder is made: a start that cannot be leaves nothing behind.
        recording.results = [star.start(recording.frame, **recording.place.arguments)]
        Run(job, star, recording).go()
        kind = "own" if recording.init is None else recording.init.kind
        if not job.quiet:
            recording.tell_remedies([NAME], [kind])
        return list(recording.lost_throughout([NAME], [kind], after=1))


@dataclass
class Recording(Followed):
    """A recording of the object; `first` is the index of its first frame among those of all recordings."""

    init: Init | None
    place: Place
    first: int = 0

    @classmethod
    def of(cls, folder: Path, out: Path, seq: Any, job: Reconstruct, init: Init | None) -> Recording:
        numbers, frame = first_readable(job.numbers(seq, folder), seq, folder, job.fps)
        place = find_place(init, job.object_, seq, numbers[0], frame, folder)
        return cls(job, folder, out, seq, numbers, frame, init, place)

    @property
    def obj_id(self) -> int:
        k = self.place.instance
        return int(self.seq.objects[k]) if k is not None and k < len(self.seq.objects) else 1

    def true_pose(self, i: int) -> Any:
        return self.seq.ground_truth.get(i, {}).get(self.place.instance)

    def poses_of(self, poses: dict[int, Any]) -> dict[int, Any]:
        """Those of its own frames, of poses of all frames."""
        own = {i - self.first: T for i, T in sorted(poses.items())}
        return {n: T for n, T in own.items() if 0 <= n < len(self.results)}

    def write_poses(self, recorder: Any, poses: dict[int, Any]) -> None:
        times = [r.timestamp for r in self.results]
        if None in times:
            return
        rows = [tum_line(times[n], T, ".9f") + "\n" for n, T in self.poses_of(poses).items()]
        write_text(self.out / "refined_0.txt", "".join(rows) or "\n")
        recorder.wrote("refined_0.txt")


@dataclass
class Run:
    """A run of a reconstructor that was started on the first frame of a recording."""

    job: Reconstruct
    star: Any
    recording: Recording
    refined: Any = None
    later: list[tuple[Recording, Any]] = field(default_factory=list)  # further recordings with their files

    def go(self) -> None:
        job, first = self.job, self.recording
        with (
            self._recorder(first) as recorder,
            contextlib.ExitStack() as stack,
            progress_counter(job.quiet) as tell,
        ):
            try:
                self._follow(first, recorder, tell)
                for number, (folder, init) in enumerate(job.further(), 2):
                    self._extend(folder, init, first.out / f"recording_{number}", stack, tell)
            finally:
                # Also before the refinement, so that nothing that comes later can take it away.
                self._keep(recorder)
                if len(first.results) < len(first.numbers) and not job.quiet:
                    print(
                        f"ended after {len(first.results)} of {len(first.numbers)} frames, kept in {first.out}"
                    )
            if not job.no_refine:
                self._refine(recorder, tell)
            if not job.no_video:
                from sdftrack.io.video import write_video
                from sdftrack.viz.turntable import turning

                # It starts with the view of mesh.png.
                mesh, pose, seen = self.star.mesh(), first.results[0].pose, self.star.options.min_seen
                pictures = turning(mesh, pose, TURN_PICTURES, threads=job.threads, min_seen=seen)
                told = counted(pictures, TURN_PICTURES, "turntable.mp4", tell)
                write_video(first.out / "turntable.mp4", told, TURN_FPS)
                recorder.wrote("turntable.mp4")
        if not job.quiet:
            self._tell()

    def _recorder(self, recording: Recording) -> Any:
        shape = None if self.job.no_video else self.star.cropped_shape()
        about = {"obj_ids": [self.recording.obj_id], "names": [NAME]}
        return recording.recorder(shape, self._settings(recording), **about)

    def _follow(self, recording: Recording, recorder: Any, tell: Tell) -> None:
        def note(result: Any) -> str:
            moved = f"surface moved {1e3 * result.shape_change:.2f} mm"
            return moved if np.isfinite(result.shape_change) else "nothing added"

        def shape() -> Any:
            return None if self.job.no_video else self.star.cropped_shape()

        recording.follow(self.star.track, lambda i: self._truth(recording, i), shape, note, recorder, tell)

    def _truth(self, recording: Recording, i: int) -> dict[int, Any]:
        """The true pose of the reconstruction's object frame, aligned in the first image of the first recording."""
        first = self.recording.true_pose(self.recording.numbers[0])
        here = recording.true_pose(i)
        if first is None or here is None:
            return {}
        return {0: np.asarray(here) @ np.linalg.solve(first, self.recording.results[0].pose)}

    def _extend(self, folder: Path, init: Init | None, out: Path, stack: Any, tell: Tell) -> None:
        seq = stack.enter_context(st.open_sequence(folder, **self.job.opening))
        recording = Recording.of(folder, out, seq, self.job, init)
        result = self.star.resume(recording.frame, **recording.place.arguments)
        if not result.ok:
            raise ValueError(
                f"{folder}: the object was not found reliably in image {recording.ids[0]} ({result.reason[0]}): the "
                "recording was not added; start at a better image (--start), or give --then-init"
            )
        recording.results, recording.first = [result], result.index
        recorder = stack.enter_context(self._recorder(recording))
        self._follow(recording, recorder, tell)
        self.later.append((recording, recorder))

    def _refine(self, recorder: Any, tell: Tell) -> None:
        self.refined = self.star.refine(
            lambda share: tell(round(REFINE_STEPS * share), REFINE_STEPS, "refining")
        )
        self._keep(recorder)
        for recording, files in [(self.recording, recorder), *self.later]:
            recording.write_poses(files, self.refined.poses)

    def _keep(self, recorder: Any) -> None:
        from sdftrack.io.frames import write_color
        from sdftrack.reconstruction.quality import seen_part
        from sdftrack.viz.turntable import four_sides

        job, out, least = self.job, self.recording.out, self.star.options.min_seen
        mesh = self.star.mesh()
        self.star.cropped_shape().save(out / "shape.npz")
        sides = four_sides(mesh, self.recording.results[0].pose, threads=job.threads, min_seen=least)
        write_color(out / "mesh.png", sides)
        recorder.wrote("shape.npz", "mesh.png")
        self._note(recorder, mesh)
        whole = seen_part(mesh, least) if job.seen_only else mesh
        written = whole
        if job.faces is not None:
            # The whole mesh first: a ring cannot be made of four triangles.
            recorder.wrote(*write_mesh_files(out, whole, whole, [], None))
            written = whole.decimated(job.faces)
        recorder.wrote(*write_mesh_files(out, written, whole, job.formats(), job.texture))

    def _note(self, recorder: Any, mesh: Any) -> None:
        quality, volume = self.star.quality(mesh), self.star.shape
        first, refined = self.recording, self.refined
        section: dict[str, Any] = {
            "summary": quality.summary, "seen_share": quality.seen_share, "frames_fused": quality.frames,
            "complete": len(first.results) == len(first.numbers), "voxels": list(volume.values.shape[::-1]),
            "voxel_m": volume.voxel_size, "size_m": np.ptp(mesh.bounds, axis=0),
            "surface_change_m": [r.shape_change for r in first.results], "refined": None,
        }  # fmt: skip
        if refined is not None:
            section["refined"] = {
                "rounds": refined.rounds, "moved_m": refined.moved_m, "turned_rad": refined.turned_rad,
                "misfit_m": refined.misfit_m, "taken": refined.taken,
                "poses": {first.ids[n]: T for n, T in first.poses_of(refined.poses).items()},
            }  # fmt: skip
        recorder.note("reconstruction", section)

    def _settings(self, recording: Recording) -> dict[str, Any]:
        job = self.job
        return {
            "command": "reconstruct",
            "then": [str(folder) for folder in job.then],
            "init": "mask of the sequence" if recording.init is None else recording.init.text,
            "instances": [recording.place.instance],
            "shape": job.shape,
            "mode": job.mode,
            "voxels": job.voxel_count(),
            "faces": job.faces,
            "texture": job.texture,
            "extent": job.extent,
            "refine": not job.no_refine,
            "reconstructor": dataclasses.asdict(self.star.options),
            "tracker": self.star.tracker_options.to_dict(),
        }

    def _tell(self) -> None:
        for r in (self.recording, *(recording for recording, _ in self.later)):
            # In the first image of all, truth and result agree by definition.
            truths = [{}, *r.truths[1:]] if r is self.recording else r.truths
            r.show([NAME], truths, {})
        size = " x ".join(f"{1e3 * s:.0f}" for s in np.ptp(self.star.mesh().bounds, axis=0))
        print(f"{self.star.quality().summary}; it is {size} mm")
        if self.refined is not None and self.refined.moved_m:
            mm, degrees = 1e3 * self.refined.moved_m[0], np.rad2deg(self.refined.turned_rad[0])
            print(
                f"the refinement changed the poses by {mm:.2f} mm and {degrees:.2f} deg (root mean square)"
                if self.refined.taken
                else "the refinement fitted the frames worse and was rejected: poses and shape are unrefined"
            )
        turn = "" if self.job.no_video else ", turntable.mp4"
        print(f"look at {self.recording.out / 'mesh.png'} and mesh.ply{turn}")


def write_mesh_files(
    out: Path, mesh: Any, colors_from: Any, formats: list[str], texture: int | None
) -> list[str]:
    """Write mesh.ply and the other formats; returns their names. Existing files are replaced atomically. `texture`:
    side of a texture, in texels, with the colours of `colors_from`; ignored for .stl and meshes without colours."""
    from sdftrack.mesh.files import TEXTURE_FORMATS, files_beside

    names = []
    for suffix in dict.fromkeys(["ply", *formats]):
        name = f"mesh.{suffix}"
        if texture is None or f".{suffix}" not in TEXTURE_FORMATS or mesh.colors is None:
            mesh.save(out / name)
        else:
            mesh.save(out / name, texture=texture, colors_from=colors_from)
            names += files_beside(name)
        names.append(name)
    return list(dict.fromkeys(names))
