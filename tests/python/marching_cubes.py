# SPDX-License-Identifier: MIT
"""Marching cubes, cell by cell and slowly: what the core computes, without blocks, tables and numbers."""

import numpy as np

# A face's corners counter-clockwise seen from outside, of a cell whose corners are at 0 and 1.
FACES = []
for axis in range(3):
    b, c = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
    FACES.append([0 * b, c, b + c, b])
    FACES.append([np.eye(3, dtype=int)[axis] + k for k in (0 * b, b, b + c, c)])


def key(voxel, other):
    """An edge of the lattice: its axis and the voxel that it begins at."""
    voxel, other = np.minimum(voxel, other), np.maximum(voxel, other)
    return int(np.argmax(other - voxel)), *(int(v) for v in voxel)


def lines_of(cell, inside):
    """Of the surface in the faces of a cell: from where each run of inside corners begins to where it ends."""
    lines = {}
    for ring in FACES:
        corners = [cell + k for k in ring]
        state = [inside[tuple(k)] for k in corners]
        for i in range(4):
            if not state[i] and state[(i + 1) % 4]:
                last = i + 1
                while state[(last + 1) % 4]:
                    last += 1
                end = key(corners[last % 4], corners[(last + 1) % 4])
                lines[key(corners[i], corners[(i + 1) % 4])] = end
    return lines


def in_one_face(cell, a, b):
    """Whether two edges of a cell lie in one of its faces."""
    planes = [{(k, e[1 + k] - cell[k]) for k in range(3) if k != e[0]} for e in (a, b)]
    return bool(planes[0] & planes[1])


def triangles_of(cell, lines):
    """Each loop of lines from its first edge (by axis, then by z, y, x) from which no side lies in a face."""
    left = dict(lines)
    while left:
        loop = [min(left, key=lambda e: (e[0], e[3], e[2], e[1]))]
        while (after := left.pop(loop[-1])) != loop[0]:
            loop.append(after)
        for k in range(len(loop)):
            turned = loop[k:] + loop[:k]
            if not any(in_one_face(cell, turned[0], e) for e in turned[2:-1]):
                break
        yield from ((turned[0], turned[k], turned[k + 1]) for k in range(1, len(loop) - 1))


def marching_cubes(phi):
    """A dict from edges of the lattice to the vertices there (x, y, z, voxels), and a set of triangles of edges."""
    values = phi.T.astype(np.float64)  # by x, y, z
    inside = ~(values > 0)
    vertices, faces = {}, set()
    for cell in np.ndindex(*(n - 1 for n in inside.shape)):
        lines = lines_of(np.array(cell), inside)
        faces.update(turned(t) for t in triangles_of(cell, lines))
    for first in np.ndindex(*inside.shape):
        for axis in range(3):
            second = tuple(np.array(first) + np.eye(3, dtype=int)[axis])
            if second[axis] < inside.shape[axis] and inside[first] != inside[second]:
                cut = values[first] / (values[first] - values[second])
                vertices[axis, *first] = np.array(first) + cut * np.eye(3)[axis]
    return vertices, faces


def turned(triangle):
    """The same triangle from its least corner on."""
    k = triangle.index(min(triangle))
    return (*triangle[k:], *triangle[:k])
