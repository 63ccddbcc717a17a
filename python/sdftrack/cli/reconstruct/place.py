# SPDX-License-Identifier: MIT
"""Where the object of ``sdftrack reconstruct`` is at first, and what is guessed of its shape."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sdftrack as st
from sdftrack.cli.common import floats
from sdftrack.cli.init import Init, parse_init, place_of, shape_of
from sdftrack.cli.objects import about_file, load_mesh
from sdftrack.cli.options import Usage

INIT = "box:x,y,w,h|mask.png|mask|gt"
SHAPE = "sphere:RADIUS|FILE.ply|FILE.npz"
MESHES = (".ply", ".obj", ".glb", ".stl")
LARGEST_BALL_M = 5.0
HOW = "pass --init box:x,y,w,h (pixels of the depth image) or a mask.png of that image"


@dataclass(frozen=True)
class Place:
    """Hint for `Reconstructor.start`, and the index of the object in the sequence, if known."""

    arguments: dict[str, Any]
    instance: int | None


def parse_place(text: str, option: str, forms: str) -> Init:
    init = parse_init(text, forms, option)
    if init.kind not in ("box", "mask", "gt") or init.kind not in forms:
        raise Usage(f"expected {forms.replace('|', ', ')}, got {text!r}", option)
    return init


def known_shape(text: str) -> str:
    if text.startswith("sphere:"):
        _radius(text)
    elif Path(text).suffix.lower() not in (*MESHES, ".npz"):
        raise Usage(
            f"expected {SHAPE.replace('|', ', ')} (meshes: {', '.join(MESHES)}), got {text!r}", "--shape"
        )
    return text


def _radius(text: str) -> float:
    (radius,) = floats(text.partition(":")[2], 1) or (0.0,)
    if not 0 < radius < LARGEST_BALL_M:
        limits = f"above 0 and below {LARGEST_BALL_M:g}, such as sphere:0.08"
        raise Usage(f"expected sphere:RADIUS in metres, {limits}, got {text!r}", "--shape")
    return radius


def load_shape(text: str | None, unit: str | None, voxels: int) -> Any:
    if text is None:
        return None

    if text.startswith("sphere:"):
        return st.SDF.sphere(_radius(text), voxels=voxels)
    path = Path(text)
    if path.suffix.lower() == ".npz":
        with about_file("--shape", path):
            return st.SDF.load(path)
    mesh = load_mesh(path, "--shape", unit)
    with about_file("--shape", path):  # a guess need not be closed
        return st.SDF.from_mesh(mesh, voxels=voxels, holes="close", unit="m" if unit == "m" else None)


def find_place(
    init: Init | None, number: int | None, seq: Any, first: int, frame: Any, folder: Path
) -> Place:
    if number is not None and not 0 <= number < max(len(seq.objects), 1 + max(seq.masks(first), default=-1)):
        known = ", ".join(map(str, sorted({*range(len(seq.objects)), *seq.masks(first)}))) or "none"
        raise Usage(f"expected one of the objects of {folder} ({known}), got {number}", "--object")
    if init is None:
        return _own_mask(number, seq, first, folder)
    if number is None and len(seq.objects) == 1:
        number = 0
    if init.kind == "gt":
        return _true_pose(number, seq, first, folder)
    return Place(place_of(init, shape_of(frame, seq)), number)


def _own_mask(number: int | None, seq: Any, first: int, folder: Path) -> Place:
    masks = {k: m for k, m in seq.masks(first).items() if m.any()}
    if number is None and len(masks) > 1:
        has = f"{folder} has masks of {len(masks)} objects in image {seq.ids[first]}"
        raise Usage(f"{has}: expected which one ({', '.join(map(str, sorted(masks)))})", "--object")
    k = next(iter(masks), None) if number is None else number
    if k not in masks:
        which = "" if number is None else f" of object {number}"
        raise Usage(f"{folder} has no mask{which} for image {seq.ids[first]}: {HOW}", "--init")
    return Place({"mask": masks[k]}, k)


def _true_pose(number: int | None, seq: Any, first: int, folder: Path) -> Place:
    import numpy as np

    truth = seq.ground_truth.get(first, {})
    if number is None and len(truth) == 1:
        number = next(iter(truth))
    if number is None or number not in truth:
        known = ", ".join(map(str, sorted(truth)))
        told = f"expected --object K, one of {known}" if known else HOW
        raise Usage(f"gt: {folder} has no ground truth of it for image {seq.ids[first]}: {told}", "--init")
    return Place({"pose": np.asarray(truth[number], np.float64)}, number)
