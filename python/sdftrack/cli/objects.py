# SPDX-License-Identifier: MIT
"""The objects of commands: meshes with volumes, their instances in the ground truth, and their symmetries."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import sdftrack as st
from sdftrack.cli.options import Usage


@dataclass
class Target:
    """One object to track: its mesh, volume, names and the instance of the ground truth that it is."""

    name: str
    path: Path
    mesh: Any
    sdf: Any
    obj_id: int
    instance: int | None
    known: bool = True  # its mesh is one of the data set's
    symmetry: Any = None


def load_targets(
    models: Sequence[Path], seq: Any, unit: str | None, voxels: int, holes: Any = "error", color: bool = False
) -> list[Target]:
    """Load meshes with volumes (one per distinct file) and assign ground-truth instances."""
    loaded: dict[Path, tuple[Any, Any, int | None]] = {}
    targets: list[Target] = []
    used: set[int | None] = set()
    keys = [path.resolve() for path in models]
    for path, key in zip(models, keys, strict=True):
        if key not in loaded:
            mesh = load_mesh(path, "--model", unit)
            own = own_obj_id(mesh, seq, known_unit=unit is not None)
            mesh = mesh if own is None else seq.models[own]
            with about_file("--model", path):
                same: Literal["m"] | None = "m" if unit == "m" else None
                sdf = st.SDF.from_mesh(mesh, voxels=voxels, holes=holes, color=color, unit=same)
            loaded[key] = (mesh, sdf, own)
        mesh, sdf, own = loaded[key]
        foreign = [k for k, (_, _, known) in loaded.items() if known is None]
        obj_id = own if own is not None else 1 + foreign.index(key)
        free = (k for k, other in enumerate(seq.objects) if k not in used and own in (None, other))
        instance = next(free, None)
        used.add(instance)
        name = path.stem if keys.count(key) == 1 else f"{path.stem} {len(targets)}"
        targets.append(Target(name, path, mesh, sdf, obj_id, instance, own is not None))
    return targets


@contextlib.contextmanager
def about_file(option: str, path: Path) -> Iterator[None]:
    def told(text: str) -> str:
        text = text.removeprefix("mesh: ")
        return f"{option}: {text}" if str(path) in text else f"{option} {path}: {text}"

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            yield
        except (TypeError, ValueError, FileNotFoundError) as error:
            raise type(error)(told(str(error))) from error
    for warning in caught:
        warnings.warn(told(str(warning.message)), warning.category, stacklevel=3)


def load_mesh(path: Path, option: str, unit: str | None) -> Any:
    with about_file(option, path):
        return st.Mesh.load(path, unit=unit)


def own_obj_id(mesh: Any, seq: Any, known_unit: bool = False) -> int | None:
    """The obj_id of this mesh in the sequence; if its unit is unknown, other units are tested as well."""
    import numpy as np

    from sdftrack.mesh import UNITS

    ratios = [1.0] if known_unit else list(UNITS.values())
    for obj_id, own in seq.models.items():
        if own.vertices.shape == mesh.vertices.shape and np.array_equal(own.faces, mesh.faces):
            size = np.ptp(own.vertices, axis=0).max()
            if any(np.allclose(r * mesh.vertices, own.vertices, rtol=0, atol=1e-5 * size) for r in ratios):
                return int(obj_id)
    return None


def check_symmetry(text: str) -> str:
    if text not in ("auto", "none") and Path(text).suffix.lower() != ".json":
        raise Usage(f"expected auto, none or a models_info.json, got {text!r}", "--symmetry")
    return text


def symmetry_of(text: str, seq: Any, obj_id: int, known: bool, shape: Callable[[], Any]) -> Any:
    """Listed in a models_info.json, or with "auto" of the data set if it has the model, else found in the shape."""
    if text != "auto":
        from sdftrack.io.datasets.bop import read_symmetries

        if not Path(text).is_file():
            raise FileNotFoundError(f"--symmetry: no such file: {text}")
        return read_symmetries(Path(text)).get(obj_id)
    if known and obj_id in seq.symmetries:
        return seq.symmetries[obj_id]
    return st.find_symmetries(shape()) or None


def give_symmetries(targets: list[Target], seq: Any, text: str, colored: bool) -> None:
    if text == "none" or colored:
        return
    first = {target.path.resolve(): target for target in reversed(targets)}

    def found(one: Target) -> Any:
        return symmetry_of(text, seq, one.obj_id, one.known, lambda: one.sdf)

    by_path = {path: found(one) for path, one in first.items()}
    for target in targets:
        target.symmetry = by_path[target.path.resolve()]
