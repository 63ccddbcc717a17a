# SPDX-License-Identifier: MIT
"""The functions of one measurement that the thesis plots, and the energy of the core along the same line."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.pictures import Line, Panel, curves
from experiments.registry import experiment
from experiments.table import Table

Array = NDArray[np.float64]
SCALES_MM = (2.0, 5.0, 10.0)  # s of Figure 3.5
SCALES_VOXELS = (1.0, 2.0, 4.0)  # s of Figure 4.4; the thesis uses 2
REACHES_VOXELS = (4.0, 8.0, 20.0)  # sigma_d of Figure 4.6; the thesis uses 8
WIDTHS_VOXELS = (2.0, 4.0, 8.0)  # sigma_G and sigma_H of Figures 4.7 and 4.8; the thesis uses 4
INFLUENCES = (0.0, 0.5, 1.0)  # a of Figure 4.7; the thesis uses 0.5
VOXEL_M = 0.001
LIMITED = 9.99  # the core's log ratio ends at 10


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


@experiment("thesis.4.6", chosen_on="nothing: a formula", reported_on="a flat wall")
def evidence_of_a_voxel() -> Table:
    """Figure 4.6: the likelihood that a voxel is inside, by its distance behind a measurement, Eq. 4.30.

    The core's evidence is that of voxels on the middle ray, before and behind a flat wall at 0.8 m. Printed: equivocal
    on the surface and far from it, nearly 0 just before it and nearly 1 just behind it. Dashed: ours ("smooth"), with
    8 voxels, by which what is before a measurement is free.
    """
    d = np.arange(-60.0, 61.0)
    rows, lines = [], []
    for reach in REACHES_VOXELS:
        printed = 0.5 * (np.sign(d) * np.exp(-np.abs(d) / reach) + 1)
        ratio = _core_ratio(d, reach, "printed")
        told = np.abs(ratio) < LIMITED
        gap = np.abs(1 / (1 + np.exp(-ratio)) - printed)[told]
        sides = {f"at_{x:+g}": float(printed[d == x][0]) for x in (-1.0, 0.0, 1.0)}
        rows.append({"reach": f"{reach:g} voxels", **sides, "gap": 1e6 * float(gap.max())})
        dots = {"linestyle": "", "marker": ".", "color": "k"}
        lines += [
            Line(d, printed, f"printed, {reach:g} voxels"),
            Line(d[told][::3], (1 / (1 + np.exp(-ratio)))[told][::3], "", dots),
        ]
    ours = 1 / (1 + np.exp(-_core_ratio(d, 8.0, "smooth")))
    lines.append(Line(d, ours, "ours, 8 voxels", {"color": "k", "linestyle": "--"}))
    axes = {"title": "4.6: L_in; dots: the core's evidence", "xlabel": "behind the measurement (voxels)"}
    columns = {"sigma_d": "reach", **{f"L_in at {x:+g}": f"at_{x:+g}:.3f" for x in (-1, 0, 1)}}
    columns["core - printed, ppm"] = "gap:.1f"
    return Table.of("Figure 4.6", columns, rows, picture=lambda: curves([[Panel(lines, axes)]], (6.0, 3.6)))


def _core_ratio(d: Array, reach: float, form: Literal["printed", "smooth"]) -> Array:
    """The core's log ratio of inside to outside at voxels that far (voxels) behind a wall; `reach` in voxels."""
    camera = st.Camera(400.0, 400.0, 20.0, 20.0, 41, 41)
    frame = st.Frame(np.full((41, 41), 0.8, np.float32))
    grid = ((len(d), 2, 2), VOXEL_M, (0.0, 0.0, 0.8 + VOXEL_M * d[0]))
    ratio = st.levelset.evidence(frame, camera, np.eye(4), grid, form=form, sigma_d_m=VOXEL_M * reach)
    return ratio[:, 0, 0].astype(np.float64)


@experiment("thesis.4.7", chosen_on="nothing: a formula", reported_on="the formula")
def initial_guess() -> Table:
    """Figure 4.7: the first guess that a voxel is inside, by the distance in the first shape, Eq. 4.34; and ours."""
    d = np.linspace(-30, 30, 241)

    def guess(a: float, width: float) -> Array:
        out: Array = a * _sigmoid(-d / width) + (1 - a) * 0.5
        return out

    shown = {f"a {a:g}, sigma_G 4": guess(a, 4.0) for a in INFLUENCES}
    shown |= {f"a 0.5, sigma_G {w:g}": guess(0.5, w) for w in WIDTHS_VOXELS if w != 4}
    shown["ours"] = _sigmoid(st.ReconstructorOptions().prior * np.tanh(-d / 4))
    return _of_distance("4.7", "G", d, shown)


@experiment("thesis.4.8", chosen_on="nothing: a formula", reported_on="the formula")
def smoothed_step() -> Table:
    """Figure 4.8: the smoothed step, the probability that a voxel is outside by its distance, Eq. 4.38."""
    d = np.linspace(-30, 30, 241)
    return _of_distance("4.8", "H", d, {f"sigma_H {w:g}": _sigmoid(d / w) for w in WIDTHS_VOXELS})


def _sigmoid(x: Array) -> Array:
    return np.asarray(1 / (1 + np.exp(-x)))


def _of_distance(figure: str, name: str, d: Array, shown: dict[str, Array]) -> Table:
    """A panel of curves over the distance (voxels), and their values deep inside, on the surface and far outside."""
    rows = [
        {"curve": label, **{f"at_{x}": float(np.interp(x, d, y)) for x in (-30, 0, 30)}}
        for label, y in shown.items()
    ]
    panel = Panel(
        [Line(d, y, label) for label, y in shown.items()],
        {"title": f"{figure}: {name}", "xlabel": "distance (voxels)"},
    )
    columns = {"curve": "curve", **{f"{name} at {x:+d}": f"at_{x}:.3f" for x in (-30, 0, 30)}}
    return Table.of(f"Figure {figure}", columns, rows, picture=lambda: curves([[panel]], (6.0, 3.6)))
