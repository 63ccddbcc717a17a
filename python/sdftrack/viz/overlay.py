# SPDX-License-Identifier: MIT
"""Image of a tracked frame: colour, or depth in colours; outline, shading, axes and status of every object."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import of_kind
from sdftrack.camera import depth_camera
from sdftrack.results import TrackResult

Picture = NDArray[np.uint8]
Array = NDArray[np.float64]


NOTHING_RGB = (22, 24, 30)  # pixels without a measurement


def backdrop(frame: Any, camera: Any) -> Picture:
    """H x W x 3 uint8 RGB, a new array aligned with the camera's depth image."""
    shape = depth_camera(camera).shape
    if frame.color is not None:
        if getattr(camera, "aligned", True):
            if frame.color.shape[:2] == shape:
                return np.array(frame.color)
        elif frame.depth is not None:
            return _warped(frame, camera)
    if frame.depth is not None:
        return depth_picture(frame.depth)
    return np.full((*shape, 3), NOTHING_RGB, np.uint8)


def depth_picture(depth: NDArray[np.float32]) -> Picture:
    """Colour-coded depth: near is warm, far is cool, with soft shading by slope; missing depth is near black."""
    import cv2

    seen = depth > 0
    sample = depth[::8, ::8]
    sample = sample[sample > 0]
    if not sample.size:
        return np.full((*depth.shape, 3), NOTHING_RGB, np.uint8)
    near, far = np.percentile(sample, [1, 97])
    level = np.clip((far - depth) / max(far - near, 1e-3), 0, 1)  # 1 near
    table = _palette()
    picture = table[(255 * level).astype(np.uint8)]
    smooth = cv2.blur(depth, (3, 3))
    step = cv2.Sobel(smooth, cv2.CV_32F, 1, 1, ksize=3, scale=18.0 / max(far - near, 0.05))
    relief = (1.0 + np.clip(step, -0.22, 0.22))[..., None]
    picture = np.clip(picture * relief, 0, 255).astype(np.uint8)
    picture[~seen] = NOTHING_RGB
    return picture


def _palette() -> NDArray[np.float32]:
    """256 x 3: ink blue (far) over slate and sand to cream (near); muted, so that overlays are visible."""
    stops = np.array(
        [[28, 38, 62], [52, 82, 110], [110, 134, 138], [184, 166, 132], [240, 226, 196]], np.float32
    )
    at = np.linspace(0, 255, len(stops))
    return np.column_stack([np.interp(np.arange(256), at, stops[:, k]) for k in range(3)]).astype(np.float32)


def _warped(frame: Any, camera: Any) -> Picture:
    """Colour of every depth pixel; pixels without depth use the depth of their surroundings."""
    import cv2

    lens, depth = depth_camera(camera), _filled(frame.depth)
    # The mapping is affine in homogeneous colour coordinates for a fixed pixel: y = a(u, v) Z + b.
    if camera.projective is not None:
        P, q = camera.projective
        v, u = np.mgrid[0 : lens.height, 0 : lens.width].astype(np.float32)
        direction = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.asarray(P, np.float32).T
        y = direction * depth[..., None] + np.asarray(q, np.float32)
        px = y[..., :2] / np.maximum(y[..., 2:], 1e-6)
    else:
        points = np.dstack([lens.rays * depth[..., None], depth]).astype(np.float64)
        px = camera.project_to_color(points).astype(np.float32)
    out = cv2.remap(
        frame.color, np.ascontiguousarray(px[..., 0]), np.ascontiguousarray(px[..., 1]), cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT, borderValue=NOTHING_RGB,
    )  # fmt: skip
    return np.asarray(out, np.uint8)


def _filled(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Depth with holes filled by the farthest measurement nearby, because most are shadows on the background."""
    import cv2

    holes = depth <= 0
    if not holes.any():
        return depth
    coarse = cv2.dilate(depth, np.ones((9, 9), np.uint8))[::8, ::8].copy()
    for _ in range(12):
        empty = coarse <= 0
        if not empty.any():
            break
        coarse[empty] = cv2.dilate(coarse, np.ones((7, 7), np.uint8))[empty]
    coarse[coarse <= 0] = float(depth.max()) or 1.0
    fill = cv2.resize(coarse, depth.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.where(holes, fill, depth)


STATUS_RGB = {
    "ok": (70, 220, 110),
    "weak": (255, 180, 40),
    "lost": (255, 70, 70),
    "bad_frame": (170, 170, 180),
}
OBJECT_RGB = ((90, 170, 255), (255, 120, 190), (180, 140, 255), (90, 220, 210), (255, 210, 90))
AXES_RGB = ((255, 80, 80), (90, 225, 90), (100, 140, 255))
IN_FRONT_M = 0.015  # a measurement this much nearer than the model hides it: a hand stays in front
REASON = 70  # letters in each line of the reason, below the status
REASON_LINES = 3
SHADE = 0.28  # share of the drawn surface in the mix
MESH_RGB = (205, 210, 220)  # of a mesh without colours
TINT = 0.55  # share of the objects' colours where memberships are shown


def draw(
    frame: Any,
    result: Any,
    shapes: Any,
    camera: Any,
    meshes: Sequence[Any] | None = None,
    *,
    names: Sequence[str] | None = None,
) -> Picture:
    """Draw the tracked objects over a frame.

    The image is aligned with the depth image: colour if it is aligned or can be mapped, else colour-coded depth.
    Outlines are green ("ok"), amber ("weak") or red ("lost", at the last good pose). With ``result.membership`` every
    pixel has the colours of the objects to which it is assigned, blended if ambiguous; without it the surfaces are
    shaded.

    Parameters
    ----------
    frame : Frame
    result : TrackResult
        Result of this frame; ``poses`` are ``T_cam_obj`` of the depth camera.
    shapes : SDF or list of SDF
        In the order of ``result.poses``.
    camera : Camera or RGBDCamera
        A frame's own ``frame.camera`` takes precedence.
    meshes : list of Mesh or None, optional
        One per object (None: nothing), drawn solid at the object's pose, e.g. a sword on a tracked handle. m,
        object frame.
    names : list of str, optional
        Shown next to the status instead of the object's index.

    Returns
    -------
    (H, W, 3) uint8 RGB
        A new array; the frame is not changed.

    Raises
    ------
    ValueError
        The number of shapes, meshes or names differs from that of the poses.

    Examples
    --------
    >>> picture = st.draw(frame, tracker.track(frame), sdf, camera)  # doctest: +SKIP
    """
    of_kind(result, TrackResult, "result")
    shapes = list(shapes) if isinstance(shapes, (list, tuple)) else [shapes]
    count = len(result.poses)
    for label, given in (("shapes", shapes), ("meshes", meshes), ("names", names)):
        if given is not None and len(given) != count:
            raise ValueError(f"{label}: expected {count}, one per tracked object, got {len(given)}")
    camera = frame.camera if getattr(frame, "camera", None) is not None else camera
    lens = depth_camera(camera)
    picture = backdrop(frame, camera)
    canvas, share = _Canvas(picture, frame.depth), SHADE
    if result.membership is not None:
        y, x = np.nonzero(result.membership.sum(axis=2) > 0)
        colours = np.array([OBJECT_RGB[k % len(OBJECT_RGB)] for k in range(count)], np.float32)
        mixed = (1 - TINT) * picture[y, x] + TINT * (result.membership[y, x] @ colours)
        picture[y, x] = mixed.astype(np.uint8)
        share = 0.0
    edges = []
    for k, (shape, T) in enumerate(zip(shapes, result.poses, strict=True)):
        status = str(result.status[k])
        if not np.isfinite(T).all():
            continue
        depth, normals = shape.render(lens, np.ascontiguousarray(T))[:2]
        window = _window(depth)
        if window is None:
            continue
        if status in ("ok", "weak"):
            canvas.shade(depth, normals, window, OBJECT_RGB[k % len(OBJECT_RGB)], share)
        edges.append((depth[window], window, STATUS_RGB[status]))
    for k, mesh in enumerate(meshes or ()):
        if mesh is not None and str(result.status[k]) in ("ok", "weak"):
            depth, normals, colors = mesh.raycast(lens, np.ascontiguousarray(result.poses[k]))
            if (window := _window(depth)) is not None:
                canvas.shade(depth, normals, window, MESH_RGB if colors is None else colors, 1.0)
    for depth, window, colour in edges:
        canvas.outline(depth, window, colour)
    for k, (shape, T) in enumerate(zip(shapes, result.poses, strict=True)):
        if str(result.status[k]) in ("ok", "weak"):
            _axes(picture, shape, lens, T)
    _captions(picture, result, names)
    return picture


def _window(depth: NDArray[np.float32]) -> tuple[slice, slice] | None:
    """Bounding box of the object's pixels, enlarged by 2 px."""
    seen = depth > 0
    rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    if not len(rows):
        return None
    return (
        slice(max(0, int(rows[0]) - 2), int(rows[-1]) + 3),
        slice(max(0, int(columns[0]) - 2), int(columns[-1]) + 3),
    )


class _Canvas:
    """The picture, the depth image, and the nearest model so far at each pixel."""

    def __init__(self, picture: Picture, measured: NDArray[np.float32] | None) -> None:
        self.picture, self.measured = picture, measured
        self.surface = np.full(picture.shape[:2], np.inf, np.float32)

    def shade(self, depth: Any, normals: Any, window: tuple[slice, slice], colour: Any, share: float) -> None:
        """Blend a shaded surface into the image where it is not occluded. `colour`: one RGB or an image."""
        d = depth[window]
        free = (d > 0) & (d <= self.surface[window])
        if self.measured is not None:
            m = self.measured[window]
            free &= (m <= 0) | (m > d - IN_FRONT_M)
        if not free.any():
            return
        facing = np.abs(normals[window][free][:, 2])  # a lamp at the camera
        tint = np.asarray(colour, np.float32)
        tint = tint[window][free] if tint.ndim == 3 else tint
        lit = (0.30 + 0.70 * facing)[:, None] * tint
        area = self.picture[window]
        area[free] = ((1 - share) * area[free] + share * lit).astype(np.uint8)
        self.surface[window][free] = d[free]

    def outline(self, depth: Any, window: tuple[slice, slice], colour: Any) -> None:
        """Border of the silhouette, omitted where another tracked object is in front of it."""
        import cv2

        contours, _ = cv2.findContours((depth > 0).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        line = np.zeros(depth.shape, np.uint8)
        cv2.drawContours(line, contours, -1, 255, max(1, round(self.picture.shape[0] / 300)), cv2.LINE_AA)
        near = cv2.dilate(depth, np.ones((5, 5), np.uint8))  # the model's depth, a little beyond its border
        line[self.surface[window] < near - IN_FRONT_M] = 0
        drawn = line > 0
        share = line[drawn, None] / np.float32(255)
        area = self.picture[window]
        area[drawn] = ((1 - share) * area[drawn] + share * np.asarray(colour, np.float32)).astype(np.uint8)


def _axes(picture: Picture, shape: Any, lens: Any, T: Array) -> None:
    """The object's x, y, z axes from the centre of its box, half its longest side long."""
    import cv2

    low, high = np.asarray(shape.bounds, np.float64)
    middle, length = 0.5 * (low + high), 0.4 * float(np.max(high - low))
    points = np.vstack([middle, middle + length * np.eye(3)]) @ T[:3, :3].T + T[:3, 3]
    if not (points[:, 2] > 0.01).all():  # or not known
        return
    px = np.clip(lens.project(points), -1e4, 1e4)
    at = [tuple(round(16 * float(c)) for c in p) for p in px]  # sixteenths of a pixel
    order = np.argsort(-points[1:, 2])  # far ones first
    thickness = max(1, round(picture.shape[0] / 320))
    for axis in order:
        cv2.line(picture, at[0], at[1 + axis], AXES_RGB[axis], thickness, cv2.LINE_AA, 4)


def _captions(picture: Picture, result: Any, names: Sequence[str] | None) -> None:
    lines = []
    for k, status in enumerate(result.status):
        name = names[k] if names is not None else (f"object {k}" if len(result.status) > 1 else "")
        sure = "" if str(status) in ("lost", "bad_frame") else f"{float(result.confidence[k]):.2f}"
        text = "  ".join(part for part in (name, str(status).replace("_", " "), sure) if part)
        lines.append((text, STATUS_RGB[str(status)]))
        reason = result.reason[k]
        lines += [
            (line, STATUS_RGB[str(status)]) for line in textwrap.wrap(reason, REASON, max_lines=REASON_LINES)
        ]
    write_panel(picture, lines)


def write_panel(picture: Picture, lines: Sequence[tuple[str, tuple[int, int, int]]]) -> None:
    """Lines of text and colour on a dark panel in the picture's top left corner."""
    import cv2

    scale = picture.shape[0] / 480
    font, size, height = cv2.FONT_HERSHEY_SIMPLEX, 0.5 * scale, max(10, round(20 * scale))
    margin = max(3, round(6 * scale))
    width = max((cv2.getTextSize(t, font, size, 1)[0][0] for t, _ in lines), default=0)
    if not width:
        return
    panel = picture[margin : margin + height * len(lines) + margin, margin : 3 * margin + width]
    panel[:] = (panel * 0.4).astype(np.uint8)
    for i, (text, colour) in enumerate(lines):
        at = (2 * margin, margin + height * (i + 1) - margin // 2)
        cv2.putText(picture, text, at, font, size, colour, max(1, round(scale)), cv2.LINE_AA)
