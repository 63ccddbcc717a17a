# SPDX-License-Identifier: MIT
"""Primitives of unknown size, measured: ``python -m sdftrack.eval.primitives [synthetic|unbounded|osd|patch|limits|
resting] [-n 200]``.

synthetic: random solids on a table with known sizes; unbounded: views that leave a length open; osd: objects of real
scenes (labels of the Object Segmentation Database), distance of their readings to the primitive's surface;
patch: plane patches, synthetic and on the faces of those boxes; limits: how well views that are over their limit could
be told at all; resting: cylinders and cones that lie, lean or hover on a table.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.evaluation.tables import text_table
from sdftrack.frame import Frame
from sdftrack.primitives import PrimitiveFit, fit_primitive
from sdftrack.synth.noise import Gaussian, Kinect, Noise
from sdftrack.synth.solids import KINDS, SolidScene, random_solid, standing_scene

__all__ = ["Error", "measure", "scenes"]

Array = NDArray[np.float64]
CAMERA = Camera(525, 525, 319.5, 239.5, 640, 480)
NOISES: dict[str, tuple[Noise, float, float]] = {  # noise, limit of the size (share), limit of the axis (deg)
    "1 mm": (Gaussian(0.001), 0.01, 0.3),
    "Kinect": (Kinect(), 0.02, 1.0),
}
ALIKE = 0.1  # two radii of an ellipsoid that differ by less have no directions of their own
OPEN_VIEWS = {"box": "its front alone", "cylinder": "its round end alone", "cone": "its base alone"}


@dataclass(frozen=True)
class Error:
    """Of one fit: the largest relative error of a length, and the angle (deg; nan: no axis) to the true axes.

    `size_sd` and `axis_sd_deg`: the largest deviation that the fit states for any of these.
    """

    size: float
    axis_deg: float
    size_sd: float
    axis_sd_deg: float


def scenes(kind: str, count: int) -> Iterator[tuple[SolidScene, np.random.Generator]]:
    """`count` random solids of a kind on a table, the same ones every time."""
    for i in range(count):
        rng = np.random.default_rng([KINDS.index(kind), i])
        yield standing_scene(kind, random_solid(kind, rng), CAMERA, rng), rng


def measure(fit: PrimitiveFit, scene: SolidScene) -> Error:
    """Errors of a fit of the right kind; the axes of a box or ellipsoid may come in any order."""
    found, true = np.array(list(fit.size.values())), np.array(list(scene.size.values()))
    size_sd = float((np.sqrt(np.diag(fit.covariance)[6:]) / found).max())
    R = fit.T_cam_obj[:3, :3].T @ scene.T_cam_obj[:3, :3]
    if scene.kind in ("box", "ellipsoid"):
        order = max(permutations(range(3)), key=lambda p: sum(abs(R[p[j], j]) for j in range(3)))
        found = found[list(order)]
        own = [j for j in range(3) if scene.kind == "box" or _is_own(true, j)]
        angles = [_angle(abs(R[order[j], j])) for j in own]
        sds = [_axis_sd(fit, order[j]) for j in own]
    elif scene.kind == "sphere":
        angles, sds = [], []
    else:
        angles = [_angle(R[2, 2] if scene.kind == "cone" else abs(R[2, 2]))]
        sds = [_axis_sd(fit, 2)]
    nan = float("nan")
    worst = float(np.abs(found / true - 1).max())
    return Error(worst, max(angles, default=nan), size_sd, max(sds, default=nan))


def _is_own(radii: Array, j: int) -> bool:
    """Whether an ellipsoid's radius differs from both others: a circle has no directions."""
    return min(abs(np.log(radii[j] / radii[k])) for k in range(3) if k != j) > ALIKE


def _axis_sd(fit: PrimitiveFit, axis: int) -> float:
    """Stated deviation (deg) of the direction of an axis: turns about itself do not count."""
    a = fit.T_cam_obj[:3, axis]
    across = np.eye(3) - np.outer(a, a)
    return float(np.degrees(np.sqrt(np.trace(across @ fit.covariance[3:6, 3:6] @ across))))


def _angle(cosine: float) -> float:
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def synthetic(count: int, scaling: str = "exact", kinds: Sequence[str] = KINDS) -> str:
    """The table of random solids, each fitted with kind="auto" and no mask."""
    rows = []
    for name, (noise, size_limit, axis_limit) in NOISES.items():
        for kind in kinds:
            rows.append([name, kind, *_row(kind, count, noise, size_limit, axis_limit, scaling)])
    head = [
        "noise", "kind", "n", "right kind", "size err", "p95", "in limit", "told", "of them", "axis err", "p95",
        "in limit", "told", "of them", "held lost", "sd ratio", "ms",
    ]  # fmt: skip
    title = (
        f"Random solids, 4-25 cm, on a table at 0.6-1.2 m, kind='auto', no mask, scaling={scaling!r}. Errors: median "
        "and 95th percentile (%, deg); limits: 1 %, 0.3 deg at 1 mm, 2 %, 1 deg with Kinect noise. told: views in "
        "which two stated deviations are within the limit; of them: the share that is within it"
    )
    return text_table(title, head, rows)


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


def unbounded(count: int) -> str:
    """Views that leave a length open: how often its variance is infinite, and the others' is not."""
    from experiments.primitives.open_views import open_view

    rows = []
    for name, (noise, _, _) in NOISES.items():
        for kind, what in OPEN_VIEWS.items():
            said = kept = 0
            for i in range(count):
                rng = np.random.default_rng([KINDS.index(kind), i, 7])
                depth, cosine, mask, hidden = open_view(kind, rng, CAMERA)
                frame = Frame(noise(depth, cosine, rng))
                fit = fit_primitive(frame, kind, camera=CAMERA, mask=mask, plane=None)
                along = np.abs(fit.T_cam_obj[2, :3])  # which of its axes runs along the view
                names = list(fit.size)
                open_name = names[int(along.argmax())] if kind == "box" else hidden
                said += not fit.bounded[open_name]
                kept += all(v for n, v in fit.bounded.items() if n != open_name)
            rows.append(
                [
                    name,
                    f"{kind}, {what}",
                    str(count),
                    f"{100 * said / count:.0f} %",
                    f"{100 * kept / count:.0f} %",
                ]
            )
    head = ["noise", "view", "n", "open length infinite", "others bounded"]
    return text_table("No table, a wall 1 m behind: lengths that nothing bounds", head, rows)


def _patch_tables(count: int, data: str | None) -> str:
    from experiments.primitives import patches as patch

    few = max(1, count // 4)
    tables = [
        patch.patches(count, NOISES, CAMERA),
        patch.open_patches(few, NOISES, CAMERA),
        patch.auto_with_patches(few, NOISES["1 mm"][0], CAMERA),
    ]
    try:
        tables.append(patch.osd_faces(data))
    except FileNotFoundError as error:
        tables.append(f"Faces of real boxes: skipped, {error}")
    return "\n\n".join(tables)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m sdftrack.eval.primitives", description=__doc__)
    parser.add_argument("what", nargs="*", default=["synthetic", "unbounded", "osd", "patch"])
    parser.add_argument("-n", type=int, default=200, help="solids of each kind")
    parser.add_argument(
        "--kinds", nargs="+", default=list(KINDS), choices=KINDS, help="of the synthetic ones"
    )
    parser.add_argument("--scaling", default="exact", choices=["exact", "printed"])
    parser.add_argument("--data", default=None, help="folder of the OSD scenes")
    given = parser.parse_args(arguments)
    from experiments.primitives.limits import limits
    from experiments.primitives.kinect_objects import osd
    from experiments.primitives.resting import resting

    tables: dict[str, Any] = {
        "synthetic": lambda: synthetic(given.n, given.scaling, given.kinds),
        "unbounded": lambda: unbounded(max(1, given.n // 4)),
        "osd": lambda: osd(given.data),
        "patch": lambda: _patch_tables(given.n, given.data),
        "limits": lambda: limits(given.n, {name: noise for name, (noise, _, _) in NOISES.items()}, CAMERA),
        "resting": lambda: resting(max(1, given.n // 4), NOISES, CAMERA),
    }
    for what in given.what:
        if what not in tables:
            parser.error(f"expected some of {', '.join(tables)}, got {what!r}")
        print(tables[what](), flush=True)
        print()


if __name__ == "__main__":
    main()
