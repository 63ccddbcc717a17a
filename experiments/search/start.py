# SPDX-License-Identifier: MIT
"""Starts without a pose: random views of meshes, and what the search finds in them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from experiments.common.protocol import load_mesh, load_sdf, say
from experiments.common.truth import _random_rotation, default_camera
from experiments.registry import experiment
from experiments.table import Table, cells

Array = NDArray[np.float64]
MESHES = ("lm_ape", "lm_can", "lm_cat", "lm_driller", "lm_duck", "lm_glue")
CASES = ("mask", "half", "box", "image")
WITHIN_M = 0.005  # ADD
NEAR_M, FAR_M = 0.6, 1.0
HIDDEN = 0.5
AMBIGUOUS = 0.9  # of the best score, from which the runner-up counts as an equal
MIN_VISIBLE = 0.7  # of the object among clutter
BOX_SLACK_PX = 5


@dataclass(frozen=True)
class View:
    """One picture: noisy depth, the true pose, the visible pixels and a box about them."""

    depth: NDArray[np.float32]
    T: Array
    mask: NDArray[np.uint8]
    box: tuple[int, int, int, int]


def random_views(mesh: Any, case: str, count: int, seed: int = 0) -> Iterator[View]:
    """Random views of a mesh at 0.6 to 1 m with Kinect-like noise; the same ones every time."""
    from sdftrack.synth.noise import Kinect

    camera = default_camera()
    for i in range(count):
        rng = np.random.default_rng([seed, i, 11])
        T = _random_pose(mesh, rng)
        scene, mask = _compose(mesh, T, camera, case, rng)
        depth = Kinect()(scene.depth, scene.cosine, rng)
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        slack = rng.integers(0, BOX_SLACK_PX + 1, 4)
        left, top = int(columns[0] - slack[0]), int(rows[0] - slack[1])
        right, bottom = int(columns[-1] + slack[2]) + 1, int(rows[-1] + slack[3]) + 1
        yield View(depth, T, mask.astype(np.uint8), (left, top, right - left, bottom - top))


def _random_pose(mesh: Any, rng: np.random.Generator) -> Array:
    T = np.eye(4)
    T[:3, :3] = _random_rotation(rng)
    z = rng.uniform(NEAR_M, FAR_M)
    at = np.array([rng.uniform(-0.2, 0.2) * z, rng.uniform(-0.15, 0.15) * z, z])
    T[:3, 3] = at - T[:3, :3] @ (0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)))
    return T


def _compose(
    mesh: Any, T: Array, camera: Any, case: str, rng: np.random.Generator
) -> tuple[Any, NDArray[np.bool_]]:
    from sdftrack.synth.surroundings import background, mesh_layer

    own = mesh_layer(mesh, camera, T, (200, 200, 200))
    scene = background(camera, "wall", float(T[2, 3]), rng)
    owner = np.zeros(camera.shape, np.int8)
    if case in ("box", "image"):
        return _on_table(mesh, T, camera, scene, own, rng)
    window, nearer = scene.put(own)
    owner[window][nearer] = 1
    if case == "half":
        window, nearer = scene.put(_half_cover(owner == 1, scene.depth, camera, rng))
        owner[window][nearer] = 0
    return scene, owner == 1


def _on_table(
    mesh: Any, T: Array, camera: Any, still: Any, own: Any, rng: np.random.Generator
) -> tuple[Any, NDArray[np.bool_]]:
    """A table under the object and five things that touch it; drawn anew while they hide too much of it."""
    from sdftrack.synth.bodies import Body
    from sdftrack.synth.surroundings import Tabletop

    body = Body(mesh, 0, 0)
    while True:
        scene, owner = still.copy(), np.zeros(camera.shape, np.bool_)
        for layer in Tabletop(body, T[None], rng).layers(camera, T):
            scene.put(layer)
        window, nearer = scene.put(own)
        owner[window] = nearer
        if np.count_nonzero(owner) >= MIN_VISIBLE * np.count_nonzero(own.depth):
            return scene, owner


def _half_cover(
    visible: NDArray[np.bool_], depth: NDArray[np.float32], camera: Any, rng: np.random.Generator
) -> Any:
    """A flat thing 20 to 150 mm before the object, its straight edge such that half of the pixels are hidden."""
    from sdftrack.synth.surroundings import Layer

    angle = rng.uniform(0, 2 * np.pi)
    v, u = np.nonzero(visible)
    along = u * np.cos(angle) + v * np.sin(angle)
    edge = np.quantile(along, 1 - HIDDEN)
    z = float(depth[visible].min()) - rng.uniform(0.02, 0.15)
    vv, uu = np.mgrid[: camera.height, : camera.width]
    inside = (uu * np.cos(angle) + vv * np.sin(angle) > edge) & (
        uu * np.cos(angle) + vv * np.sin(angle) < edge + 1.5 * np.ptp(along) + 40
    )
    image = np.where(inside, z, 0).astype(np.float32)
    return Layer(image, np.ones_like(image), np.zeros((*image.shape, 3), np.uint8))


def where(view: View, case: str) -> dict[str, Any]:
    """What `Tracker.start` is told of a view."""
    if case == "image":
        return {}
    return {"boxes": [view.box]} if case == "box" else {"masks": [view.mask]}


def search(searcher: Any, view: View, case: str, threads: int, camera: Any = None) -> list[dict[str, Any]]:
    """The hypotheses of one view, best first."""
    camera = default_camera() if camera is None else camera
    place: dict[str, Any] = {"image": {}, "box": {"box": view.box}}.get(case, {"mask": view.mask})
    found: list[dict[str, Any]] = searcher.search(view.depth, camera._core, threads=threads, **place)
    return found


def run_mesh(mesh: Any, sdf: Any, case: str, count: int, threads: int) -> dict[str, Any]:
    """All views of one mesh: plain numbers (mm, ms, shares)."""
    import sdftrack as st
    from sdftrack import _core, metrics

    options = st.TrackerOptions()
    searcher = _core.Searcher((sdf.values, sdf.voxel_size, sdf.origin.tolist()), options)
    tracker = st.Tracker(sdf, default_camera(), threads=threads, options=options, recover=False)
    rows = []
    for view in random_views(mesh, case, count):
        seconds = []
        for _ in range(3):
            began = time.perf_counter()
            found = search(searcher, view, case, threads)
            seconds.append(time.perf_counter() - began)
        errors = [metrics.add(h["pose"], view.T, mesh) for h in found]
        first = errors[0] if errors else np.inf
        symmetric = metrics.adds(found[0]["pose"], view.T, mesh) if errors and first > WITHIN_M else first
        score = found[0]["score"] if found else 0.0
        second = found[1]["score"] if len(found) > 1 else 0.0
        result = tracker.start(st.Frame(view.depth, check_units=False), **where(view, case))
        status, confidence = str(result.status[0]), float(result.confidence[0])
        polished = metrics.add(result.pose, view.T, mesh) if status != "lost" else np.inf
        rows.append(
            (
                first, symmetric, polished, score, second, min(seconds), min(errors, default=np.inf), confidence,
                result.seconds, status == "ok",
            )
        )  # fmt: skip
    a = np.array(rows)
    wrong = a[:, 0] > WITHIN_M
    ended_wrong = a[:, 2] > WITHIN_M
    ambiguous = a[:, 4] > AMBIGUOUS * a[:, 3]
    return {
        "views": len(a),
        "within": float(np.mean(~wrong)),
        "within_adds": float(np.mean(a[:, 1] <= WITHIN_M)),
        "within_fitted": float(np.mean(a[:, 2] <= WITHIN_M)),
        "median_mm": 1e3 * float(np.median(a[:, 0])),
        "median_fitted_mm": 1e3 * float(np.median(a[:, 2])),
        "score_right": float(np.quantile(a[~wrong, 3], 0.05)) if (~wrong).any() else float("nan"),
        "score_wrong": float(a[wrong, 3].max()) if wrong.any() else float("nan"),
        "ambiguous": float(np.mean(ambiguous)),
        "wrong_said_ambiguous": float(np.mean(ambiguous[wrong])) if wrong.any() else float("nan"),
        "among_found": float(np.mean(a[:, 6] <= WITHIN_M)),
        "wrong_ok": float(np.mean(ended_wrong & (a[:, 9] > 0))),
        "start_ms": 1e3 * float(np.median(a[:, 8])),
        "start_p95_ms": 1e3 * float(np.quantile(a[:, 8], 0.95)),
        "median_ms": 1e3 * float(np.median(a[:, 5])),
        "p95_ms": 1e3 * float(np.quantile(a[:, 5], 0.95)),
    }


COLUMNS = {
    "mesh": "name",
    "views": "views:d",
    "ADD<5mm": "within:.3f",
    "ADD-S": "within_adds:.3f",
    "fitted": "within_fitted:.3f",
    "listed": "among_found:.3f",
    "median mm": "median_mm:.2f",
    "fitted mm": "median_fitted_mm:.2f",
    "5% score": "score_right:.3f",
    "wrong score": "score_wrong:.3f",
    "ambiguous": "ambiguous:.3f",
    "wrong ambiguous": "wrong_said_ambiguous:.2f",
    "ms": "median_ms:.1f",
    "ms 95 %": "p95_ms:.1f",
    "start ms": "start_ms:.1f",
    "start 95 %": "start_p95_ms:.1f",
    "wrong ok": "wrong_ok:.3f",
}


@experiment(
    "start",
    needs=["meshes"],
    chosen_on="the same meshes, other views of them",
    reported_on="lm_ape, lm_can, lm_cat, lm_driller, lm_duck, lm_glue; 100 views of each, seed 0",
    short={"only": ("lm_cat",), "views": 2, "voxels": 60},
)
def start(
    *,
    data: Path,
    case: Literal["mask", "half", "box", "image"] = "mask",
    only: tuple[str, ...] = MESHES,
    views: int = 100,
    voxels: int = 200,
    threads: int = 2,
    cache: Path | None = None,
) -> Table:
    """Starts without a pose: views of meshes from a mask, half hidden, and on a table from a box and from the image.

    The share of views within 5 mm ADD after the search and after the tracker's own fit, the search's time, and how
    often the first two answers are nearly as good (ambiguous).

    Parameters
    ----------
    case
        what the search is given; half: a mask of which half is hidden
    views
        of each mesh
    """
    rows = {}
    for name in only:
        mesh = load_mesh(data, name)
        sdf = load_sdf(mesh, name, voxels, cache)
        rows[name] = run_mesh(mesh, sdf, case, views, threads)
        say("  ".join(cells(COLUMNS, {"name": name, **rows[name]})))
    title = f"{case}: {views} views of each mesh at {NEAR_M:g} to {FAR_M:g} m, Kinect-like noise, {threads} threads"
    return Table.of(title, COLUMNS, rows)
