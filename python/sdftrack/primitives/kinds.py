# SPDX-License-Identifier: MIT
"""The kinds of primitives, as the core describes them (cpp/primitives/solid_*.h)."""

from __future__ import annotations

from dataclasses import dataclass

from sdftrack import _core


@dataclass(frozen=True)
class Kind:
    """One kind."""

    name: str
    sizes: tuple[str, ...]  # names of its lengths, m; in the order of the covariance's columns
    size_axes: tuple[
        int, ...
    ]  # of each length, the axis along which the centre is uncertain if the length is
    extent: tuple[
        tuple[int, float], ...
    ]  # along x, y, z: index of the length (-1: none), its share on either side
    unknowns: int  # that a view can determine: a ball has no orientation, a round body no turn about its axis
    has_inside: bool  # and so a distance volume

    @property
    def member(self) -> _core.PrimitiveKind:
        """The member in the core."""
        return _core.PrimitiveKind.__members__[self.name]

    def half_extent(self, lengths: list[float]) -> list[float]:
        """Distance from the centre to the farthest point along x, y and z, m."""
        return [lengths[i] * half if i >= 0 else 0.0 for i, half in self.extent]


TABLE = {kind["name"]: Kind(**kind) for kind in _core.primitive_kinds()}
KINDS = tuple(TABLE)
SOLIDS = tuple(name for name, kind in TABLE.items() if kind.has_inside)
SIZES = {name: kind.sizes for name, kind in TABLE.items()}
FREE = {name: kind.unknowns for name, kind in TABLE.items()}
