# SPDX-License-Identifier: MIT
"""What `sdftrack live` was asked for: options that belong together, checked before a camera is opened."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

from sdftrack.cli.common import Usage, refuse_cuda
from sdftrack.cli.init import Init, parse_init, parse_inits
from sdftrack.cli.live_camera import is_webcam
from sdftrack.cli.sequences import MODES, check_unit

__all__ = ["INIT", "Task"]

INIT = "auto|view|poses.json|mask.png|box:x,y,w,h|click:x,y"


@dataclass(frozen=True)
class Task:
    """What is followed, and how it starts.

    Attributes
    ----------
    models : list of Path
        Meshes of known shapes; empty for the other two.
    reconstruct, contour : bool
        An unknown shape, or an outline in the colour image.
    mode : str
        "auto", "depth", "rgbd" or "rgb"; of a webcam always "rgb".
    inits : list of Init or None
        None: shown by the user on the page.
    """

    models: list[Path]
    reconstruct: bool
    contour: bool
    mode: str
    inits: list[Init] | None = None

    @classmethod
    def of(
        cls,
        models: list[Path],
        reconstruct: bool,
        contour: bool,
        mode: str,
        address: str,
        init: list[str] | None,
        viewer: bool,
    ) -> Task:
        """Usage error for options that exclude each other."""
        if bool(models) + reconstruct + contour != 1:
            raise Usage("expected either --model M.ply (repeatable), --reconstruct or --contour", "--model")
        if mode not in (*MODES, "rgb"):
            raise Usage(f"expected one of {', '.join((*MODES, 'rgb'))}, got {mode!r}", "--mode")
        task = cls(models, reconstruct, contour, mode)
        if contour and mode != "auto":
            raise Usage(
                f"expected no --mode with --contour, which follows colours alone, got {mode}", "--mode"
            )
        if reconstruct and mode == "rgb":
            raise Usage("expected auto, depth or rgbd: a reconstruction needs depth, got rgb", "--mode")
        if is_webcam(address) and not contour:
            task = task._without_depth()
        return dataclasses.replace(task, inits=task._inits(init, viewer))

    def check(
        self,
        unit: str | None,
        seconds: float | None,
        device: str,
        streams: list[str],
        webcam: bool,
        intrinsics: Path | None,
    ) -> None:
        """Usage error for what does not go with this."""
        check_unit(unit)
        if seconds == 0:
            raise Usage("expected a time above 0 s, got 0", "--seconds")
        if not self.models:
            refuse_cuda(device)
        if self.contour and streams:
            raise Usage("expected none with --contour: an outline has no pose to send", "--stream")
        if intrinsics is not None and not webcam:
            raise Usage(
                "expected --camera webcam:... with it: other cameras know their intrinsics", "--intrinsics"
            )

    def _without_depth(self) -> Task:
        if self.reconstruct:
            raise Usage(
                "expected a camera with depth, got a webcam: a shape cannot be reconstructed from colour alone",
                "--reconstruct",
            )
        if self.mode not in ("auto", "rgb"):
            raise Usage(
                f"expected rgb: a webcam has colour alone, and mode {self.mode} needs depth", "--mode"
            )
        return dataclasses.replace(self, mode="rgb")

    def _inits(self, init: list[str] | None, viewer: bool) -> list[Init] | None:
        if self.mode == "rgb":
            return self._poses(init)
        texts = init or (["auto"] if self.models else ["view"])
        if texts == ["view"]:
            if not viewer:
                raise Usage(
                    "expected box:x,y,w,h, or a mask.png: without a page nobody can show the object", "--init"
                )
            return None
        if not self.models:
            what, image = ("--contour", "colour") if self.contour else ("--reconstruct", "depth")
            inits = [parse_init(text, INIT, image=image) for text in texts]
            if len(inits) != 1 or inits[0].kind not in ("box", "mask"):
                raise Usage(
                    f"expected view, box:x,y,w,h or mask.png with {what}, got {' '.join(texts)}", "--init"
                )
            return inits
        if "gt" in texts or "view" in texts:
            raise Usage(f"expected {INIT.replace('|', ', ')}, got {' '.join(texts)}", "--init")
        return parse_inits(texts, len(self.models))

    def _poses(self, init: list[str] | None) -> list[Init]:
        inits = [parse_init(text, INIT) for text in init or [] if text != "view"]
        if len(inits) != 1 or inits[0].kind != "poses":
            raise Usage(
                "expected a file of start poses, --init poses.json: without depth there is no search for an object, "
                f"got {' '.join(init or ['none'])}",
                "--init",
            )
        return inits
