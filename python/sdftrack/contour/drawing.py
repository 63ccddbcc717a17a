# SPDX-License-Identifier: MIT
"""Drawing of an outline into an image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

COLORS = {"ok": (60, 220, 90), "weak": (250, 180, 40), "lost": (230, 60, 60)}


def draw_outline(image: NDArray[np.uint8], mask: NDArray[np.bool_], status: str = "ok") -> NDArray[np.uint8]:
    """Return the image with the surroundings of the object darkened and the outline in the colour of the status.

    Parameters
    ----------
    image : (H, W, 3) uint8
        RGB.
    mask : (H, W) bool
    status : "ok", "weak" or "lost"

    Returns
    -------
    (H, W, 3) uint8

    >>> picture = draw_outline(np.zeros((8, 8, 3), np.uint8), np.eye(8, dtype=bool))
    """
    import cv2

    image, mask = np.asarray(image), np.asarray(mask)
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or not image.size:
        raise TypeError(f"image: expected (H, W, 3) uint8, got {image.dtype} {image.shape}")
    if mask.dtype != np.bool_ or mask.shape != image.shape[:2]:
        raise TypeError(f"mask: expected bool {image.shape[:2]} as the image, got {mask.dtype} {mask.shape}")
    picture = np.ascontiguousarray(np.where(mask[..., None], image, (0.55 * image).astype(np.uint8)))
    color = COLORS.get(status, COLORS["lost"])
    if mask.any():
        outlines, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(picture, outlines, -1, color, 1)
    else:
        cv2.rectangle(picture, (0, 0), (picture.shape[1] - 1, picture.shape[0] - 1), color, 2)
    return np.asarray(picture, np.uint8)
