# SPDX-License-Identifier: MIT
"""Plane patches, measured: sizes and normals, open ends, faces of real boxes, and whether "auto" could include them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.primitive_errors import angle_deg, measure_patch
from experiments.data import has
from experiments.primitives.kinect_objects import BOXES, objects_of
from experiments.primitives.solids import CAMERA, NOISES
from experiments.registry import experiment
from experiments.synth.patches import VIEWS, cut_scene, hidden_scene, patch_scene
from experiments.synth.solids import SolidScene, open_view, random_solid, standing_scene
from experiments.table import Table
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.primitives import PrimitiveFit, fit_primitive
from sdftrack.primitives.result import KINDS
from sdftrack.primitives.segmentation import SegmentedFrame, pieces
from sdftrack.primitives.solver import FitRequest, solve
from sdftrack.synth.noise import Noise

Array = NDArray[np.float64]
Limits = Mapping[
    str, tuple[Noise, float, float]
]  # name: noise, limit of the size (share), of the normal (deg)
SEEDS = (9, 11)  # of closed and of open views
FACE_M = 0.01  # a reading so near a fitted box's face is that face's
MIN_FACE = 2000  # readings


def patches(count: int, noises: Limits, camera: Camera) -> Table:
    """The table of random patches that are seen whole."""
    rows = []
    for name, (noise, size_limit, angle_limit) in noises.items():
        for view in VIEWS:
            fits = [_fitted(view, i, noise, camera) for i in range(count)]
            errors = [measure_patch(fit, scene) for fit, scene in fits]
            size = 100 * np.array([np.abs(e[0]).max() for e in errors])
            angle = np.array([e[2] for e in errors])
            held = [e[1] for e, (fit, _) in zip(errors, fits, strict=True) if fit.ok]
            sure = np.array([_told(fit) <= size_limit for fit, _ in fits])
            within = size <= 100 * size_limit
            rows.append(
                [
                    f"{name}, {view}", str(count),
                    f"{np.median(size):.2f}", f"{np.percentile(size, 95):.2f}", f"{100 * np.mean(within):.1f} %",
                    str(np.count_nonzero(sure)), f"{100 * np.mean(within[sure]):.1f} %" if sure.any() else "-",
                    f"{np.median(angle):.2f}", f"{np.percentile(angle, 95):.2f}",
                    f"{100 * np.mean(angle <= angle_limit):.1f} %",
                    str(sum(not fit.ok for fit, _ in fits)),
                    f"{np.sqrt(np.mean(np.square(held))):.1f}",
                ]
            )  # fmt: skip
    head = [
        "noise, view", "n", "size err", "size p95", "size in limit", "told", "of them", "normal err", "normal p95",
        "normal in limit", "held lost", "sd ratio",
    ]  # fmt: skip
    title = (
        "Random patches, 4-25 cm, at 0.6-1.2 m, kind='plane'; standing on a table (no mask), lying like its top, held "
        "before a wall (mask given). Errors: median and 95th percentile (%, deg); limits: 1 %, 0.3 deg at 1 mm, 2 %, 1 "
        "deg with Kinect noise"
    )
    return Table(title, head, rows)


def _fitted(view: str, i: int, noise: Noise, camera: Camera) -> tuple[PrimitiveFit, SolidScene]:
    rng = np.random.default_rng([SEEDS[0], VIEWS.index(view), i])
    scene = patch_scene(view, random_solid("plane", rng), camera, rng)
    frame = Frame(noise(scene.depth, scene.cosine, rng))
    return fit_primitive(
        frame, "plane", camera=camera, mask=None if view == "standing" else scene.mask
    ), scene


def _told(fit: PrimitiveFit) -> float:
    """Two stated deviations of the worse known side, relative."""
    sd = np.sqrt(np.diag(fit.covariance)[6:])
    return float((2 * sd / np.array(list(fit.size.values()))).max())


def open_patches(count: int, noises: Limits, camera: Camera) -> Table:
    """Patches that run out of the picture or behind a board: how often that side is open, and the other one is not."""
    rows = []
    for name, (noise, _, _) in noises.items():
        for k, (what, make) in enumerate(
            {"runs out of the picture": cut_scene, "its end hidden": hidden_scene}.items()
        ):
            said, kept, errors = 0, 0, []
            for i in range(count):
                rng = np.random.default_rng([SEEDS[1], k, i])
                scene = make(random_solid("plane", rng), camera, rng)
                frame = Frame(noise(scene.depth, scene.cosine, rng))
                fit = fit_primitive(frame, "plane", camera=camera, mask=scene.mask)
                T = fit.T_cam_obj
                along = int(abs(T[0, 1]) > abs(T[0, 0]))  # which side runs along the image's x
                held, size = list(fit.bounded.values()), list(fit.size.values())
                said += not held[along]
                kept += held[1 - along]
                errors.append(abs(100 * (size[1 - along] / scene.size["height"] - 1)))
            rows.append(
                [f"{name}, {what}", str(count), f"{100 * said / count:.0f} %", f"{100 * kept / count:.0f} %",
                 f"{np.median(errors):.2f} %", f"{np.percentile(errors, 95):.2f} %"]
            )  # fmt: skip
    head = ["noise, patch", "n", "open side infinite", "other bounded", "its error", "p95"]
    return Table("Patches of which one side's end is not seen", head, rows)


def auto_with_patches(count: int, noise: Noise, camera: Camera) -> Table:
    """How often a patch would be the best of all kinds if "auto" tried it."""
    scenes: dict[str, Iterable[tuple[Frame, Any, Any]]] = {
        "box on a table": (_box(i, noise, camera) for i in range(count)),
        "patch on a table": (_standing(i, noise, camera) for i in range(count)),
        "box, its front alone": (_front(i, noise, camera) for i in range(count)),
    }
    rows = []
    for what, some in scenes.items():
        best = []
        for frame, mask, plane in some:
            seen = SegmentedFrame.of(frame, camera, plane, mask)
            own = pieces(seen)[0] if mask is None else mask
            request = FitRequest("auto", None, 0, "exact", 0)
            request.kinds = KINDS
            best.append(solve(seen.view(seen.labels(own, mask is None)), request).kind)
        rows.append([what, str(count), *(f"{100 * best.count(k) / count:.0f} %" for k in ("box", "plane"))])
    return Table("If patches were among the kinds of auto", ["scene", "n", "box", "plane"], rows)


def _box(i: int, noise: Noise, camera: Camera) -> tuple[Frame, Any, Any]:
    rng = np.random.default_rng([3, i])  # the boxes of the other tables
    scene = standing_scene("box", random_solid("box", rng), camera, rng)
    return Frame(noise(scene.depth, scene.cosine, rng)), None, "auto"


def _standing(i: int, noise: Noise, camera: Camera) -> tuple[Frame, Any, Any]:
    rng = np.random.default_rng([SEEDS[0], 0, i])
    scene = patch_scene("standing", random_solid("plane", rng), camera, rng)
    return Frame(noise(scene.depth, scene.cosine, rng)), None, "auto"


def _front(i: int, noise: Noise, camera: Camera) -> tuple[Frame, Any, Any]:
    rng = np.random.default_rng([3, i, 7])
    depth, cosine, mask, _ = open_view("box", rng, camera)
    return Frame(noise(depth, cosine, rng)), mask, None


def osd_faces(folder: Path) -> Table:
    """Patches on the largest face of real boxes against the edges of the boxes, each fitted by itself."""
    rows, off, turned = [], [], []
    for scene in BOXES:
        frame, masks = objects_of(folder, scene)
        for number, mask in masks.items():
            box = fit_primitive(frame, "box", mask=mask)
            axis, face = _largest_face(box, frame, mask)
            if np.count_nonzero(face) < MIN_FACE:
                continue
            fit = fit_primitive(frame, "plane", mask=face)
            R = fit.T_cam_obj[:3, :3].T @ box.T_cam_obj[:3, :3]
            turned.append(angle_deg(abs(R[2, axis])))
            cells = []
            for k, (name, side) in enumerate(fit.size.items()):
                edge = int(np.where(np.arange(3) == axis, 0, np.abs(R[k])).argmax())
                edge_name = list(box.size)[edge]
                both = fit.bounded[name] and box.bounded[edge_name]
                cells.append(
                    f"{1e3 * side:.0f}{'' if fit.bounded[name] else '?'} / {1e3 * box.size[edge_name]:.0f}"
                    f"{'' if box.bounded[edge_name] else '?'}"
                )
                off += [1e3 * (side - box.size[edge_name])] if both else []
            rows.append(
                [f"learn{scene} {number}", str(np.count_nonzero(face)), *cells, f"{turned[-1]:.2f}",
                 f"{1e3 * fit.rms:.1f}"]
            )  # fmt: skip
    head = ["object", "readings", "width / edge (mm)", "height / edge (mm)", "normals apart (deg)", "rms mm"]
    note = (
        f"{len(off)} sides that both fits bound: patch less box, median {np.median(off):+.1f} mm, median of |.| "
        f"{np.median(np.abs(off)):.1f}, 95th percentile {np.percentile(np.abs(off), 95):.1f}; normals apart: median "
        f"{np.median(turned):.2f} deg, worst {max(turned):.2f}"
    )
    return Table("Largest faces of real boxes as patches; ? : nothing bounds it", head, rows, [note])


def _largest_face(box: PrimitiveFit, frame: Frame, mask: NDArray[np.bool_]) -> tuple[int, NDArray[np.bool_]]:
    """Of a fitted box: the axis of the face with the most readings, and these."""
    assert frame.depth is not None
    T = np.linalg.inv(box.T_cam_obj)
    points = frame.camera.back_project(frame.depth).astype(np.float64) @ T[:3, :3].T + T[:3, 3]  # type: ignore[union-attr]
    off = np.abs(np.abs(points) - np.array(list(box.size.values())) / 2)
    nearest = np.where(mask & (frame.depth > 0) & (off.min(axis=-1) < FACE_M), off.argmin(axis=-1), -1)
    axis = int(np.bincount(nearest[nearest >= 0], minlength=3).argmax())
    return axis, nearest == axis


@experiment(
    "primitives.patch",
    uses=["osd"],
    chosen_on="the same views, and the faces of osd's boxes",
    reported_on="200 synthetic patches of each view, and the faces of osd's boxes",
    short={"n": 1, "real": False},
)
def patch(*, data: Path, n: int = 200, real: bool = True) -> list[Table]:
    """Plane patches: sizes and normals, open ends, faces of real boxes, and whether "auto" could include them.

    Parameters
    ----------
    n
        patches of each view; a quarter of it where one side is open and for "auto"
    real
        also the faces of the boxes of osd
    """
    few = max(1, n // 4)
    tables = [
        patches(n, NOISES, CAMERA),
        open_patches(few, NOISES, CAMERA),
        auto_with_patches(few, NOISES["1 mm"][0], CAMERA),
    ]
    return tables + ([osd_faces(data / "osd")] if real and has("osd", data) else [])
