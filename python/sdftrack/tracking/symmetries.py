# SPDX-License-Identifier: MIT
"""The symmetries of a tracker's shapes, declared to the core."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sdftrack._internal.validation import of_kind
from sdftrack.symmetry import Symmetry

ADVICE = "make one with st.find_symmetries(sdf)"


def symmetry_list(symmetry: Any, count: int) -> list[Symmetry | None]:
    """One or None per shape."""
    given = [symmetry] * count if symmetry is None or isinstance(symmetry, Symmetry) else list(symmetry)
    if len(given) != count:
        raise ValueError(f"symmetry: expected one or None per shape ({count}), got {len(given)}")
    for k, one in enumerate(given):
        if one is not None:
            of_kind(one, Symmetry, f"symmetry[{k}]", ADVICE)
    return given


def declare(core: Any, symmetries: Sequence[Symmetry | None], shapes: Sequence[Any], mode: str) -> None:
    """Declare to the core which poses are equivalent: of a coloured shape none are, where colours are used."""
    for k, (symmetry, shape) in enumerate(zip(symmetries, shapes, strict=True)):
        if symmetry and (mode == "depth" or shape.colors is None):
            core.set_symmetry(k, *symmetry._core_args)
