# SPDX-License-Identifier: MIT
"""Which object of a sequence each object of recorded results is, and whether they belong together."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.symmetry import Symmetry

Array = NDArray[np.float64]


def true_frame(report: dict[str, Any], k: int, truth: Array | None) -> Array:
    """From the truth's object frame to that of the results: one for models that are tracked, chosen for an object that
    was reconstructed, so that the two agree in the first image."""
    if report["settings"].get("command") != "reconstruct":
        return np.eye(4)
    first = report["frames"][0]
    if truth is None:
        raise ValueError(
            f"ground truth: a reconstruction is compared from its first image on, and image {first['im_id']} has none"
        )
    return np.asarray(np.linalg.solve(np.asarray(first["objects"][k]["pose"], np.float64), truth), np.float64)


def known_symmetries(report: dict[str, Any], seq: Any) -> list[Symmetry | None]:
    """Symmetries of each object: those used for tracking, else those of the data set."""
    entries = report["frames"][0]["objects"]
    recorded = report["settings"].get("symmetries")
    if isinstance(recorded, list) and len(recorded) == len(entries):
        return [None if s is None else Symmetry.from_bop(s) for s in recorded]
    return [getattr(seq, "symmetries", {}).get(e["obj_id"]) for e in entries]


def check_frames(frames: list[Any], number: dict[int, int]) -> None:
    """Check that the images of the results belong to the sequence."""
    ids = [f["im_id"] for f in frames]
    foreign = [i for i in ids if i not in number]
    if len(foreign) == len(ids):
        raise ValueError(
            f"results: none of their images ({min(ids)} to {max(ids)}) is one of the sequence's ({min(number)} to "
            f"{max(number)}); is this the sequence that was tracked?"
        )
    if foreign:
        warnings.warn(
            f"results: {len(foreign)} of their {len(ids)} images are not in the sequence and are not compared",
            stacklevel=3,
        )


def check_object(report: dict[str, Any], seq: Any, k: int, instance: int | None) -> None:
    """Check that an object of the results matches its ground truth."""
    settings, entry = report["settings"], report["frames"][0]["objects"][k]
    known = settings.get("known_models")
    if settings.get("command") == "reconstruct" or not seq.models:
        return
    if isinstance(known, list) and len(known) > k and not known[k]:
        return  # tracked by a mesh of the user's own, which has no number in the data set
    own = None if instance is None or instance >= len(seq.objects) else seq.objects[instance]
    if own != entry["obj_id"]:
        has = "no instance" if own is None else f"obj_id {own} as instance {instance}"
        raise ValueError(
            f"results: object {k} ({entry['name']}) has obj_id {entry['obj_id']}, the sequence has {has} (objects "
            f"{sorted(set(seq.objects))}); is this the sequence that was tracked?"
        )


def instances_of(report: dict[str, Any], seq: Any) -> list[int | None]:
    """Instance of the ground truth for each object: as recorded, else the next unused one of its obj_id."""
    recorded = report["settings"].get("instances")
    entries = report["frames"][0]["objects"]
    if isinstance(recorded, list) and len(recorded) == len(entries):
        return recorded
    used: set[int] = set()
    out: list[int | None] = []
    for entry in entries:
        free = [k for k in range(len(seq.objects)) if k not in used]
        same = [k for k in free if seq.objects[k] == entry["obj_id"]]
        out.append((same or free or [None])[0])  # type: ignore[list-item]
        if out[-1] is not None:
            used.add(out[-1])
    return out
