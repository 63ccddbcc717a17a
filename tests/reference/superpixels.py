# SPDX-License-Identifier: MIT
"""Superpixels in plain numpy, slow and obvious: the core's labels, bit for bit (docs/math/superpixels.md)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

F = np.float32
Array = NDArray[Any]
FINEST, MAX_REACH = 32.0, 1500.0


@dataclass
class Grid:
    """Cells of nearly equal size and the units: colours times `scale`, places times `unit` per pixel."""

    nx: int
    ny: int
    scale: float
    unit: float
    x_begin: Array
    y_begin: Array


def make_grid(height: int, width: int, inside: int, n_segments: int, compactness: float) -> Grid:
    wanted = min(height * width, n_segments * (height * width) / inside)
    step = np.sqrt(height * width / wanted)
    if height <= width:
        ny = int(np.clip(_round(height / step), 1, height))
        nx = int(np.clip(_round(wanted / ny), 1, width))
    else:
        nx = int(np.clip(_round(width / step), 1, width))
        ny = int(np.clip(_round(wanted / nx), 1, height))
    scale: float = FINEST
    while compactness * scale > MAX_REACH:
        scale /= 2
    unit = compactness * scale / max(width / nx, height / ny)
    return Grid(nx, ny, scale, unit, width * np.arange(nx + 1) // nx, height * np.arange(ny + 1) // ny)


def features(image: Array, space: str, scale: float) -> Array:
    """(H, W, 3) whole numbers: L*a*b*, or XYZ or RGB in percent, times scale. All in float32, as in the core."""
    values = image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)
    values = values.astype(F) / F(255) if image.dtype == np.uint8 else values.astype(F)
    k = F(scale)
    if space == "rgb":
        return _nearest(values * (F(100) * k))
    r, g, b = np.moveaxis(_linear_light(values), -1, 0)
    x = (F(0.412453) * r + F(0.357580) * g) + F(0.180423) * b
    y = (F(0.212671) * r + F(0.715160) * g) + F(0.072169) * b
    z = (F(0.019334) * r + F(0.119193) * g) + F(0.950227) * b
    if space == "xyz":
        return _nearest(np.stack([x, y, z], axis=-1) * (F(100) * k))
    fx, fy, fz = _bend(x * (F(1) / F(0.95047))), _bend(y), _bend(z * (F(1) / F(1.08883)))
    lab = [(F(116) * fy - F(16)) * k, F(500) * (fx - fy) * k, F(200) * (fy - fz) * k]
    return _nearest(np.stack(lab, axis=-1))


def depth_feature(depth_m: Array, scale: float) -> Array:
    """Whole numbers; where nothing is read the last measurement to the left, or else the first of the row."""
    out = np.zeros(depth_m.shape, np.int64)
    for row, readings in zip(out, depth_m.astype(float), strict=True):
        seen = np.flatnonzero(readings > 0)
        if len(seen):
            last = seen[np.maximum(np.searchsorted(seen, np.arange(len(row)), side="right") - 1, 0)]
            row[:] = np.floor(readings[last] * scale + 0.5)
    return out


def first_centers(color: Array, depth: Array, grid: Grid, mask: Array) -> tuple[Array, Array]:
    """(cells, 6) c0 c1 c2 x y z of the cells' middles, moved to the least change nearby; (cells,) which are used."""
    height, width = mask.shape
    centers, used = np.zeros((grid.ny * grid.nx, 6), np.int64), np.zeros(grid.ny * grid.nx, bool)
    for cell in range(grid.ny * grid.nx):
        j, i = divmod(cell, grid.nx)
        (x0, x1), (y0, y1) = grid.x_begin[i : i + 2], grid.y_begin[j : j + 2]
        inside = [(y, x) for y in range(y0, y1) for x in range(x0, x1) if mask[y, x]]
        if not inside:
            continue
        my, mx = (y0 + y1 - 1) // 2, (x0 + x1 - 1) // 2
        y, x = min(inside, key=lambda p: (p[0] - my) ** 2 + (p[1] - mx) ** 2)
        if min(x1 - x0, y1 - y0) >= 3 and 1 < x < width - 2 and 1 < y < height - 2:
            around = [(v, u) for v in (y - 1, y, y + 1) for u in (x - 1, x, x + 1) if mask[v, u]]
            y, x = min([(y, x), *around], key=lambda p: _change(color, *p))
        centers[cell] = [*color[y, x], _place(x, grid.unit), _place(y, grid.unit), depth[y, x]]
        used[cell] = True
    return centers, used


def assign(planes: Array, cell_of: Array, centers: Array, used: Array, grid: Grid, distance: str) -> Array:
    """The nearest of the 9 centres around each pixel's cell, the first of equals. planes: (H, W, 6) as centers."""
    best = np.full(cell_of.shape, np.inf)
    nearest = np.full(cell_of.shape, -1)
    j, i = np.divmod(cell_of, grid.nx)
    for k in range(9):
        v, u = j + k // 3 - 1, i + k % 3 - 1
        there = (v >= 0) & (v < grid.ny) & (u >= 0) & (u < grid.nx)
        center = np.where(there, v * grid.nx + u, 0)
        d = planes - centers[center]
        color, place = (d[..., [0, 1, 2, 5]] ** 2).sum(-1), (d[..., 3:5] ** 2).sum(-1)
        cost = color + place if distance == "slic" else np.sqrt(color.astype(F)) + np.sqrt(place.astype(F))
        nearer = there & used[center] & (cost < best)
        best[nearer], nearest[nearer] = cost[nearer], center[nearer]
    return nearest


def connect(centers: Array, min_size: float) -> Array:
    """(H, W) numbers 0, 1, ... of connected regions in the order of the image, -1 where centers is -1."""
    region = _components(centers)
    while True:
        size: Any = np.bincount(region[region >= 0])
        small = np.flatnonzero((size < int(min_size)) & (size > 0))
        touching: dict[int, set[int]] = {}
        for a, b in _touching(region):
            touching.setdefault(a, set()).add(b)
            touching.setdefault(b, set()).add(a)
        choice = {a: min(touching[a], key=lambda b: (-size[b], b)) for a in small.tolist() if a in touching}
        if not choice:
            return region
        joined = np.arange(len(size))
        for a, b in choice.items():
            joined[joined == joined[a]] = joined[b]
        region = _components(np.where(region >= 0, joined[region], -1))


def slic(
    image: Array,
    n_segments: int = 100,
    compactness: float = 10.0,
    max_num_iter: int = 5,
    *,
    color_space: str = "lab",
    mask: Array | None = None,
    enforce_connectivity: bool = True,
    distance: str = "slic",
    min_size_factor: float = 0.25,
    depth: Array | None = None,
    depth_weight: float = 20.0,
) -> Array:
    """(H, W) labels from 1, 0 outside the mask, as of `sdftrack.superpixels.slic`."""
    inside = np.ones(image.shape[:2], bool) if mask is None else mask.astype(bool)
    rows, columns = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
    part = (
        slice(rows[0], rows[-1] + 1),
        slice(columns[0], columns[-1] + 1),
    )  # the grid is that of the masked part
    out = np.zeros(inside.shape, np.int64)
    image, inside, depth = image[part], inside[part], None if depth is None else depth[part]
    height, width = inside.shape
    grid = make_grid(height, width, int(inside.sum()), n_segments, compactness)
    color = features(image, color_space, grid.scale)
    z = np.zeros(inside.shape, np.int64) if depth is None else depth_feature(depth, depth_weight * grid.scale)
    y, x = np.mgrid[:height, :width]
    places = [np.broadcast_to(_place(v, grid.unit), inside.shape) for v in (x, y)]
    planes = np.concatenate([color, np.stack([*places, z], axis=-1)], axis=-1)
    cells = [np.searchsorted(b, v, side="right") - 1 for b, v in ((grid.y_begin, y), (grid.x_begin, x))]
    centers, used = first_centers(color, z, grid, inside)
    for _ in range(max_num_iter):
        nearest = np.where(
            inside, assign(planes, cells[0] * grid.nx + cells[1], centers, used, grid, distance), -1
        )
        moved = _means(planes, np.stack([x, y], axis=-1), nearest, centers, grid.unit)
        if (moved == centers).all():
            break
        centers = moved
    if enforce_connectivity:
        out[part] = connect(nearest, min_size_factor * (inside.sum() / n_segments)) + 1
    else:
        out[part] = np.where(inside, np.searchsorted(np.unique(nearest[inside]), nearest) + 1, 0)
    return out


def _means(planes: Array, pixel: Array, nearest: Array, centers: Array, unit: float) -> Array:
    out = centers.copy()
    for c in np.unique(nearest[nearest >= 0]):
        mine = nearest == c
        n = int(mine.sum())
        out[c, [0, 1, 2, 5]] = (2 * planes[mine][:, [0, 1, 2, 5]].sum(0) + n) // (2 * n)
        out[c, 3:5] = _place(pixel[mine].sum(0) / float(n), unit)
    return out


def _components(values: Array) -> Array:
    """Numbers of the 4-connected regions of equal value, in the order of the image; -1 stays."""
    out = np.full(values.shape, -1)
    next_number = 0
    for start in np.ndindex(values.shape):
        if values[start] < 0 or out[start] >= 0:
            continue
        out[start] = next_number
        stack = [start]
        while stack:
            y, x = stack.pop()
            for v, u in ((y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)):
                there = 0 <= v < values.shape[0] and 0 <= u < values.shape[1]
                if there and out[v, u] < 0 and values[v, u] == values[start]:
                    out[v, u] = next_number
                    stack.append((v, u))
        next_number += 1
    return out


def _touching(region: Array) -> list[tuple[int, int]]:
    found = set()
    for a, b in ((region[:, :-1], region[:, 1:]), (region[:-1], region[1:])):
        edge = (a != b) & (a >= 0) & (b >= 0)
        found |= set(zip(a[edge].tolist(), b[edge].tolist(), strict=True))
    return sorted(found)


def _change(color: Array, y: int, x: int) -> int:
    along_x, along_y = color[y, x + 1] - color[y, x - 1], color[y + 1, x] - color[y - 1, x]
    return int((along_x**2).sum() + (along_y**2).sum())


def _place(px: Any, unit: float) -> Any:
    return np.floor(px * unit + 0.5).astype(np.int64)


def _round(x: float) -> float:
    return np.floor(x + 0.5)


def _nearest(x: Array) -> Array:
    return (x + F(32768.5)).astype(np.int64) - 32768


def _linear_light(v: Array) -> Array:
    with np.errstate(all="ignore"):
        x = (v + F(0.055)) * (F(1) / F(1.055))
        r: Array = (F(1.2779306e9) - x.view(np.int32).astype(F) * F(0.2)).astype(np.int32).view(F)
        for _ in range(3):
            r2 = r * r
            r = r * (F(1.2) - x * F(0.2) * (r2 * r2 * r))
        q = x * r
        light: Array = np.where(v <= F(0.04045), v * (F(1) / F(12.92)), q * q * q)
    return light


def _bend(t: Array) -> Array:
    with np.errstate(all="ignore"):
        r = (F(1.4199173e9) - t.view(np.int32).astype(F) * F(1 / 3)).astype(np.int32).view(F)
        for _ in range(2):
            e = F(1) - t * (r * r * r)
            r = r + r * (e * (F(1 / 3) + e * F(2 / 9)))
        return np.where(t > F(0.008856452), t * (r * r), F(7.7870370) * t + F(16 / 116))
