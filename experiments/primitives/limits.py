# SPDX-License-Identifier: MIT
"""How well a view can tell a solid at all: Cramer-Rao bounds of the true geometry, beside what a fit makes of it.

Nothing of the fit's own energy is used for the readings: their derivatives are differences of exactly rendered depth.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from experiments.common.primitive_errors import is_own, measure
from experiments.primitives.solids import CAMERA, NOISES
from experiments.registry import experiment
from experiments.synth.solids import SolidScene, random_solid, ray_depth, standing_scene
from experiments.table import Table
from sdftrack import _core
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.primitives import PrimitiveFit, fit_primitive
from sdftrack.synth.noise import Gaussian, Kinect, Noise

Array = NDArray[np.float64]
STEP = 1e-5  # m, rad, share of a length; exact depth bends little within it
GRAZING = float(np.cos(np.radians(75)))  # a Kinect's readings fade out between 70 and 80 degrees
PIXEL_VARIANCE = 1 / 12  # px^2, of an edge that is known to a pixel
TABLE_SD_M = {"1 mm": 1e-5, "Kinect": 3e-5}  # of the plane of all readings (results.md)
VAGUE = (0.3, np.pi, 2.0)  # m, rad, log: what is known beforehand, so that turns about an axis do no harm
ORDER = ("sphere", "cylinder", "cone", "box", "ellipsoid")
CASES = (  # kind, noise, what is over its limit (deg, or share), limit
    ("ellipsoid", "1 mm", "axis", 0.3),
    ("cone", "1 mm", "axis", 0.3),
    ("cone", "1 mm", "size", 0.01),
    ("cone", "Kinect", "size", 0.02),
)


def bound(scene: SolidScene, noise: Noise, camera: Camera, table_sd_m: float, edges: bool = True) -> Array:
    """(6 + n, 6 + n) covariance of (v, w, log lengths) at the truth that no unbiased estimate undercuts.

    `edges`: the outline, as so many independent edge pixels each known to a pixel, and the table count too.
    """
    rays = _rays(camera)
    on = scene.mask.ravel()
    J = _depth_slopes(scene, rays[on])
    sd = _reading_sd(scene, noise, camera)[on]
    seen = np.isfinite(J).all(axis=1)
    if isinstance(noise, Kinect):
        seen &= scene.cosine.ravel()[on] > GRAZING
    A = (J[seen] / sd[seen, None] ** 2).T @ J[seen]
    if edges:
        rows, sds = _edge_rows(scene, camera, rays, noise)
        A += (rows / sds[:, None] ** 2).T @ rows
        gap = _gap_slopes(scene)
        A += np.outer(gap, gap) / table_sd_m**2
    n = len(scene.size)
    prior = np.repeat(np.array(VAGUE), (3, 3, n))
    return np.asarray(np.linalg.inv(A + np.diag(1 / prior**2)))


def _rays(camera: Camera) -> Array:
    return camera.back_project(np.ones(camera.shape, np.float32)).astype(np.float64).reshape(-1, 3)


def _moved(scene: SolidScene, d: Array) -> tuple[Array, dict[str, float]]:
    """T_obj_cam and lengths after an increment (small: to first order, then made orthogonal)."""
    K = np.array([[0, -d[5], d[4]], [d[5], 0, -d[3]], [-d[4], d[3], 0]])
    u, _, vt = np.linalg.svd(np.eye(3) + K)
    step = np.eye(4)
    step[:3, :3], step[:3, 3] = u @ vt, d[:3]
    size = {k: float(v * np.exp(s)) for (k, v), s in zip(scene.size.items(), d[6:], strict=True)}
    return step @ np.linalg.inv(scene.T_cam_obj), size


def _depth_slopes(scene: SolidScene, rays: Array) -> Array:
    """d depth / d unknowns (N, 6 + n) by central differences; nan where a ray does not meet all of them."""
    n = 6 + len(scene.size)

    def depth(d: Array) -> Array:
        T, size = _moved(scene, d)
        z, _ = ray_depth(scene.kind, size, T[:3, 3], rays @ T[:3, :3].T)
        return np.where(np.isfinite(z), z, np.nan)

    return np.column_stack([(depth(STEP * e) - depth(-STEP * e)) / (2 * STEP) for e in np.eye(n)])


def _reading_sd(scene: SolidScene, noise: Noise, camera: Camera) -> Array:
    z = scene.depth.astype(np.float64)
    if isinstance(noise, Gaussian):
        return np.full(z.size, noise.sigma_m)
    assert isinstance(noise, Kinect)
    step = z**2 / (8 * noise.baseline_m_px)  # of the disparity
    slope_y, slope_x = np.gradient(z)  # m per pixel; at the rim too large, so that it says little
    lateral = noise.lateral_px * np.hypot(slope_x, slope_y)
    return np.sqrt(noise.sigma_m(z) ** 2 + step**2 / 12 + lateral**2).ravel()


def _edge_rows(scene: SolidScene, camera: Camera, rays: Array, noise: Noise) -> tuple[Array, Array]:
    """Slopes of the clearance of the object's last pixels before what is clearly behind it, and deviations (m)."""
    depth, on = scene.depth, scene.mask
    edge = np.zeros_like(on)
    for axis, shift in ((0, 1), (0, -1), (1, 1), (1, -1)):
        beside = np.roll(on, shift, axis)
        far = np.roll(depth, shift, axis) > depth + 0.02
        edge |= on & ~beside & far
    at = np.flatnonzero(edge.ravel())
    T, size = np.linalg.inv(scene.T_cam_obj), list(scene.size.values())
    kind = _core.PrimitiveKind.__members__[scene.kind]
    z = depth.ravel()[at].astype(np.float64)
    rows = np.array(
        [
            _core.primitive_clearance(kind, size, T, rays[i].tolist(), zi - 0.3, zi + 0.3)[1]
            for i, zi in zip(at, z, strict=True)
        ]
    ).reshape(-1, 6 + len(size))  # a low solid may have no step of depth behind it at all
    rows[:, 6:] *= size  # by the logarithms
    extra = noise.lateral_px**2 if isinstance(noise, Kinect) else 0.0
    return rows, z / camera.fx * np.sqrt(PIXEL_VARIANCE + extra)


def _gap_slopes(scene: SolidScene) -> Array:
    """d (gap to the table) / d unknowns by differences."""
    kind = _core.PrimitiveKind.__members__[scene.kind]
    normal, offset = scene.plane

    def gap(d: Array) -> float:
        T, size = _moved(scene, d)
        m = T[:3, :3] @ normal
        reach = _core.primitive_reach(kind, list(size.values()), (-m).tolist())[0]
        return float(offset - m @ T[:3, 3] - reach)

    n = 6 + len(scene.size)
    return np.array([(gap(STEP * e) - gap(-STEP * e)) / (2 * STEP) for e in np.eye(n)])


def _worst_sds(covariance: Array, kind: str, own: list[int]) -> tuple[float, float]:
    """Of an increment's covariance: the largest relative deviation of a length, and of an axis's direction (deg)."""
    turn = np.diag(covariance)[3:6]
    axes = own if kind == "ellipsoid" else [2]
    size = float(np.sqrt(np.diag(covariance)[6:].max()))
    return size, max((float(np.degrees(np.sqrt(turn.sum() - turn[j]))) for j in axes), default=float("nan"))


@experiment(
    "primitives.limits",
    chosen_on="the views of `primitives.synthetic`",
    reported_on="the worst of the same views",
    short={"n": 2, "most": 1},
)
def limits(*, n: int = 200, most: int = 5) -> Table:
    """How well views that are over their limit could be known at all: Cramer-Rao bounds beside the fit.

    Parameters
    ----------
    n
        solids of each kind
    most
        rows of each case, the worst first
    """
    rows = []
    fits: dict[tuple[str, str], list[tuple[int, SolidScene, PrimitiveFit]]] = {}
    for kind, name, what, limit in CASES:
        if (kind, name) not in fits:
            fits[kind, name] = [_fitted(kind, i, NOISES[name][0], CAMERA) for i in range(n)]
        errors = [measure(fit, scene) for _, scene, fit in fits[kind, name]]
        values = np.array([e.size if what == "size" else e.axis_deg for e in errors])
        stated = np.array([e.size_sd if what == "size" else e.axis_sd_deg for e in errors])
        over = [int(k) for k in np.argsort(-np.nan_to_num(values)) if values[k] > limit]
        for k in over[:most]:
            i, scene, _ = fits[kind, name][k]
            radii = np.array(list(scene.size.values()))
            own = [j for j in range(3) if is_own(radii, j)] if kind == "ellipsoid" else []
            at = 0 if what == "size" else 1
            both = [
                _worst_sds(bound(scene, NOISES[name][0], CAMERA, TABLE_SD_M[name], edges), kind, own)[at]
                for edges in (False, True)
            ]
            unit = 100 if what == "size" else 1
            numbers = [unit * v for v in (values[k], stated[k], *both)]
            rows.append(
                [f"{kind}, {what}, {name}, {i}", str(np.count_nonzero(scene.mask)), *(f"{v:.2f}" for v in numbers),
                 f"{values[k] / stated[k]:.1f}", f"{values[k] / both[0]:.1f}", f"{values[k] / both[1]:.1f}"]
            )  # fmt: skip
    head = [
        "view", "pixels", "error", "stated sd", "depth alone", "+ edge, table",
        "error / stated", "/ depth", "/ all",
    ]  # fmt: skip
    title = f"The worst {most} of {n} views over their limit: error and deviations (deg of the axis, % of the size)"
    return Table(title, head, rows)


def _fitted(kind: str, i: int, noise: Noise, camera: Camera) -> tuple[int, SolidScene, PrimitiveFit]:
    rng = np.random.default_rng([ORDER.index(kind), i])
    scene = standing_scene(kind, random_solid(kind, rng), camera, rng)
    frame = Frame(noise(scene.depth, scene.cosine, rng))
    return i, scene, fit_primitive(frame, kind, camera=camera)
