# SPDX-License-Identifier: MIT
"""Solids of unknown size, measured: their kind, lengths and axes, and the lengths that nothing bounds."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from experiments.common.primitive_errors import measure
from experiments.registry import experiment
from experiments.synth.solids import KINDS, SolidScene, open_view, random_solid, standing_scene
from experiments.table import Table
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.primitives import fit_primitive
from sdftrack.synth.noise import Gaussian, Kinect, Noise

Array = NDArray[np.float64]
Kind: TypeAlias = Literal["sphere", "cylinder", "cone", "box", "ellipsoid"]
EVERY_KIND: tuple[Kind, ...] = get_args(Kind)
CAMERA = Camera(525, 525, 319.5, 239.5, 640, 480)
NOISES: dict[str, tuple[Noise, float, float]] = {  # noise, limit of the size (share), limit of the axis (deg)
    "1 mm": (Gaussian(0.001), 0.01, 0.3),
    "Kinect": (Kinect(), 0.02, 1.0),
}
OPEN_VIEWS = {"box": "its front alone", "cylinder": "its round end alone", "cone": "its base alone"}


def scenes(kind: str, count: int) -> Iterator[tuple[SolidScene, np.random.Generator]]:
    """`count` random solids of a kind on a table, the same ones every time."""
    for i in range(count):
        rng = np.random.default_rng([KINDS.index(kind), i])
        yield standing_scene(kind, random_solid(kind, rng), CAMERA, rng), rng


@experiment(
    "primitives.synthetic",
    chosen_on="the same views, among others",
    reported_on="random solids of five kinds, 200 of each, seeds by number",
    short={"n": 1},
)
def synthetic(
    *,
    n: int = 200,
    kinds: tuple[Kind, ...] = EVERY_KIND,
    scaling: Literal["exact", "printed"] = "exact",
) -> Table:
    """Random solids of unknown size on a table, each fitted with kind="auto" and no mask.

    Parameters
    ----------
    n
        solids of each kind
    kinds
        of solids, comma separated
    scaling
        of the residuals
    """
    rows = []
    for name, (noise, size_limit, axis_limit) in NOISES.items():
        for kind in kinds:
            rows.append([f"{name}, {kind}", *_row(kind, n, noise, size_limit, axis_limit, scaling)])
    head = [
        "noise, kind", "n", "right kind", "size err", "size p95", "size in limit", "size told", "size of them",
        "axis err", "axis p95", "axis in limit", "axis told", "axis of them", "held lost", "sd ratio", "ms",
    ]  # fmt: skip
    notes = [
        "Errors: median and 95th percentile, % and deg. Limits: 1 % and 0.3 deg at 1 mm, 2 % and 1 deg with a Kinect.",
        "told: views in which two stated deviations are within the limit; of them: the share that is within it.",
    ]
    return Table(f"Random solids on a table, scaling={scaling}", head, rows, notes)


def _row(
    kind: str, count: int, noise: Noise, size_limit: float, axis_limit: float, scaling: str
) -> list[str]:
    errors, right, unheld, seconds, ratios = [], 0, 0, [], []
    for scene, rng in scenes(kind, count):
        frame = Frame(noise(scene.depth, scene.cosine, rng))
        begin = time.perf_counter()
        fit = fit_primitive(frame, "auto", camera=CAMERA, scaling=scaling)
        seconds.append(time.perf_counter() - begin)
        if fit.kind != kind:
            continue
        right += 1
        errors.append(measure(fit, scene))
        unheld += not all(fit.bounded.values())
        if kind not in ("box", "ellipsoid"):  # whose axes come in any order
            off = np.array(list(fit.size.values())) - np.array(list(scene.size.values()))
            ratios.extend((off / np.sqrt(np.diag(fit.covariance)[6:])).tolist())
    size = 100 * np.array([e.size for e in errors])
    axis = np.array([e.axis_deg for e in errors if np.isfinite(e.axis_deg)])
    ratio = f"{np.sqrt(np.mean(np.square(ratios))):.1f}" if ratios else "-"
    return [
        str(count),
        f"{100 * right / count:.1f} %",
        *_shares(size, 100 * size_limit, 100 * np.array([e.size_sd for e in errors])),
        *_shares(axis, axis_limit, np.array([e.axis_sd_deg for e in errors if np.isfinite(e.axis_deg)])),
        str(unheld),
        ratio,
        f"{1e3 * np.median(seconds):.0f}",
    ]


def _shares(values: Array, limit: float, sd: Array) -> list[str]:
    """Median, 95th percentile, share within the limit; views that tell the value so well, and their share."""
    if not len(values):
        return ["-"] * 5
    within, told = values <= limit, 2 * sd <= limit
    of_them = f"{100 * np.mean(within[told]):.0f} %" if told.any() else "-"
    return [
        f"{np.median(values):.2f}",
        f"{np.percentile(values, 95):.2f}",
        f"{100 * np.mean(within):.1f} %",
        str(np.count_nonzero(told)),
        of_them,
    ]


@experiment(
    "primitives.unbounded",
    chosen_on="the same views",
    reported_on="50 views each of a box, a cylinder and a cone",
    short={"n": 1},
)
def unbounded(*, n: int = 50) -> Table:
    """Views that leave a length open: how often its variance is infinite, and the others' is not.

    Parameters
    ----------
    n
        views of each kind
    """
    rows = []
    for name, (noise, _, _) in NOISES.items():
        for kind, what in OPEN_VIEWS.items():
            said = kept = 0
            for i in range(n):
                rng = np.random.default_rng([KINDS.index(kind), i, 7])
                depth, cosine, mask, hidden = open_view(kind, rng, CAMERA)
                frame = Frame(noise(depth, cosine, rng))
                fit = fit_primitive(frame, kind, camera=CAMERA, mask=mask, plane=None)
                along = np.abs(fit.T_cam_obj[2, :3])  # which of its axes runs along the view
                names = list(fit.size)
                open_name = names[int(along.argmax())] if kind == "box" else hidden
                said += not fit.bounded[open_name]
                kept += all(v for length, v in fit.bounded.items() if length != open_name)
            rows.append(
                [
                    f"{name}: {kind}, {what}",
                    str(n),
                    f"{100 * said / n:.0f} %",
                    f"{100 * kept / n:.0f} %",
                ]
            )
    head = ["noise: view", "n", "open length infinite", "others bounded"]
    return Table("No table, a wall 1 m behind: lengths that nothing bounds", head, rows)
