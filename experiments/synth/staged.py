# SPDX-License-Identifier: MIT
"""A sequence of several copies of one shape as it is tracked and judged: frames, truth, what is to be seen."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.synth.contact import Solid, min_gap
from sdftrack._internal.files import write_whole

Array = NDArray[np.float64]
# Changing these numbers breaks comparisons with every figure that was printed with them.
COLOR, GRAIN = (70, 90, 200), 5.0  # of every object; grey levels of noise
RENDERED_GRAIN = 2.0  # what the renderer adds by itself


@dataclass(frozen=True)
class Scene:
    """A rendered sequence of M copies with its truth.

    Attributes
    ----------
    poses : (n, M, 4, 4) float64, T_cam_obj
    share : (n, M) float64
        Of the object's own silhouette in the image, how much is to be seen.
    gaps : (n,) float64
        Least true gap of any pair, m.
    """

    name: str
    solid: Solid
    poses: Array
    share: Array
    gaps: Array
    seq: Any
    seed: int

    @property
    def camera(self) -> Any:
        return self.seq.camera

    def __len__(self) -> int:
        return len(self.poses)

    def __getitem__(self, i: int) -> Any:
        """Frame i, with `GRAIN` levels of noise on its colours."""
        import sdftrack as st

        frame = self.seq[i]
        if frame.color is None:
            return frame
        more = np.sqrt(GRAIN**2 - RENDERED_GRAIN**2)
        grain = np.random.default_rng([self.seed, 11, i]).standard_normal(frame.color.shape, np.float32)
        color = np.clip(frame.color + more * grain + 0.5, 0, 255).astype(np.uint8)
        return st.Frame(frame.depth, color, frame.timestamp, index=i, check_units=False)

    def labels(self, i: int) -> NDArray[np.int16]:
        """(H, W): whose each pixel is, -1 for no object's."""
        masks = self.seq.masks(i)
        out = np.full(next(iter(masks.values())).shape, -1, np.int16)
        for k, mask in masks.items():
            out[mask] = k
        return out

    @property
    def contacts(self) -> int:
        """How often two objects come to within 1 mm."""
        return _runs(self.gaps <= 0.001)

    @property
    def crossings(self) -> int:
        """How often an object gets hidden by more than a fifth."""
        return sum(_runs(column < 0.8) for column in self.share.T)


def _runs(flags: NDArray[np.bool_]) -> int:
    return int(np.count_nonzero(flags[1:] & ~flags[:-1])) + int(flags[:1].sum())


def make(
    name: str,
    mesh: Any,
    solid: Solid,
    poses: Array,
    *,
    noise: Any = 0.001,
    seed: int = 0,
    color: bool = False,
    clutter: str | None = "table",
    occluder: Any = None,
    shown: Array | None = None,
    threads: int = 0,
    cache: Path | None = None,
) -> Scene:
    """Render true poses (n, M, 4, 4); `shown` is what the camera sees in their place."""
    import sdftrack as st

    painted = st.Mesh(mesh.vertices, mesh.faces, np.tile(np.array(COLOR, np.uint8), (len(mesh.vertices), 1)))
    drawn = poses if shown is None else shown
    seq = st.synth.sequence(
        [painted] * poses.shape[1], len(poses), drawn, noise, occluder, seed, clutter=clutter, color=color,
        threads=threads, cache=cache,
    )  # fmt: skip
    known = kept(
        cache,
        ("truth", mesh.vertices, poses, drawn, occluder, clutter, seed),
        lambda: {
            "share": _shares(seq, painted, drawn, threads),
            "gaps": np.array([min_gap(solid, p) for p in poses]),
        },
    )
    return Scene(name, solid, poses, known["share"], known["gaps"], seq, seed)


def _shares(seq: Any, mesh: Any, poses: Array, threads: int) -> Array:
    """Visible pixels over those of the object alone in the image, which are counted at half the size."""
    half = seq.camera.depth.scaled(0.5)
    out = np.zeros(poses.shape[:2])
    for i, frame in enumerate(poses):
        masks = seq.masks(i)
        for k, T in enumerate(frame):
            alone = 4 * int(np.count_nonzero(mesh.raycast(half, np.ascontiguousarray(T), threads=threads)[0]))
            out[i, k] = min(1.0, int(np.count_nonzero(masks[k])) / max(alone, 1))
    return out


def kept(
    cache: Path | None, parts: tuple[Any, ...], make: Callable[[], dict[str, Array]]
) -> dict[str, Array]:
    """Arrays that depend on `parts` alone, from the cache where they are in it."""
    if cache is None:
        return make()
    digest = hashlib.sha256()
    for part in parts:
        digest.update(
            np.ascontiguousarray(part).tobytes() if isinstance(part, np.ndarray) else repr(part).encode()
        )
    path = Path(cache) / f"several_{digest.hexdigest()[:16]}.npz"
    if path.is_file():
        with np.load(path) as z:
            return dict(z)
    made = make()
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda file: np.savez_compressed(file, **made))  # type: ignore[arg-type]
    return made
