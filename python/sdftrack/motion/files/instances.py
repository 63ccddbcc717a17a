# SPDX-License-Identifier: MIT
"""Several instances of one object in BOP results, which number objects but not instances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise

import numpy as np

from sdftrack.motion.files.record import Array

__all__ = ["check_order"]


def check_order(images: Mapping[int, Sequence[tuple[int, Array]]], what: str) -> int:
    """Number of instances, if their order in the file can be that of one object each.

    Parameters
    ----------
    images : {im_id: [(line, (4, 4) pose)]}
        Rows of one object, by image.
    what : str
        File and object, for errors.

    Raises
    ------
    ValueError
        An image has fewer rows than another: the order does not tell which instance is missing. Or two instances have
        exchanged their places: between two images, both would have moved less together if they were exchanged.
    """
    counts = {len(rows) for rows in images.values()}
    advice = "read the result folder, which names the instances, or one instance per obj_id"
    if len(counts) > 1:
        fewest = min(images, key=lambda im: len(images[im]))
        raise ValueError(
            f"{what}: expected as many rows in every image, but image {fewest} has {len(images[fewest])} and another "
            f"{max(counts)}, and the order does not tell which instance is missing; {advice}"
        )
    count = counts.pop()
    for before, after in pairwise(sorted(images)):
        for a, b in combinations(range(count), 2):
            was, now = (np.array([images[im][k][1][:3, 3] for k in (a, b)]) for im in (before, after))
            straight, crossed = (
                np.linalg.norm(now - was, axis=1).sum(),
                np.linalg.norm(now[::-1] - was, axis=1).sum(),
            )
            if crossed < straight:
                raise ValueError(
                    f"{what}: expected the instances in the same order in every image, but rows {a + 1} and {b + 1} "
                    f"exchange their places between images {before} and {after}; {advice}"
                )
    return count
