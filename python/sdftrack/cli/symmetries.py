# SPDX-License-Identifier: MIT
"""``--symmetry``: symmetries of an object."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sdftrack.cli.common import Usage
from sdftrack.cli.targets import Target

__all__ = ["check_symmetry", "give_symmetries", "symmetries_of"]

VOXELS = 80  # of a model whose symmetries are looked for


def check_symmetry(text: str) -> None:
    """Usage error for a value that is neither a keyword nor a JSON file."""
    if text not in ("auto", "none") and Path(text).suffix.lower() != ".json":
        raise Usage(f"expected auto, none or a models_info.json, got {text!r}", "--symmetry")


def symmetries_of(text: str, seq: Any, objects: list[int]) -> dict[int, Any]:
    """Symmetries by obj_id: from a models_info.json, or with "auto" from the data set, else detected in the model."""
    from sdftrack.symmetry import find_symmetries

    if text == "none":
        return {}
    if text != "auto":
        return _listed(text)
    found = {}
    for obj_id in set(objects):
        if obj_id in seq.symmetries:
            found[obj_id] = seq.symmetries[obj_id]
        elif obj_id in seq.models:
            from sdftrack.sdf import SDF

            found[obj_id] = find_symmetries(SDF.from_mesh(seq.models[obj_id], voxels=VOXELS)) or None
    return found


def _listed(text: str) -> dict[int, Any]:
    from sdftrack.io.datasets.bop import read_symmetries

    if not Path(text).is_file():
        raise FileNotFoundError(f"--symmetry: no such file: {text}")
    return dict(read_symmetries(Path(text)))


def give_symmetries(targets: list[Target], seq: Any, text: str, colored: bool) -> None:
    """Set each target's symmetry; none if colours resolve it (--colored)."""
    if text == "none" or colored:
        return
    from sdftrack.symmetry import find_symmetries

    listed = None if text == "auto" else _listed(text)
    found: dict[Path, Any] = {}
    for target in targets:
        if listed is not None:
            target.symmetry = listed.get(target.obj_id)
        elif target.known and target.obj_id in seq.symmetries:
            target.symmetry = seq.symmetries[target.obj_id]
        else:
            key = target.path.resolve()
            if key not in found:
                found[key] = find_symmetries(target.sdf)
            target.symmetry = found[key] or None
