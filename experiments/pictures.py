# SPDX-License-Identifier: MIT
"""Pictures of experiments: panels of curves, and rows of images. Without a display; saved by the runner."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.viz.plots import COLORS, figure

__all__ = ["COLORS", "Line", "Panel", "around", "curves", "error_panels", "images", "path_panels", "shaded"]

Array = NDArray[np.float64]
GREY = 225.0


@dataclass(frozen=True)
class Line:
    """One curve; `style` as in ``Axes.plot``. A single number for `y` is a level or, as `x`, an upright."""

    x: Any
    y: Any
    label: str = ""
    style: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Panel:
    """Axes with curves; `axes` as in ``Axes.set``, `legend` as in ``Axes.legend`` (None: no legend)."""

    lines: Sequence[Line]
    axes: Mapping[str, Any] = field(default_factory=dict)
    legend: Mapping[str, Any] | None = field(default_factory=dict)


def curves(panels: Sequence[Sequence[Panel]], size: tuple[float, float], **options: Any) -> Any:
    """A figure of rows of panels; `options` as in ``Figure.subplots``."""
    columns = max(map(len, panels))
    fig, axes = figure(len(panels), columns, size=size, **{"squeeze": False, **options})
    for row, drawn in zip(axes, panels, strict=True):
        for ax, panel in zip(row, drawn, strict=False):
            _draw(ax, panel)
        for ax in row[len(drawn) :]:
            ax.set_axis_off()
    return fig


def _draw(ax: Any, panel: Panel) -> None:
    for line in panel.lines:
        style = {"linewidth": 1.2, "label": line.label or None, **line.style}
        if line.x is None:
            ax.axhline(line.y, **{"color": "0.6", "linestyle": ":", **style})
        elif line.y is None:
            ax.axvline(line.x, **{"color": "0.6", "linestyle": ":", **style})
        else:
            ax.plot(line.x, line.y, **style)
    ax.set(**panel.axes)
    ax.title.set_fontsize(10)
    if panel.legend is not None and any(line.label for line in panel.lines):
        ax.legend(**{"fontsize": 8, **panel.legend})


def path_panels(truth: Array, estimate: Array | None = None) -> tuple[Panel, Panel]:
    """Translation (mm) and rotation (deg) since the first frame of poses (n, 4, 4); the truth beside them is dashed."""
    shown = [(truth, "-")] if estimate is None else [(truth, "--"), (estimate, "-")]
    made = []
    for kind, label in zip("tr", ("translation (mm)", "rotation (deg)"), strict=True):
        lines = []
        for poses, dash in shown:
            turns = np.rad2deg(_rotation_vectors(poses))
            values = 1e3 * (poses[:, :3, 3] - truth[0, :3, 3]) if kind == "t" else turns
            for j, axis in enumerate("xyz"):
                style = {"color": COLORS[j], "linestyle": dash}
                lines.append(
                    Line(np.arange(len(poses)), values[:, j], f"{kind}{axis}" * (dash == "-"), style)
                )
        made.append(
            Panel(lines, {"ylabel": f"{'' if estimate is not None else 'true '}{label}"}, {"ncols": 3})
        )
    return made[0], made[1]


def error_panels(
    errors: Mapping[str, tuple[Any, Any]], what: str = "error", **axes: Any
) -> tuple[Panel, Panel]:
    """Errors in mm and degrees by frame, a curve for each name; `axes` of both panels."""
    labels = (f"translation {what} (mm)", f"rotation {what} (deg)")
    made = [
        Panel(
            [Line(np.arange(len(e[k])), e[k], name, {"linewidth": 1}) for name, e in errors.items()],
            {"ylabel": label, **axes},
        )
        for k, label in enumerate(labels)
    ]
    return made[0], made[1]


def _rotation_vectors(poses: Array) -> Array:
    """Rotation relative to the first frame, rad, made continuous."""
    from sdftrack import _core

    out: list[Array] = []
    for T in poses:
        relative = np.eye(4)
        relative[:3, :3] = poses[0, :3, :3].T @ T[:3, :3]
        w = np.array(_core.rotation_log(relative))
        if out:  # of the vectors that mean the same turn, the one nearest to the last frame's
            angle = np.linalg.norm(w)
            axis = w / angle if angle > 1e-9 else np.zeros(3)
            choices = [w + 2 * np.pi * m * axis for m in (-2, -1, 0, 1, 2)]
            w = min(choices, key=lambda c: float(np.linalg.norm(c - out[-1])))
        out.append(w)
    return np.array(out)


def around(picture: NDArray[np.uint8], point: Array, lens: Any, half_m: float) -> NDArray[np.uint8]:
    """The part of a picture that shows a square of twice `half_m` about a point of the camera's frame (m)."""
    u, v = (round(float(c)) for c in lens.project(point))
    half, (height, width) = int(lens.fx * half_m / point[2]), picture.shape[:2]
    return picture[max(0, v - half) : min(height, v + half), max(0, u - half) : min(width, u + half)]


def shaded(mesh: Any, T: Array, lens: Any) -> NDArray[np.uint8]:
    """A mesh as the camera sees it at T_cam_obj, in its colours or grey, lit from the camera, on white."""
    depth, normals, colors = mesh.raycast(lens, np.ascontiguousarray(T))
    lit = 0.25 + 0.75 * np.abs(np.asarray(normals)[..., 2:])
    paint = GREY if colors is None else np.asarray(colors, np.float64)
    return np.where(depth[..., None] > 0, paint * lit, 255).clip(0, 255).astype(np.uint8)


def images(
    rows: Mapping[str, Sequence[tuple[str, Any]]],
    side: float = 1.8,
    outlines: Mapping[Any, Any] | None = None,
) -> Any:
    """A figure with a row of (title, image) for each name.

    Masks are drawn in black and white. `outlines`: a mask by (row, column), whose outline is drawn over the image.
    """
    columns = max(map(len, rows.values()))
    shapes = [np.shape(image) for row in rows.values() for _, image in row]
    height = side * max(shape[0] / shape[1] for shape in shapes) + 0.35
    fig, axes = figure(len(rows), columns, size=(side * columns, height * len(rows)), squeeze=False)
    for i, (name, row) in enumerate(rows.items()):
        for j, (title, image) in enumerate(row):
            ax = axes[i, j]
            ax.imshow(image, cmap="gray", **({"vmin": 0, "vmax": 1} if np.ndim(image) == 2 else {}))
            outline = (outlines or {}).get((i, j))
            if outline is not None and outline.any():
                ax.contour(outline, [0.5], colors="yellow", linewidths=1.4)
            ax.set_title(title, fontsize=8)
            ax.set(xticks=[], yticks=[])
            ax.spines[:].set_visible(False)
            ax.grid(False)
        axes[i, 0].set_ylabel(name, fontsize=8)
    return fig
