# SPDX-License-Identifier: MIT
"""The options of ``sdftrack reconstruct``, and what they exclude."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import typer

from sdftrack._internal.extras import need
from sdftrack.cli.common import Common, Unit, above_zero, exit_if_lost, reconstructor_settings
from sdftrack.cli.init import Init
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.reconstruct.place import INIT, SHAPE, known_shape, parse_place
from sdftrack.cli.sources import Frames, Layout, Rate, each_sequence

__all__ = ["Reconstruct", "reconstruct"]

FORMATS = ("ply", "obj", "glb", "stl")
THEN_INIT = "box:x,y,w,h|mask.png|mask"


@dataclass(frozen=True, kw_only=True)
class Reconstruct(Rate, Frames, Layout, Common):
    """Reconstruct an unknown rigid object from recorded sequences while tracking it.

    Writes into DIR the mesh (mesh.ply, metres), the shape (shape.npz), and
    mesh.png and turntable.mp4, which show it with unobserved surface in violet.

    Also the files of track: poses.csv (BOP) and trajectory_0.txt (TUM) with
    the poses estimated frame by frame, ground_truth_0.txt where known (in the mesh's frame), overlay.mp4, report.json,
    report.html. refined_0.txt has the poses that belong to the refined mesh.

    Ctrl-C ends a sequence early and keeps the results so far. Several sequences get a folder each; recordings of --then
    continue the shape of the first, and their poses go to DIR/recording_2, and so on. The exit code is 3 where the
    object is lost in all frames after the first.
    """

    seq: tuple[Path, ...] = argument("Folders of recorded sequences.", "SEQ")
    init: str | None = option(
        None,
        "Location of the object in the first image: a box or a mask in the depth image, or the true pose of "
        "--shape. Default, and mask: the sequence's own mask.",
        metavar=INIT,
    )
    mask: Path | None = option(
        None, "Mask of the object in the first depth image; the same as --init mask.png.", metavar="mask.png"
    )
    then: tuple[Path, ...] = option(
        (),
        "Another recording of the same object, on another side, that extends its shape; may be repeated.",
        metavar="SEQ",
    )
    then_init: tuple[str, ...] = option(
        (),
        "Location of the object in the first image of each --then; mask (default): the sequence's own.",
        metavar=THEN_INIT,
    )
    object_: int | None = option(
        None, "Index of the object among those of the sequence, from 0.", min=0, metavar="K"
    )
    shape: str | None = option(
        None,
        "Initial shape, metres: a ball, a mesh of a similar object, or a shape.npz. Default: a ball as wide "
        "as the object.",
        metavar=SHAPE,
        check=known_shape,
    )
    unit: Unit | None = option(None, "Unit of the --shape mesh.")
    quality: Literal["quick", "normal", "fine"] | None = option(
        None, "Voxels along each side of the volume: 96, 200 (the default) or 300."
    )
    voxels: int | None = option(
        None, "Number of voxels instead of --quality; 20 bytes each.", min=16, max=512
    )
    extent: float | None = option(
        None,
        "Side of the volume, m. Default: 1.8 times the object's width.",
        metavar="M",
        check=above_zero("metres", 10),
    )
    mode: Literal["auto", "depth", "rgbd"] = option("auto", "Depth only, or with colour if available.")
    no_refine: bool = option(False, "Do not refine poses and shape over all frames at the end.")
    format: str = option("ply", "Mesh file formats; mesh.ply is always written.", metavar="ply,obj,glb,stl")
    seen_only: bool = option(False, "Omit guessed surface from the mesh files; shape.npz contains it.")
    faces: int | None = option(
        None, "Maximum number of triangles in the mesh files. Extra: export.", min=4, max=2**31 - 1, metavar="N",
    )  # fmt: skip
    texture: int | None = option(
        None,
        "Store colours in a texture of N x N texels; with --faces, those of the full mesh. Extra: export.",
        min=16,
        max=8192,
        metavar="N",
    )
    evolution: Literal["ours", "printed"] | None = option(
        None,
        "Evolution of the shape: ours, or as printed in the thesis, with its tracker. Default: as in "
        "--config, else ours.",
    )
    no_video: bool = option(False, "Do not write overlay.mp4 and turntable.mp4.")

    def place(self) -> Init | None:
        """Where the object is in the first image; None: in the sequence's own mask."""
        if self.mask is not None and self.init is not None:
            raise Usage("expected one of --init and --mask, got both", "--mask")
        init = self.init or "mask" if self.mask is None else str(self.mask)
        place = None if init == "mask" else parse_place(init, "--init", INIT)
        if place is not None and place.kind == "gt" and self.shape is None:
            raise Usage(
                "gt: requires --shape with a known true pose in the sequence; otherwise omit --init", "--init"
            )
        return place

    def further(self) -> list[tuple[Path, Init | None]]:
        if self.then and len(self.seq) != 1:
            raise Usage(f"expected one SEQ with it, got {len(self.seq)}", "--then")
        if self.then_init and len(self.then_init) != len(self.then):
            got = len(self.then_init)
            raise Usage(f"expected one for each --then ({len(self.then)}), got {got}", "--then-init")
        texts = self.then_init or ("mask",) * len(self.then)
        places = [None if t == "mask" else parse_place(t, "--then-init", THEN_INIT) for t in texts]
        return list(zip(self.then, places, strict=True))

    def voxel_count(self) -> int:
        from sdftrack.reconstruction.arguments import VOXELS

        if self.voxels is None:
            return VOXELS[self.quality or "normal"]
        if self.quality is not None:
            raise Usage("expected one of --quality and --voxels, got both", "--quality")
        return self.voxels

    def formats(self) -> list[str]:
        names = [name.strip().lower().removeprefix(".") for name in self.format.split(",")]
        if any(name not in FORMATS for name in names):
            raise Usage(
                f"expected some of {', '.join(FORMATS)} with commas between, got {self.format!r}", "--format"
            )
        return names

    def options(self) -> dict[str, Any]:
        """Keyword arguments of `Reconstructor`; usage error for options that do not go together."""
        options = reconstructor_settings(self.config, self.evolution)
        evolution = options.get("evolution") or getattr(options.get("options"), "evolution", "ours")
        if self.further() and evolution == "printed":
            only_one = "which supports only one recording"
            raise Usage(f"expected the default evolution with it, got printed, {only_one}", "--then")
        return options


def reconstruct(job: Reconstruct) -> None:
    out = job.folder
    # What is missing is told now, not after all frames.
    for value, package in ((job.faces, "fast_simplification"), (job.texture, "xatlas")):
        if value is not None:
            need(package, "export")
    job.place(), job.further(), job.voxel_count(), job.formats()
    options = job.options()
    lost: list[str] = []

    def work(folder: Path, target: Path) -> None:
        from sdftrack.cli.reconstruct.run import reconstruct_one

        lost.extend(reconstruct_one(folder, target, job, options))

    # What a sequence's own masks or truths do not have is a usage error of that sequence alone.
    each_sequence(job.seq, out, work, typer.BadParameter)
    exit_if_lost(lost)
