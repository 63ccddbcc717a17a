# SPDX-License-Identifier: MIT
"""Left against right."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import numbers

__all__ = ["symmetry_index"]


def symmetry_index(left: ArrayLike, right: ArrayLike) -> NDArray[np.float64]:
    """Difference of a measure between left and right as a part of its mean: (L - R) / (0.5 |L + R|).

    0 where both are alike, above 0 where the left is larger, within -2..2. Robinson, Herzog and Nigg 1987, Journal of
    Manipulative and Physiological Therapeutics 10:172-176, who write it in percent and right minus left. It is for
    measures with a natural zero, as lengths, times and speeds.

    Parameters
    ----------
    left, right : (...,) array
        Values or samples of the same measure.

    Returns
    -------
    (...,) array
        NaN where both are 0 or the signs differ.

    >>> float(symmetry_index(0.75, 0.25))
    1.0
    """
    # `numbers` makes arrays of at least one dimension.
    L = numbers(left, "left").reshape(np.shape(left))
    R = numbers(right, "right").reshape(np.shape(right))
    try:
        total = np.abs(L + R)
    except ValueError:
        raise ValueError(
            f"left, right: expected shapes that go together, got {L.shape} and {R.shape}"
        ) from None
    with np.errstate(divide="ignore", invalid="ignore"):
        index = (L - R) / (0.5 * total)
    return np.where((L * R >= 0) & (total > 0), index, np.nan)
