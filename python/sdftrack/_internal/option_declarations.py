# SPDX-License-Identifier: MIT
"""The options that never reach the core, one line each, described as those of the core are."""

from __future__ import annotations

from sdftrack._internal.option_schema import Option, core_schema

__all__ = ["BURN_IN", "TABLES", "schema_of"]

# fmt: off
# ruff: noqa: E501 (an option is a line)
RECONSTRUCT = (
    Option("prior", "number", 0.4, min=0, meaning="log ratio of the first guess, inside +, outside -; 0: no prior"),
    Option("least_seen", "number", 0.15, min=0, meaning="views after which a piece of surface may guide the tracker"),
    Option("padding_m", "number", 0.02, "m", min=0, min_open=True, meaning="how far beyond the shape so far its next frame is looked at"),
    Option("planes", "bool", True, meaning="planes that reach beyond the first mask (a table, a wall) are not the object, nor is what lies behind them"),
    Option("keep_to_mask", "bool", True, meaning="the object is nowhere where the first frame sees past it, beside its mask"),
    Option("mask_margin_px", "int", 3, "px", min=0, max=100, meaning="how far beyond the first mask it may reach"),
    Option("refit_after", "int", 0, min=0, meaning="frames after which the first poses and the shape are found anew on another thread, then once more; 0: never"),
    Option("kept_frames", "int", 600, min=1, meaning="most frames kept for refine() and save(): the first one, and others spread over all sides"),
)
MEMORY = (
    Option("n_harmonics", "int", 10, min=2, max=32, meaning="harmonics of a silhouette that are used"),
    Option("n_inputs", "int", 3, min=1, max=31, meaning="how many of them, the highest, predict the others (printed); below n_harmonics"),
    Option("rule", "choice", "remembered", choices=("remembered", "printed"), meaning="how hidden parts are found: by the silhouettes themselves, or as printed (Table 6.3)"),
    Option("order", "choice", "max", choices=("max", "sum"), meaning="what a harmonic is: all C(u, v) of one max(u, v), or of one u + v"),
    Option("size", "int", 64, "px", min=16, max=256, meaning="side of the memory's grid"),
    Option("capacity", "int", 256, min=2, max=4096, meaning="silhouettes kept at most (remembered)"),
    Option("spacing", "number", 0.02, min=0, max=1, meaning="how unlike two of them must be: symmetric difference over area (remembered)"),
    Option("max_occluders", "int", 2, min=1, max=1000, meaning="more things than this before the object: novel (remembered)"),
    Option("calibrate_on", "int", 100, min=1, max=10**9, meaning="known silhouettes whose error sets the threshold (remembered)"),
    Option("w_gen", "number", 0.1, min=0, max=1, meaning="activation below which nothing is known (printed)"),
    Option("reach", "number", 0.1, min=1e-6, max=1e6, meaning="how far a silhouette is known around it (printed)"),
    Option("settle", "int", 20, min=2, max=10**6, meaning="silhouettes that set the scale of the inputs (printed)"),
)
BURN_IN = Option("burn_in", "int", 60, min=0, meaning="frames that a memory learns from before it judges")
# fmt: on

TABLES = ("tracker", "reconstruct", "contour", "lwpr", "memory")


def schema_of(table: str) -> dict[str, Option]:
    """The options of one of `TABLES`, by name, in order."""
    own = {"reconstruct": RECONSTRUCT, "memory": MEMORY}.get(table, ())
    core = {} if table == "memory" else core_schema(table)
    return {**core, **{option.name: option for option in own}}
