# SPDX-License-Identifier: MIT
"""Figure 3.16: primitives of arbitrary size are fitted to a point cloud as rigid bodies, then in size too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.common.primitive_errors import measure
from experiments.data import has
from experiments.pictures import around, images
from experiments.primitives.kinect_objects import objects_of, surface_distance
from experiments.primitives.solids import CAMERA
from experiments.registry import experiment
from experiments.synth.solids import SolidScene, random_solid, standing_scene
from experiments.table import Table
from sdftrack.primitives import PrimitiveFit, fit_primitive
from sdftrack.primitives.result import volume_of
from sdftrack.synth.noise import Kinect
from sdftrack.viz.overlay import depth_picture
from sdftrack.viz.primitives import draw_primitives

ARBITRARY_M: dict[str, dict[str, float]] = {  # where every object begins
    "sphere": {"radius": 0.06},
    "cylinder": {"radius": 0.04, "height": 0.12},
    "cone": {"radius": 0.04, "height": 0.12},
}
RECORDED = ("43", 2)  # scene and object of osd: a cylinder
SCALES_M = (0.02, 0.005)  # of the rigid fit, one after the other
PRINTED: dict[str, Any] = {"residual": "point", "outlier_floor": 0.0, "padding_m": 0.2}  # Eqs. 3.11 and 3.12
STEPS = ("a) arbitrary size", "b) rigid fit", "c) size and pose", "c) as printed")
UPWARDS = np.array([0.0, -0.8, -0.6])  # of the recorded camera, about; it looks down on a table
SHOWN_M = 0.17
Array = NDArray[np.float64]


@experiment(
    "thesis.3.16",
    uses=["osd"],
    chosen_on="of six recorded cylinders one of the two that this start reaches",
    reported_on="a sphere, a cylinder and a cone, seed 2 each; a cylinder of osd",
)
def adapted(*, data: Path) -> Table:
    """Figure 3.16: a sphere, a cylinder and a cone: arbitrary size, rigid fit, size and pose together.

    Rendered solids of a random size on a table, a Kinect's noise, and, where the data have the part `osd`, a recorded
    cylinder of unknown size. The object's mask is given, in place of the removal of the ground (Figure 3.15). a) a
    primitive of that kind and of a size that has nothing to do with the object's, upright at the middle of its
    readings; b) its SDF tracked to them by the energy of Eq. 3.12; c) pose and size together from there, by the exact
    distance, and by the scaled field of Eq. 3.27 ("as printed"). "off": median distance of the readings from the
    surface. Of six recorded cylinders this start reaches two, the one here among them; the guesses that `fit_primitive`
    makes by itself reach all (`primitives.osd`). Printed: pictures of the three steps, no numbers.
    """
    rows: list[dict[str, Any]] = []
    pictures: dict[str, list[tuple[str, Any]]] = {}
    for name, (frame, mask, up, scene) in _objects(data).items():
        kind = name.split()[-1]
        fits = _steps(frame, mask, kind, up)
        lens, middle = frame.camera, _middle(frame, mask)
        pictures[name] = [("depth", around(depth_picture(np.asarray(frame.depth)), middle, lens, SHOWN_M))]
        for step, fit in zip(STEPS, fits, strict=True):
            rows.append({"step": f"{name}, {step}", **_row(fit, frame, mask, scene)})
            drawn = draw_primitives(st.Frame(frame.depth, camera=lens), [fit], lens)
            pictures[name].append((step, around(drawn, middle, lens, SHOWN_M)))
    columns = {
        "solid, step": "step",
        "size error %": "size:.2f",
        "axis error deg": "axis:.2f",
        "off mm": "off:.2f",
    }
    return Table.of("Figure 3.16", columns, rows, picture=lambda: images(pictures, 2.1))


def _objects(data: Path) -> dict[str, tuple[st.Frame, NDArray[np.bool_], Array, SolidScene | None]]:
    """Frame, mask, upward direction (camera frame) and truth, where it is known, by name."""
    out: dict[str, tuple[st.Frame, NDArray[np.bool_], Array, SolidScene | None]] = {}
    for kind in ARBITRARY_M:
        rng = np.random.default_rng(2)
        scene = standing_scene(kind, random_solid(kind, rng), CAMERA, rng, (0.6, 0.8))
        frame = st.Frame(Kinect()(scene.depth, scene.cosine, rng), camera=CAMERA)
        out[kind] = frame, scene.mask, scene.plane[0], scene
    if has("osd", data):
        frame, masks = objects_of(data / "osd", RECORDED[0])
        out["recorded cylinder"] = frame, masks[RECORDED[1]], UPWARDS, None
    return out


def _middle(frame: st.Frame, mask: NDArray[np.bool_]) -> Array:
    assert frame.camera is not None
    points = st.energy.back_project(np.asarray(frame.depth), frame.camera, mask)[0]
    return np.asarray(np.median(points, axis=0))


def _steps(frame: st.Frame, mask: NDArray[np.bool_], kind: str, up: Array) -> list[PrimitiveFit]:
    """The primitive after each of `STEPS`."""
    assert frame.camera is not None
    size = ARBITRARY_M[kind]
    T = np.eye(4)
    side = np.cross(up, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    T[:3, :3], T[:3, 3] = np.column_stack([side, np.cross(up, side), up]), _middle(frame, mask)
    first = _given(kind, T, size)
    sdf, own = volume_of(kind, size), np.where(mask, np.asarray(frame.depth), 0).astype(np.float32)
    for scale in SCALES_M:
        energy = st.energy.Energy(sdf, frame.camera, st.Frame(own), T, scale_m=scale, **PRINTED)
        T = st.energy.minimize(energy).x.poses[0]
    rigid = _given(kind, T, size)
    joint = [
        fit_primitive(frame, kind, mask=mask, initial=(T, size), scaling=scaling)
        for scaling in ("exact", "printed")
    ]
    return [first, rigid, *joint]


def _given(kind: str, T: Array, size: dict[str, float]) -> PrimitiveFit:
    n = 6 + len(size)
    return PrimitiveFit(kind, T, size, np.zeros((n, n)), 0.0, 1.0, st.Status.OK)


def _row(
    fit: PrimitiveFit, frame: st.Frame, mask: NDArray[np.bool_], scene: SolidScene | None
) -> dict[str, Any]:
    off = 1e3 * float(np.median(surface_distance(fit, frame, mask)))
    if scene is None:
        return {"off": off}
    error = measure(fit, scene)
    return {
        "off": off,
        "size": 100 * error.size,
        "axis": None if np.isnan(error.axis_deg) else error.axis_deg,
    }
