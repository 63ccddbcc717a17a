# SPDX-License-Identifier: MIT
"""The functions of one measurement that the thesis plots, and the energy of the core along the same line."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.pictures import Line, Panel, curves
from experiments.registry import experiment
from experiments.table import Table

Array = NDArray[np.float64]
SCALES_MM = (2.0, 5.0, 10.0)  # s of Figure 3.5
SCALES_VOXELS = (1.0, 2.0, 4.0)  # s of Figure 4.4; the thesis uses 2


@experiment("thesis.3.5", chosen_on="nothing: a formula", reported_on="a flat wall before a box")
def likelihood_of_a_measurement() -> Table:
    """Figure 3.5: the likelihood of one measurement by its distance from the surface, Eq. 3.11.

    The core's energy is that of a wall parallel to the face of a box, moved towards it: every measurement is at the
    same distance. Its exponential, scaled at the surface, is to be the printed function.
    """
    d_mm = np.linspace(-30, 30, 121)
    rows, lines = [], []
    for s_mm in SCALES_MM:
        printed = density(d_mm, s_mm)
        core = _core_likelihood(d_mm / 1e3, s_mm / 1e3) * density(np.zeros(1), s_mm)
        half = 2 * s_mm * np.arccosh(np.sqrt(2))  # where the density has fallen to a half
        rows.append({"s": f"{s_mm:g} mm", "peak": printed.max(), "half": half,
                     "gap": 1e6 * float(np.abs(core - printed).max() / printed.max())})  # fmt: skip
        lines += [
            Line(d_mm, printed, f"printed, {s_mm:g} mm"),
            Line(d_mm[::4], core[::4], "", {"linestyle": "", "marker": ".", "color": "k"}),
        ]
    panel = Panel(lines, {"title": "3.5: P(Z | phi, p); dots: the core's energy", "xlabel": "distance (mm)"})
    columns = {
        "s": "s",
        "peak per mm": "peak:.4f",
        "half of it at, mm": "half:.2f",
        "core - printed, ppm": "gap:.1f",
    }
    return Table.of("Figure 3.5", columns, rows, picture=lambda: curves([[panel]], (6.0, 3.6)))


def density(d: Array, s: float) -> Array:
    """Eq. 3.11 in the form that does not overflow."""
    out: Array = 1 / (4 * s * np.cosh(d / (2 * s)) ** 2)
    return out


def _core_likelihood(d_m: Array, s_m: float) -> Array:
    """exp(-E / n) of the core for a wall `d_m` in front of a box's face, relative to that on the face."""
    camera = st.Camera(400.0, 400.0, 20.0, 20.0, 41, 41)
    box = st.SDF.box((0.4, 0.4, 0.2), voxels=200, padding=0.06)
    T = st.geometry.pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.9))  # the face at 0.8 m fills the image
    frame = st.Frame(np.full((41, 41), 0.8, np.float32))
    energy = st.energy.Energy(
        box, camera, frame, T, scale_m=s_m, residual="point", outlier_floor=0.0, padding_m=0.05
    )
    costs = []
    for d in d_m:
        T[2, 3] = 0.9 + d
        costs.append(energy.cost(st.energy.State(T[None])))
    n = len(energy.residuals(energy.start)["residual_m"])
    out: Array = np.exp(-(np.array(costs) - energy.cost(energy.start)) / n)
    return out


@experiment("thesis.4.4", chosen_on="nothing: a formula", reported_on="the formulas")
def on_and_outside() -> Table:
    """Figure 4.4: the smoothed delta function on the surface and the step outside it, Eqs. 4.12 and 4.13."""
    d = np.linspace(-12, 12, 481)
    rows, panels = [], []
    for s in SCALES_VOXELS:
        delta = 1 / np.cosh(d / (2 * s)) ** 2
        step = np.where(d >= 0, 1 - delta, 0)
        rows.append({"s": f"{s:g} voxels", "equal": float(np.interp(0.0, (step - delta)[d >= 0], d[d >= 0]))})
        lines = [Line(d, delta, "delta, on the surface"), Line(d, step, "H, outside")]
        panels.append(Panel(lines, {"title": f"4.4: s = {s:g} voxels", "xlabel": "distance (voxels)"}))
    columns = {"s": "s", "a voxel is as likely outside as on the surface at": "equal:.2f"}
    return Table.of("Figure 4.4", columns, rows, picture=lambda: curves([panels], (12.0, 3.4)))
