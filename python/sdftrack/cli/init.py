# SPDX-License-Identifier: MIT
"""``--init``: where objects are in the first image, as arguments of `Tracker.start`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import sdftrack as st
from sdftrack._internal.text_files import read_json
from sdftrack.cli.common import floats
from sdftrack.cli.objects import Target
from sdftrack.cli.options import Usage

if TYPE_CHECKING:  # `--help` needs no numpy
    import numpy as np
    from numpy.typing import NDArray

FARTHEST_M = 50.0  # beyond the depth cameras there are
INIT = "gt|auto|mask|poses.json|mask.png|box:x,y,w,h|click:x,y"


@dataclass(frozen=True)
class Init:
    """One --init: "gt", "auto", "own" (the recording's masks), "poses", "mask", "box" or "click"; numbers are px."""

    kind: str
    text: str
    numbers: tuple[float, ...] = ()

    @property
    def option(self) -> str:
        return f"--init {self.text}"


def parse_inits(texts: Sequence[str], models: int) -> list[Init]:
    """Parse --init options; gt, auto, mask and a poses.json apply to all models, others to one each, in order."""
    inits = [parse_init(text) for text in texts]
    kinds = {i.kind for i in inits}
    if kinds & {"gt", "auto", "own", "poses"}:
        if len(inits) > 1:
            raise Usage(f"expected only {inits[0].text}, or a mask, box or click per --model", "--init")
        return inits
    if len(inits) != models:
        raise Usage(f"expected one mask, box or click per --model ({models}), got {len(inits)}", "--init")
    if "box" in kinds and len(kinds) > 1:
        raise Usage("expected only boxes, or masks and clicks, got both", "--init")
    return inits


def parse_init(text: str, known: str = INIT, option: str = "--init", image: str = "depth") -> Init:
    """Parse the value of an option; the usage error for an invalid one lists the `known` forms. `image`: "depth" or
    "colour", the image in whose pixels places are."""
    if text in ("gt", "auto"):
        return Init(text, text)
    if text == "mask" and "mask" in known.split("|"):
        return Init("own", text)
    kind, colon, values = text.partition(":")
    for name, wanted in (("box", "x,y,w,h"), ("click", "x,y")):
        if colon and kind == name:
            numbers = floats(values, len(wanted.split(",")))
            if not numbers:
                raise Usage(f"expected {name}:{wanted} in pixels of the {image} image, got {text!r}", option)
            if name == "box" and min(numbers[2:]) <= 0:
                raise Usage(f"expected a width and a height above 0, got {text!r}", option)
            return Init(name, text, numbers)
    kinds = {".json": "poses", **dict.fromkeys((".png", ".bmp", ".tif", ".tiff", ".pgm"), "mask")}
    found = kinds.get(Path(text).suffix.lower())
    if found is None:
        raise Usage(f"expected {known.replace('|', ', ')}, got {text!r}", option)
    return Init(found, text)


def begin(
    tracker: Any, inits: list[Init], targets: list[Target], frame: Any, folder: Path, first: int, seq: Any
) -> tuple[Any, Selection]:
    """Start the tracker on `frame` with index `first`; returns its result and the hints used. StartError if the clicked
    or masked region is not the object."""
    if inits[0].kind not in ("mask", "click"):
        told = places(inits, targets, frame, folder, first, seq)
        return tracker.start(frame, **told), Selection(told.get("masks") or [], [], told.get("boxes", []))
    from sdftrack.imaging.pose_hint import one_place
    from sdftrack.tracking.interface import TrackerInterface

    camera = seq.camera if frame.camera is None else frame.camera
    depth_camera = getattr(camera, "depth", camera)
    tell, selection, where = TrackerInterface(tracker), Selection(), []
    for k, init in enumerate(inits):
        if init.kind == "click":
            selection.clicks.append(_click(init, depth_camera.shape))
        else:
            selection.regions.append(mask_file(init, depth_camera.shape))
        try:
            if init.kind == "mask":
                tell.check_mask_size(k, frame, selection.regions[-1], init.option)
                where.append(one_place(None, selection.regions[-1], None, depth_camera))
                continue
            clicked = tell.place_at_click(k, frame, selection.clicks[-1], init.option)
            selection.regions.append(clicked.region)
            where.append(clicked.place)
        except ValueError as error:
            raise StartError(str(error), selection) from None
    return tell.start_at(frame, where), selection


def places(
    inits: list[Init], targets: list[Target], frame: Any, folder: Path, first: int, seq: Any
) -> dict[str, Any]:
    kind = inits[0].kind
    if kind == "gt":
        return {"poses": _truth(targets, folder, first, seq)}
    if kind == "poses":
        return {"poses": read_poses(Path(inits[0].text), len(targets))}
    if kind in ("auto", "own"):
        masks = _known_masks(targets, first, seq)
        if masks is None and kind == "own":
            raise ValueError(
                f"--init mask: {folder} has no masks of the {len(targets)} objects in image {seq.ids[first]}; pass a "
                "mask.png, box:x,y,w,h or click:x,y"
            )
        return {"masks": masks}
    shape = shape_of(frame, seq)
    if kind == "box":
        return {"boxes": [box_inside(i, shape) for i in inits]}
    camera = seq.camera if frame.camera is None else frame.camera
    return {"masks": [_mask(i, t, frame, camera, shape) for i, t in zip(inits, targets, strict=True)]}


def _known_masks(targets: list[Target], first: int, seq: Any) -> list[NDArray[np.bool_]] | None:
    """The sequence's own masks of the objects in that image; None if any is missing."""
    masks = {k: m for k, m in seq.masks(first).items() if m.any()}
    found = [masks.get(t.instance) if t.instance is not None else None for t in targets]
    if all(m is None for m in found) and len(masks) == len(targets):
        found = [masks[k] for k in sorted(masks)]  # whose they are is not said; the order is all there is
    known = [m for m in found if m is not None]
    return known if len(known) == len(targets) else None


def shape_of(frame: Any, seq: Any) -> tuple[int, int]:
    from sdftrack.camera import depth_camera

    return depth_camera(seq.camera if frame.camera is None else frame.camera).shape


def box_inside(init: Init, shape: tuple[int, int], image: str = "depth") -> tuple[float, ...]:
    x, y, w, h = init.numbers
    if x >= shape[1] or y >= shape[0] or x + w <= 0 or y + h <= 0:
        raise Usage(f"expected a box in the {shape[1]} x {shape[0]} {image} image, got {init.text}", "--init")
    return init.numbers


def mask_file(init: Init, shape: tuple[int, int], image: str = "depth") -> NDArray[np.bool_]:
    from sdftrack.io.frames import read_mask, size_text

    mask = read_mask(init.text, init.option)
    if mask.shape != shape:
        raise ValueError(
            f"{init.option}: expected the {image} image's size {size_text(shape)}, got {size_text(mask.shape)}; a mask "
            f"has the geometry of the {image} image"
        )
    if not mask.any():
        raise ValueError(f"{init.option}: expected at least one pixel that is not 0, got an empty mask")
    return mask


def place_of(init: Init, shape: tuple[int, int], image: str = "depth") -> dict[str, Any]:
    if init.kind == "box":
        return {"box": box_inside(init, shape, image)}
    return {"mask": mask_file(init, shape, image)}


def _mask(init: Init, target: Target, frame: Any, camera: Any, shape: tuple[int, int]) -> NDArray[np.bool_]:
    from sdftrack.imaging.pose_hint import connected_region

    if init.kind == "mask":
        return mask_file(init, shape)
    low, high = target.mesh.bounds
    try:
        return connected_region(frame, camera, _click(init, shape), math.dist(low, high))
    except ValueError as error:
        raise ValueError(f"{init.option}: {error}") from None


def _click(init: Init, shape: tuple[int, int]) -> tuple[float, float]:
    x, y = init.numbers
    if not (-0.5 <= x < shape[1] - 0.5 and -0.5 <= y < shape[0] - 0.5):
        raise Usage(f"expected a pixel of the {shape[1]} x {shape[0]} depth image, got {init.text}", "--init")
    return x, y


def _truth(targets: list[Target], folder: Path, first: int, seq: Any) -> list[NDArray[np.float64]]:
    import numpy as np

    truth, hint = seq.ground_truth.get(first, {}), "pass --init auto, or a mask, box or poses.json"
    for t in targets:
        if t.instance is None:
            raise ValueError(f"--init gt: {folder} has no (further) ground truth for {t.path}; {hint}")
        if t.instance not in truth:
            known = next((i for i, entry in seq.ground_truth.items() if t.instance in entry), None)
            where = hint if known is None else f"it is known in frame {known}: --start {known}"
            raise ValueError(f"--init gt: no ground truth of {t.path} in frame {first} of {folder}; {where}")
    return [np.asarray(truth[t.instance], np.float64) for t in targets]


def read_poses(path: Path, count: int) -> list[NDArray[np.float64]]:
    """Of ``{"T_cam_obj": [4x4, ...]}``, in the order of the models; before the camera, in metres."""
    if not path.is_file():
        raise FileNotFoundError(f"--init: no such file: {path}")
    value = read_json(path)
    poses = value.get("T_cam_obj") if isinstance(value, dict) else None
    if not isinstance(poses, list):
        raise ValueError(f'--init {path}: expected {{"T_cam_obj": [4x4, ...]}}, in the order of the models')
    if len(poses) != count:
        expected = f"expected T_cam_obj to list one 4x4 matrix per --model ({count})"
        raise ValueError(f"--init {path}: {expected}, got {len(poses)}")
    out = []
    for k, pose in enumerate(poses):
        name = f"--init {path}: T_cam_obj[{k}]"
        try:
            T = st.geometry.rigid(pose, name)
        except TypeError as error:
            raise ValueError(str(error)) from None
        distance, z = math.hypot(*T[:3, 3]), float(T[2, 3])
        if distance > FARTHEST_M:
            away = f"the object is {distance:.4g} m away"
            raise ValueError(f"{name}: {away}; translations are metres, are these mm?")
        if z <= 0:
            behind = f"the object is behind the camera (z = {z:.4g} m)"
            raise ValueError(f"{name}: {behind}; expected T_cam_obj, object to camera")
        out.append(T)
    return out


NAME = "start.png"
REGION, CLICK, BOX, FOUND = (255, 220, 0), (255, 0, 255), (0, 200, 255), (40, 220, 40)
CLICK_PX = 6


@dataclass
class Selection:
    """Hints of a start: masks or regions of clicks, the clicked pixels, and boxes (x, y, w, h)."""

    regions: list[NDArray[np.bool_]] = field(default_factory=list)
    clicks: list[tuple[float, float]] = field(default_factory=list)
    boxes: list[tuple[float, ...]] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.regions or self.clicks or self.boxes)


class StartError(ValueError):
    """The selected region is not the object; `selection` is the region examined."""

    def __init__(self, message: str, selection: Selection) -> None:
        super().__init__(message)
        self.selection = selection


def save_start_picture(
    path: Path, frame: Any, camera: Any, selection: Selection, result: Any = None, sdfs: Any = ()
) -> None:
    import cv2
    import numpy as np

    from sdftrack.io.frames import write_color
    from sdftrack.viz.overlay import backdrop

    picture = backdrop(frame, camera)
    good = [k for k in range(len(sdfs)) if str(result.status[k]) in ("ok", "weak")]
    outlines = [(sdfs[k].silhouette(camera, result.poses[k]), FOUND) for k in good]
    for inside, color in [*outlines, *((region, REGION) for region in selection.regions)]:
        lines = cv2.findContours(inside.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
        cv2.drawContours(picture, lines, -1, color, 1)
    for x, y, w, h in selection.boxes:
        cv2.rectangle(picture, (round(x), round(y)), (round(x + w), round(y + h)), BOX, 1)
    for x, y in selection.clicks:
        cv2.drawMarker(picture, (round(x), round(y)), CLICK, cv2.MARKER_CROSS, 2 * CLICK_PX, 2)
    write_color(path, picture)


def error_with_picture(error: StartError, out: Path, overwrite: bool, frame: Any, camera: Any) -> ValueError:
    from sdftrack.io.out_folder import prepare_folder

    try:
        prepare_folder(out, overwrite)
        save_start_picture(out / NAME, frame, camera, error.selection)
    except OSError:
        return ValueError(str(error))
    return ValueError(f"{error}; {out / NAME} shows the selected region")
