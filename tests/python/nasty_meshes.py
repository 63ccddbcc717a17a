# SPDX-License-Identifier: MIT
"""Meshes as they come: cut by themselves, double-sided, turned, open, broken; each {name: (vertices, faces)}."""

import numpy as np
import tracking_scene

import sdftrack as st

TURNS = ((0.3, 0.2, -0.4), (1.0, -0.5, 0.2), (-0.7, 0.9, 1.3))


def ball(radius=0.05, centre=(0, 0, 0), voxels=24):
    mesh = st.SDF.sphere(radius, voxels=voxels).to_mesh()
    return mesh.vertices + np.asarray(centre, float), mesh.faces.astype(np.int32)


def box(size=(0.1, 0.08, 0.06), centre=(0, 0, 0), w=(0.1, 0.2, 0.3)):
    mesh = tracking_scene.box_mesh(np.array(size))
    return st.geometry.transform_points(st.geometry.pose(w, centre), mesh.vertices), mesh.faces.copy()


def turned(mesh):
    return mesh[0], np.ascontiguousarray(mesh[1][:, ::-1])


def joined(*meshes):
    start = np.cumsum([0, *(len(v) for v, _ in meshes)])
    return np.concatenate([v for v, _ in meshes]), np.concatenate(
        [f + n for (_, f), n in zip(meshes, start, strict=False)]
    ).astype(np.int32)


def double_sided(mesh):
    return mesh[0], np.concatenate([mesh[1], mesh[1][:, ::-1]])


def self_cutting(seed, lobes=2):
    """A ball whose surface is pushed through itself."""
    v, f = ball(voxels=26)
    rng = np.random.default_rng(seed)
    for _ in range(lobes):
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        v = v - np.maximum(v @ n - 0.02, 0)[:, None] * n * rng.uniform(1.2, 2.2)
    return v, f


def torus(twist=0.3, big=0.04, small=0.02, n=36, m=18):
    """A tube that winds twice round the axis and runs through itself."""
    s, t = (2 * np.pi * np.arange(k) / k for k in (n, m))
    s = 2 * s  # twice round
    r = big + twist * big * np.cos(s / 2)
    c = np.stack([r * np.cos(s), r * np.sin(s), 0.2 * small * np.sin(s / 2)], 1)
    e = np.stack([np.cos(s), np.sin(s), 0 * s], 1)
    v = c[:, None] + small * (np.cos(t)[None, :, None] * e[:, None] + np.sin(t)[None, :, None] * [0, 0, 1])
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = i * m + j, (i + 1) % n * m + j
    c2, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    f = np.concatenate([np.stack([a, b, c2], -1).reshape(-1, 3), np.stack([a, c2, d], -1).reshape(-1, 3)])
    return v.reshape(-1, 3), f.astype(np.int32)


def without(mesh, keep):
    v, f = mesh
    return v, f[keep(v[f].mean(axis=1))]


def with_unused_nan(mesh):
    v = np.concatenate([[[np.nan] * 3], mesh[0], [[np.inf, 0, 0]]])
    return v, mesh[1] + 1


def with_noise_faces(mesh, seed):
    """Degenerate, repeated and randomly turned faces."""
    v, f = mesh
    rng = np.random.default_rng(seed)
    f = f.copy()
    some = rng.choice(len(f), len(f) // 5, replace=False)
    f[some] = f[some][:, ::-1]
    return v, np.concatenate([f, f[:7], np.repeat(f[:5, :1], 3, axis=1), f[3:6][:, [0, 0, 1]]])


def cracked(mesh, seed, by=1e-7):
    """Every face has its own corners, which do not quite meet."""
    v, f = mesh
    rng = np.random.default_rng(seed)
    return v[f].reshape(-1, 3) + rng.normal(size=(3 * len(f), 3)) * by, np.arange(
        3 * len(f), dtype=np.int32
    ).reshape(-1, 3)


def nasty_meshes():
    """{name: (mesh, holes, what the winding number is asked of)}; the last is the mesh that was meant."""
    out = {}
    for k, w in enumerate(TURNS):
        b, far, s = box(w=w), box(centre=(0.16, 0, 0), w=w), ball()
        over = box(centre=(0.05, 0.02, 0.01), w=w)
        n = np.asarray(w) / np.linalg.norm(w)
        cup = without(s, lambda c, n=n: c @ n < 0.03)
        other = without(ball(0.04, (0.15, 0, 0)), lambda c: c[:, 2] < 0.02)
        hollow = joined(b, turned(box((0.05, 0.04, 0.03), w=w)))
        out |= {
            f"union {k}": (joined(b, over), "error", joined(b, over)),
            f"box and ball {k}": (joined(b, s), "error", joined(b, s)),
            f"hollow {k}": (hollow, "error", hollow),
            f"hollow turned {k}": (turned(hollow), "error", hollow),
            f"turned {k}": (turned(b), "error", b),
            f"one of two turned {k}": (joined(b, turned(far)), "error", joined(b, far)),
            f"overlapping turned {k}": (joined(s, turned(box(centre=(0.07, 0, 0), w=w))), "error",
                                        joined(s, box(centre=(0.07, 0, 0), w=w))),
            f"double-sided {k}": (double_sided(b), "error", b),
            f"double-sided ball {k}": (double_sided(joined(s, far)), "error", joined(s, far)),
            f"one of two double-sided {k}": (joined(double_sided(b), far), "error", joined(b, far)),
            f"unused nan {k}": (with_unused_nan(joined(b, far)), "error", joined(b, far)),
            f"noise faces {k}": (with_noise_faces(s, k), "error", s),
            f"cracked {k}": (cracked(b, k), "error", b),
            f"cut by itself {k}": (self_cutting(k), "error", self_cutting(k)),
            f"cut thrice {k}": (self_cutting(10 + k, 3), "error", self_cutting(10 + k, 3)),
            f"cup {k}": (cup, "close", None),
            f"two holes {k}": (without(s, lambda c, n=n: abs(c @ n) < 0.035), "close", None),
            f"cup turned {k}": (turned(cup), "close", cup),
            f"cups {k}": (joined(without(b, lambda c: np.arange(len(c)) > 0), other), "close", None),
        }  # fmt: skip
    out["torus"] = (torus(), "error", torus())
    out["plate"] = (box((0.1, 0.1, 0.005)), "error", box((0.1, 0.1, 0.005)))
    return {
        name: (mesh, holes, mesh if meant is None else meant) for name, (mesh, holes, meant) in out.items()
    }
