# SPDX-License-Identifier: MIT
"""Pictures of shapes in one colour on ground of another, and a memory that says what it is told to say."""

import numpy as np

RED, GROUND = (200, 60, 40), (90, 100, 110)


def disc_mask(cx, cy, radius, size=(160, 120)):
    y, x = np.mgrid[: size[1], : size[0]]
    return np.hypot(x - cx, y - cy) < radius


def painted(mask, noise, seed=0, rgb=RED):
    """What the mask holds in one colour, with noise; uint8 (H, W, 3)."""
    clean = np.where(mask[..., None], rgb, GROUND)
    grain = np.random.default_rng(seed).normal(0, noise, clean.shape)
    return np.clip(clean + grain, 0, 255).astype(np.uint8)


class Told:
    """A memory that counts what it is asked, says what it was told to say and gives its first shape back."""

    def __init__(self, say="unoccluded"):
        self.say, self.learned, self.judged, self.recovered, self.inside = say, [], 0, 0, None

    def learn(self, mask):
        self.learned.append(mask)

    def judge(self, mask):
        self.judged += 1
        if self.inside is not None:
            self.inside()
        return self.say

    def recover(self, mask):
        self.recovered += 1
        return self.learned[0] if self.learned else mask
