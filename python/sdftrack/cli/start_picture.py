# SPDX-License-Identifier: MIT
"""``start.png``: the regions selected as objects at the start, and the poses found."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

__all__ = ["NAME", "Selection", "StartError", "error_with_picture", "save_start_picture"]

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

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
    """Write the image, with the outlines of the shapes at the poses found."""
    import cv2

    from sdftrack.viz.pictures import save_picture

    picture = _backdrop(frame, camera).copy()
    for k, sdf in enumerate(sdfs):
        if str(result.status[k]) in ("ok", "weak"):
            _outline(picture, sdf.silhouette(camera, result.poses[k]), FOUND)
    for region in selection.regions:
        _outline(picture, region, REGION)
    for x, y, w, h in selection.boxes:
        cv2.rectangle(picture, (round(x), round(y)), (round(x + w), round(y + h)), BOX, 1)
    for x, y in selection.clicks:
        cv2.drawMarker(picture, (round(x), round(y)), CLICK, cv2.MARKER_CROSS, 2 * CLICK_PX, 2)
    save_picture(path, picture)


def error_with_picture(error: StartError, out: Path, overwrite: bool, frame: Any, camera: Any) -> ValueError:
    """Add the path of the image to the error, if the folder is writable."""
    from sdftrack.io.out_folder import prepare_folder

    try:
        prepare_folder(out, overwrite)
        save_start_picture(out / NAME, frame, camera, error.selection)
    except OSError:
        return ValueError(str(error))
    return ValueError(f"{error}; {out / NAME} shows the selected region")


def _outline(picture: NDArray[np.uint8], inside: NDArray[np.bool_], color: tuple[int, int, int]) -> None:
    import cv2
    import numpy as np

    lines = cv2.findContours(inside.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    cv2.drawContours(picture, lines, -1, color, 1)


def _backdrop(frame: Any, camera: Any) -> NDArray[np.uint8]:
    """The frame's colours aligned to its depth image, or its depth in grey without colour."""
    import numpy as np

    from sdftrack.imaging.click_regions import registered_colors

    rgb = registered_colors(frame, camera)
    if rgb is not None:
        return rgb
    depth = np.where(frame.depth > 0, frame.depth, np.nan)
    low, high = np.nanquantile(depth, [0.02, 0.98]) if np.isfinite(depth).any() else (0.0, 1.0)
    grey = np.nan_to_num(255 * (1 - np.clip((depth - low) / max(high - low, 1e-6), 0, 1)))
    return np.repeat(grey[..., None].astype(np.uint8), 3, axis=2)
