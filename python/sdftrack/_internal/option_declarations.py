# SPDX-License-Identifier: MIT
"""The options not used by the core, one line each, described like those of the core."""

from __future__ import annotations

from sdftrack._internal.option_schema import Option, core_schema

__all__ = ["BURN_IN", "TABLES", "schema_of"]

# fmt: off
# ruff: noqa: E501 (an option is a line)
RECONSTRUCT = (
    Option("prior", "number", 0.4, min=0, meaning="log ratio of the initial guess, positive inside, negative outside; 0: no prior"),
    Option("min_seen", "number", 0.15, min=0, meaning="a surface patch is used for tracking once it has been observed in this many (frontal) views"),
    Option("padding_m", "number", 0.02, "m", min=0, min_open=True, meaning="pixels within this distance of the current shape are considered in the next frame"),
    Option("planes", "bool", True, meaning="planes that extend beyond the first mask (table, wall), and what lies behind them, are not part of the object"),
    Option("keep_to_mask", "bool", True, meaning="the object is excluded where the first frame observes free space outside its mask"),
    Option("mask_margin_px", "int", 3, "px", min=0, max=100, meaning="how far the object may extend beyond the first mask"),
    Option("kept_frames", "int", 600, min=1, meaning="maximum number of frames kept for refine() and save(): the first, and others spread over all viewpoints"),
)
MEMORY = (
    Option("n_harmonics", "int", 10, min=2, max=32, meaning="number of harmonics that describe a silhouette"),
    Option("n_inputs", "int", 3, min=1, max=31, meaning="number of the highest harmonics that predict the others (printed); must be below n_harmonics"),
    Option("rule", "choice", "remembered", choices=("remembered", "printed"), meaning="how occluded parts are recovered: from stored silhouettes, or as printed (Table 6.3)"),
    Option("order", "choice", "max", choices=("max", "sum"), meaning="how coefficients form a harmonic: all C(u, v) with equal max(u, v), or with equal u + v"),
    Option("size", "int", 64, "px", min=16, max=256, meaning="side of the grid to which silhouettes are normalised"),
    Option("capacity", "int", 256, min=2, max=4096, meaning="maximum number of stored silhouettes (remembered)"),
    Option("spacing", "number", 0.02, min=0, max=1, meaning="minimum dissimilarity of two stored silhouettes: symmetric difference over area (remembered)"),
    Option("max_occluders", "int", 2, min=1, max=1000, meaning="a silhouette with more occluders than this is novel (remembered)"),
    Option("calibrate_on", "int", 100, min=1, max=10**9, meaning="number of known silhouettes whose error sets the threshold (remembered)"),
    Option("w_gen", "number", 0.1, min=0, max=1, meaning="a silhouette is unknown if its activation is below this (printed)"),
    Option("reach", "number", 0.1, min=1e-6, max=1e6, meaning="distance metric of the receptive fields, D = reach / n_inputs; smaller values generalise farther (printed)"),
    Option("settle", "int", 20, min=2, max=10**6, meaning="number of silhouettes that determine the scale of the inputs (printed)"),
)
BURN_IN = Option("burn_in", "int", 60, min=0, meaning="number of frames from which a memory learns before it judges")
# fmt: on

TABLES = ("tracker", "reconstruct", "contour", "lwpr", "memory")


def schema_of(table: str) -> dict[str, Option]:
    """The options of one of `TABLES`, by name, in order."""
    own = {"reconstruct": RECONSTRUCT, "memory": MEMORY}.get(table, ())
    core = {} if table == "memory" else core_schema(table)
    return {**core, **{option.name: option for option in own}}
