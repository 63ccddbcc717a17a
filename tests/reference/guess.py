# SPDX-License-Identifier: MIT
"""How far back a body reaches that is seen from the front: docs/math/reconstruction.md, section 5, cell by cell."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
CELLS, FAR, MIXED_PX, BESIDE_PX, MOST_SLOPE, STEP, LEAST_HALF, IN_FRONT_M = 128, 1, 2, 5, 2, 8, 0.6, 0.01
SIDES = ((-1, 0), (1, 0), (0, -1), (0, 1))


def guessed_back(depth_m: Array, mask: Array, camera: Any) -> Array:
    """Depth (m) of the far side at each pixel, (H, W); 0 where there is none."""
    rows, columns = np.nonzero(mask)
    z = np.median(depth_m[mask & (depth_m > 0)])
    x, y = np.meshgrid(
        (np.arange(mask.shape[1]) - camera.cx) / camera.fx, (np.arange(len(mask)) - camera.cy) / camera.fy
    )
    rays = np.sqrt(1 + x * x + y * y)
    x0, y0 = columns.min(), rows.min()
    wide, high = columns.max() + 1 - x0, rows.max() + 1 - y0
    step = max(1, -(-max(wide, high) // CELLS))
    nx, ny = -(-wide // step) + 2, -(-high // step) + 2
    dx, dy = step / camera.fx * z, step / camera.fy * z
    far_m = FAR * z * max(wide / camera.fx, high / camera.fy)
    inside, front, beside = np.zeros((ny, nx), bool), np.zeros((ny, nx)), np.zeros((ny, nx))
    h, w = mask.shape
    for cy in range(ny):
        for cx in range(nx):
            y, x = y0 + (cy - 1) * step, x0 + (cx - 1) * step
            here = np.s_[max(0, y) : max(0, min(h, y + step)), max(0, x) : max(0, min(w, x + step))]
            d, r = depth_m[here], (rays * depth_m)[here]
            m = mask[here] & (d - z < far_m)  # a mask may be too large, or have holes
            border = cx in (0, nx - 1) or cy in (0, ny - 1)
            inside[cy, cx] = not border and m.size > 0 and 2 * m.sum() >= m.size
            own, other = r[m & (d > 0) & (z - d < far_m)], r[~m & (d > 0)]
            front[cy, cx] = own.mean() if own.size else 0
            beside[cy, cx] = np.inf if not m.size else other.mean() if other.size else 0
    inside |= enclosed(inside) & (beside == 0)
    cells = [(y, x) for y in range(ny) for x in range(nx) if inside[y, x]]
    front = harmonic(front, inside & (front > 0), cells, inside)
    away = distances(cells, outline_of(front, inside, beside), dx, dy, (ny, nx))
    widest = away.max()

    smooth = np.zeros_like(front)
    for y, x in cells:
        around = np.s_[y - 1 : y + 2, x - 1 : x + 2]
        smooth[y, x] = front[around][inside[around]].mean()
    pixel_m = min(dx, dy) / step
    least, most = 0.99 * min(MIXED_PX * pixel_m, 0.5 * widest), max(BESIDE_PX * pixel_m, 1.01 * max(dx, dy))
    known, rim = np.zeros_like(inside), np.zeros_like(front)
    for y, x in cells:
        if not least <= away[y, x] < most:
            continue
        a = slope(away, inside, y, x, dx, dy)
        if not a.any():
            continue
        s = -slope(smooth, inside, y, x, dx, dy) @ a / np.linalg.norm(a)
        if s > STEP:
            continue
        s = np.clip(s, 0, MOST_SLOPE)
        known[y, x] = True
        rim[y, x] = smooth[y, x] + min(away[y, x] * (s + np.sqrt(s * s + 1)), widest)
    rim = harmonic(rim, known, cells, inside)
    off = 1 - np.minimum(away / widest, 1)
    mirrored = rim * rim / np.where(smooth > 0, smooth, 1)
    far = np.maximum(np.maximum(smooth, mirrored), rim + LEAST_HALF * widest * np.sqrt(1 - off * off))
    return spread(far, inside, mask, x0 - step, y0 - step, step) / rays


def enclosed(inside: Array) -> Array:
    """Cells from which no path along the sides leads to the border without crossing the inside."""
    outside = np.zeros_like(inside)
    outside[0, 0] = True
    while True:
        more = outside.copy()
        for v, u in SIDES:
            more |= np.roll(outside, (v, u), (0, 1))  # nothing is inside at the border
        more &= ~inside
        if (more == outside).all():
            return ~inside & ~outside
        outside = more


def outline_of(front: Array, inside: Array, beside: Array) -> list[tuple[int, int]]:
    """Cells beside the inside, but for those outside the image and those that show something nearer."""
    out = []
    for y, x in np.argwhere(~inside & np.isfinite(beside)):
        near = [
            front[y + v, x + u]
            for v, u in SIDES
            if 0 <= y + v < len(inside) and 0 <= x + u < inside.shape[1] and inside[y + v, x + u]
        ]
        if near and not (beside[y, x] > 0 and beside[y, x] < max(near) - IN_FRONT_M):
            out.append((y, x))
    return out


def distances(cells: Any, outline: Any, dx: float, dy: float, shape: tuple[int, int]) -> Array:
    out = np.zeros(shape)
    for y, x in cells:
        out[y, x] = min(np.hypot((y - v) * dy, (x - u) * dx) for v, u in outline) - 0.5 * min(dx, dy)
    return out


def harmonic(values: Array, known: Array, cells: Any, inside: Array) -> Array:
    """The solution of the linear system in which each unknown cell is the mean of its neighbours."""
    values = values.copy()
    number = {cell: i for i, cell in enumerate(c for c in cells if not known[c])}
    A, b = np.eye(len(number)), np.zeros(len(number))
    for (y, x), i in number.items():
        near = [(y + v, x + u) for v, u in SIDES if inside[y + v, x + u]]
        for cell in near:
            if cell in number:
                A[i, number[cell]] -= 1 / len(near)
            else:
                b[i] += values[cell] / len(near)
    for (y, x), value in zip(number, np.linalg.solve(A, b), strict=True):
        values[y, x] = value
    return values


def slope(values: Array, inside: Array, y: int, x: int, dx: float, dy: float) -> Array:
    """(d/dx, d/dy) from the neighbours that are inside."""
    out = []
    for v, u, d in ((0, 1, dx), (1, 0, dy)):
        a = (y - v, x - u) if inside[y - v, x - u] else (y, x)
        b = (y + v, x + u) if inside[y + v, x + u] else (y, x)
        steps = (a != (y, x)) + (b != (y, x))
        out.append((values[b] - values[a]) / (d * steps) if steps else 0.0)
    return np.array(out)


def spread(values: Array, inside: Array, mask: Array, x0: int, y0: int, step: int) -> Array:
    """Values of cells at the pixels of a mask: linear between those that are inside, else the nearest one's."""
    out = np.zeros(mask.shape)
    for y, x in np.argwhere(mask):
        u, v = (x - x0 + 0.5) / step - 0.5, (y - y0 + 0.5) / step - 0.5
        cx = np.clip(int(np.floor(u)), 0, inside.shape[1] - 2)
        cy = np.clip(int(np.floor(v)), 0, inside.shape[0] - 2)
        total = weights = 0.0
        for b in range(2):
            for a in range(2):
                weight = (1 - abs(u - cx - a)) * (1 - abs(v - cy - b))
                if inside[cy + b, cx + a] and weight > 0:
                    total, weights = total + weight * values[cy + b, cx + a], weights + weight
        if weights:
            out[y, x] = total / weights
            continue
        near = [tuple(c) for c in np.argwhere(inside) if cy - 2 <= c[0] < cy + 4 and cx - 2 <= c[1] < cx + 4]
        if near:
            out[y, x] = values[min(near, key=lambda c: (v - c[0]) ** 2 + (u - c[1]) ** 2)]
    return out
