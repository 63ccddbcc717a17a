# SPDX-License-Identifier: MIT
"""Depth-to-colour registration by a ball."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.common.protocol import say
from experiments.pictures import around, images
from experiments.registry import experiment
from experiments.synth.ball import COLOR_CAMERA, DEPTH_CAMERA, BallScene, ball_path, ball_scene
from experiments.table import Table
from sdftrack import _core
from sdftrack.calibration.color_result import BallPairs, ColorMapping, Fit, fit_from
from sdftrack.calibration.color_to_depth import registered, result_of
from sdftrack.calibration.observe import ball_model, guessed_camera, watch
from sdftrack.calibration.statistics import student_t975
from sdftrack.viz.overlay import depth_picture

Array = NDArray[np.float64]
POINTS = 3000
OFFSET_S = 0.021
LENS = st.Camera(920.0, 922.0, 641.0, 352.0, 1280, 720, (0.12, -0.25, 0.001, -0.0005, 0.1))
OWN_M, AROUND_M = 0.01, 0.11  # of the sphere's surface: readings of the ball; what is shown around it
SETTINGS: dict[str, dict[str, Any]] = {
    "1 mm": {"noise": 0.001},
    "Kinect": {"noise": "kinect"},
    "Kinect, colour 21 ms late": {"noise": "kinect", "time_offset_s": OFFSET_S},
    "Kinect, 10 ms exposure": {"noise": "kinect", "exposure_s": 0.01},
    "Kinect, 1280 x 720 with a lens": {"noise": "kinect", "color_camera": LENS},
}


class Row:
    """What one recording gave: with P, q and with the colour camera known."""

    def __init__(self, scene: BallScene, result: Any, raw_px: Array) -> None:
        points = scene.random_points(POINTS)
        e = result.project(points) - scene.camera.project_to_color(points)
        self.rms_px = float(np.sqrt((e**2).sum(axis=1).mean()))
        self.worst_px = float(np.linalg.norm(e, axis=1).max())
        self.stated_px = float(np.sqrt((result.sd_px(points) ** 2).sum(axis=1).mean()))
        self.inside = float(np.mean(np.abs(e) < result.half_width95_px(points)))
        kept = result.pairs.kept
        index = result.pairs.index[kept]
        off = result.pairs.color_px[kept] - scene.color_px[index]
        self.bias_px = float(np.linalg.norm(off.mean(axis=0)))
        self.center_px = float(np.sqrt((off**2).sum(axis=1).mean()))
        self.uncorrected_px = float(np.sqrt(((raw_px[kept] - scene.color_px[index]) ** 2).sum(axis=1).mean()))
        self.kept = int(np.count_nonzero(kept))
        self.late_ms = 1e3 * (result.time_offset_s - scene.time_offset_s)
        self.late_sd_ms = 1e3 * result.time_offset_sd_s


def judged(scene: BallScene, both: bool = True) -> dict[str, Row]:
    """Look at the recording once, register it with P, q and with the colour camera known."""
    color = scene.camera.color
    assert color is not None
    late = scene.time_offset_s != 0
    ways = {"P, q": None, "camera known": color} if both else {"camera known": color}
    looked = watch(scene.sequence, scene.camera.depth, scene.radius_m, scene.color, None, color, 0, 0, None)
    rows = {}
    for way, known in ways.items():
        fit, pairs = registered(looked, scene.camera.depth, known, late, 0)
        middles = {s.index: _middle(s.outlines[0]) for s in looked.recording.frames if s.outlines}
        raw = np.array([middles[i] for i in pairs.index])
        rows[way] = Row(scene, result_of(fit, pairs, looked.color_size, late), raw)
    if both and not late:
        with warnings.catch_warnings():  # of the residuals, which are in the table
            warnings.simplefilter("ignore")
            printed = st.calibrate_color_to_depth(
                scene.sequence, scene.camera.depth, scene.radius_m, scene.color, method="printed"
            )
        rows["P, q, as printed"] = Row(scene, printed, printed.pairs.color_px)
    return rows


def _middle(outline: Any) -> Array:
    """Centre of an ellipse through the edges: what the cone corrects."""
    import cv2

    (x, y), _, _ = cv2.fitEllipseDirect(outline.edges_px.astype(np.float32))
    return np.array([x, y])


def fit_pairs(pairs: BallPairs, depth: st.Camera, time_offset: bool = False) -> Fit | None:
    """The mapping that most pairs agree with, refined on them; None if there is none."""
    names = ("center_cam", "center_covariance", "color_px", "color_covariance", "time_s")
    fit: Any = _core.fit_color_map
    arrays = [np.ascontiguousarray(getattr(pairs, name), dtype=np.float64) for name in names]
    found = fit(*arrays, None, time_offset, 0)
    return None if found is None else fit_from(found, depth, None)


def coverage_of_pairs(runs: int, n: int = 60, seed: int = 0, noise_px: float = 0.1) -> tuple[float, float]:
    """Share of 95 % intervals that hold the truth, over (P, q) and over mapped points, for simulated pairs."""
    depth, T = DEPTH_CAMERA, st.geometry.pose((0.01, -0.01, 0.005), (-0.025, 0, 0))
    truth = ColorMapping(depth, M=COLOR_CAMERA.K @ T[:3])
    rng = np.random.default_rng(seed)
    true_px, hits, mapped = None, [], []
    P, q, _ = truth.Pq()
    wanted = np.append(P.ravel(), q)
    for run in range(runs):
        p = ball_path(run)(np.arange(n) / 15)
        true_px = truth.predict(p)[0]
        C = np.tile(np.diag([4e-8, 4e-8, 1e-8]), (n, 1, 1))
        pairs = BallPairs(
            np.arange(n), p + rng.normal(size=(n, 3)) * np.sqrt([4e-8, 4e-8, 1e-8]), C,
            true_px + noise_px * rng.normal(size=(n, 2)), np.tile(noise_px**2 * np.eye(2), (n, 1, 1)),
            np.full(n, 20.0), np.arange(n) / 15, np.full((n, 2), np.nan), np.ones(n, bool),
        )  # fmt: skip
        fit = fit_pairs(pairs, depth)
        if fit is None:  # as the calibration refuses them
            continue
        t975 = student_t975(fit.freedom)
        P, q, G = fit.map.Pq()
        sd = np.sqrt(np.diag(G @ fit.covariance @ G.T))
        hits.append(np.abs(np.append(P.ravel(), q) - wanted) < t975 * sd)
        x, J = fit.map.predict(p[::6])
        spread = np.sqrt(np.einsum("nka,ab,nkb->nk", J, fit.covariance, J))
        mapped.append(np.abs(x - true_px[::6]) < t975 * spread)
    return float(np.mean(hits)), float(np.mean(mapped))


@experiment(
    "color_calibration",
    chosen_on="the same synthetic scenes, seeds 0 to 3",
    reported_on="synthetic scenes, seeds 0 to 3: the same",
    short={"only": "1 mm", "seeds": 1, "frames": 20, "runs": 3},
)
def color_calibration(*, only: str = "", seeds: int = 4, frames: int = 60, runs: int = 300) -> list[Table]:
    """Depth-to-colour registration by a ball: error of the mapping, bias of the centres, time offset, intervals.

    Parameters
    ----------
    only
        settings with this in their name
    runs
        of simulated pairs
    """
    cells = []
    for name, setting in SETTINGS.items():
        if only not in name:
            continue
        found: dict[str, list[Row]] = {}
        for seed in range(seeds):
            lens = "lens" in name
            for way, row in judged(ball_scene(frames, seed=seed, **setting), not lens).items():
                found.setdefault(way, []).append(row)
        cells += [_cells(f"{name}; {way}", rows) for way, rows in found.items()]
        say(name)
    head = [
        "noise; unknown", "rms px, worst seed", "worst point", "stated", "in 95 %", "centres' bias", "centres' rms",
        "ellipse's", "time ms, worst", "time stated", "kept",
    ]  # fmt: skip
    title = (
        f"{frames} frames, {seeds} seeds, {POINTS} random points of the volume; wanted: rms <= 0.3 px, "
        "bias < 0.1 px, time within 3 ms"
    )
    parameters, points = coverage_of_pairs(runs)
    shares = [["P, q", f"{100 * parameters:.1f}"], ["mapped points", f"{100 * points:.1f}"]]
    return [
        Table(title, head, cells),
        Table(f"Simulated pairs, {runs} runs: share of 95 % intervals that hold", ["of", "hold %"], shares),
    ]


def _cells(name: str, rows: list[Row]) -> list[str]:
    late = max(rows, key=lambda r: abs(r.late_ms))
    timed = late.late_sd_ms > 0
    return [
        name,
        f"{max(r.rms_px for r in rows):.3f}",
        f"{max(r.worst_px for r in rows):.2f}",
        f"{np.mean([r.stated_px for r in rows]):.3f}",
        f"{np.mean([r.inside for r in rows]):.0%}",
        f"{max(r.bias_px for r in rows):.3f}",
        f"{max(r.center_px for r in rows):.3f}",
        f"{max(r.uncorrected_px for r in rows):.2f}",
        f"{late.late_ms:+.2f}" if timed else "",
        f"{late.late_sd_ms:.2f}" if timed else "",
        str(min(r.kept for r in rows)),
    ]


# -- Figure 3.14: what the two cameras show of the ball, and P, q from its centres


@experiment(
    "thesis.3.14",
    chosen_on="nothing was chosen here",
    reported_on="a rendered ball, seed 0",
    short={"frames": 60},
)
def seen_by_both(*, frames: int = 120) -> Table:
    """Figure 3.14: a ball on a wand, found in colour and in depth; P and q from its centres.

    Rendered: a ball of 80 mm with a Kinect's noise, a wand, a hand, coloured rods before a wall; the thesis has a
    recording. "P, q" is the package's way, weighted and robust; "as printed" that of the thesis, a Hough circle, the
    sphere's SDF moved by translation and the 2-norm (``method="printed"``); "camera known": of the colour camera only
    the pose is sought. "pairs" is the residual of the pairs that were kept, the others are errors at random points of
    the volume. Printed: pictures only, no residual.
    """
    scene = ball_scene(frames, noise="kinect", fps=30.0)
    recording, lens = list(scene.sequence), scene.camera.depth
    points = scene.random_points(POINTS)
    truth = scene.camera.project_to_color(points)
    ways: dict[str, dict[str, Any]] = {
        "P, q": {}, "P, q, as printed": {"method": "printed"}, "camera known": {"color_camera": scene.camera.color}
    }  # fmt: skip
    rows = []
    for way, more in ways.items():
        with warnings.catch_warnings():  # of the residuals, which are in the table
            warnings.simplefilter("ignore")
            found = st.calibrate_color_to_depth(recording, lens, scene.radius_m, scene.color, **more)
        off = np.linalg.norm(found.project(points) - truth, axis=1)
        row = {"way": way, "used": int(np.count_nonzero(found.pairs.kept)), "pairs": found.rms_px}
        rows.append({**row, "rms": float(np.sqrt((off**2).mean())), "worst": float(off.max())})
    columns = {"way": "way", "frames used": "used:d", "pairs, rms px": "pairs:.3f", "rms px": "rms:.3f"}
    return Table.of(
        f"Figure 3.14, {frames} frames of a ball of {2e3 * scene.radius_m:.0f} mm",
        {**columns, "worst px": "worst:.2f"},
        rows,
        picture=lambda: _stages(scene, recording),
    )


def _color_model(scene: BallScene, frames: list[st.Frame]) -> Any:
    colors = [np.asarray(f.color) for f in frames[::3]]
    size = colors[0].shape[1], colors[0].shape[0]
    return ball_model(colors, scene.color, guessed_camera(*size), 0)


def _stages(scene: BallScene, frames: list[st.Frame]) -> Any:
    """The frame in the middle: colour, the ball's pixels, its outline; depth, the ball's readings, its outline."""
    import cv2

    lens, color = scene.camera.depth, scene.camera.color
    assert color is not None
    frame = frames[len(frames) // 2]
    image = np.ascontiguousarray(frame.color, np.uint8)
    mask = _color_model(scene, frames).mask(image)
    outline = _core.find_outlines(image, mask, color._core, 0)[0]
    ellipse = np.zeros(image.shape[:2], np.uint8)
    cv2.ellipse(ellipse, cv2.fitEllipseDirect(outline.edges_px.astype(np.float32)), 1, -1)
    depth = np.asarray(frame.depth)
    ball = _core.BallFinder(lens._core, scene.radius_m).search(np.ascontiguousarray(depth))[0]
    center = np.asarray(ball.center_cam)
    off = np.linalg.norm(lens.back_project(depth) - center, axis=-1) - scene.radius_m
    own = (depth > 0) & (np.abs(off) < OWN_M)
    disc = st.SDF.sphere(scene.radius_m, voxels=60).silhouette(lens, st.geometry.pose(t_m=center)) > 0
    there = st.geometry.transform_points(np.asarray(scene.camera.T_color_depth), center[None])[0]

    def rgb(some: Any) -> Any:
        return np.repeat(255 * some[..., None].astype(np.uint8), 3, axis=2)

    above = [
        around(picture, there, color, AROUND_M) for picture in (image, rgb(mask > 0), image, rgb(ellipse))
    ]
    below = [
        around(picture, center, lens, AROUND_M)
        for picture in (depth_picture(depth), rgb(own), depth_picture(depth), rgb(disc))
    ]
    names = (
        ("a) colour", "b) ball or not", "c) its outline"),
        ("d) depth", "e) readings of the ball", "f) the sphere"),
    )
    return images(
        {
            kind: list(zip(titles, row[:3], strict=True))
            for kind, titles, row in zip(("colour", "depth"), names, (above, below), strict=True)
        },
        2.6,
        {(0, 2): above[3][..., 0] > 0, (1, 2): below[3][..., 0] > 0},
    )
