# SPDX-License-Identifier: MIT
"""16-bit units in which a depth image is stored without a change, if there are any."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack.frame import Frame

__all__ = ["DepthUnits"]

LARGEST = 65535


class DepthUnits:
    """Chooses units per metre, so that reading the file returns the bits of the depth image.

    Parameters
    ----------
    default : tuple of int
        Units per metre, in order of preference, for depth that no unit represents exactly, e.g. of a synthetic image.
    exact : tuple of int
        Further units that the layout can state; sensors deliver multiples of one of these.

    Attributes
    ----------
    rounded_m : float
        Step to which some image so far was rounded, m; 0 if all were stored exactly.
    """

    def __init__(self, default: tuple[int, ...], exact: tuple[int, ...] = ()) -> None:
        self._default, self._candidates = default, (*default, *exact)
        self.rounded_m = 0.0

    def exact(self, frame: Frame) -> tuple[NDArray[np.uint16], int] | None:
        """(H, W) uint16 units that return the bits of the frame's depth, and units per metre; None if none does."""
        assert frame.depth is not None
        farthest = float(frame.depth.max())
        for n, units_per_m in enumerate(self._candidates):
            if round(farthest * units_per_m) > LARGEST:
                continue
            units = _units(frame.depth, units_per_m)
            if np.array_equal(units.astype(np.float32) / np.float32(units_per_m), frame.depth):
                # The next image is probably in the same unit.
                self._candidates = (units_per_m, *self._candidates[:n], *self._candidates[n + 1 :])
                return units, units_per_m
        return None

    def of(self, frame: Frame) -> tuple[NDArray[np.uint16], int]:
        """The same, rounded where no unit is exact. ValueError beyond the range."""
        found = self.exact(frame)
        if found is not None:
            return found
        assert frame.depth is not None
        farthest = float(frame.depth.max())
        for units_per_m in self._default:
            if round(farthest * units_per_m) <= LARGEST:
                self.rounded_m = max(self.rounded_m, 1 / units_per_m)
                return _units(frame.depth, units_per_m), units_per_m
        raise ValueError(
            f"depth: frame {frame.index} has {farthest:.2f} m, 16 bits are limited to "
            f"{LARGEST / min(self._default):.2f} m; crop the depth or choose another layout"
        )


def _units(depth_m: NDArray[np.float32], units_per_m: int) -> NDArray[np.uint16]:
    units: NDArray[np.uint16] = np.rint(depth_m.astype(np.float64) * units_per_m).astype(np.uint16)
    return units
