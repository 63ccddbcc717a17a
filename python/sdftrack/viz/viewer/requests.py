# SPDX-License-Identifier: MIT
"""What the user of the page asked for."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Click:
    """Start object `k` at this pixel of the depth image: ``tracker.recover(frame, k, ...)`` or ``start(clicks=)``."""

    k: int
    x_px: float
    y_px: float


@dataclass(frozen=True)
class Box:
    """Start object `k` in this rectangle of the depth image: left, top, width and height in pixels."""

    k: int
    x: float
    y: float
    w: float
    h: float


@dataclass(frozen=True)
class Pause:
    """Stop taking frames (`on`), or go on."""

    on: bool


@dataclass(frozen=True)
class Record:
    """Start (`on`) or end a recording."""

    on: bool


@dataclass(frozen=True)
class Save:
    """Save what there is now: the reconstruction, or the shown image."""


Request = Click | Box | Pause | Record | Save
