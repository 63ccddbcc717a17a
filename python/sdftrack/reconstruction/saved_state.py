# SPDX-License-Identifier: MIT
"""State of a reconstructor in a file: frames and poses, from which the shape is rebuilt."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sdftrack._internal.thread_guard import reentrant_lock
from sdftrack.device import resolve_device
from sdftrack.tracking.interface import TrackerInterface

if TYPE_CHECKING:
    from sdftrack.reconstruction.reconstructor import Reconstructor

__all__ = ["restore", "state_of"]


def state_of(star: Reconstructor) -> dict[str, Any]:
    """Everything except volume and tracker, and the data to rebuild them."""
    state = dict(star.__dict__)
    volume, tracker, _ = (state.pop(name) for name in ("_volume", "_tracker", "_lock"))
    if state.pop("_any_device"):
        state["device"] = "auto"
    if tracker is not None:
        state["saved"] = volume.lattice, volume.fused, TrackerInterface(tracker).last_poses[0]
    return state


def restore(star: Reconstructor, state: dict[str, Any]) -> None:
    """Restore the attributes of an empty reconstructor."""
    saved = state.pop("saved", None)
    star.__dict__.update(state)
    star._any_device = star.device == "auto"
    star.device = resolve_device(star.device)
    if "_mask_extent" not in state:
        star._mask_extent = star._extent_of_mask(star._beginning)
    star._volume = star._tracker = None
    star._lock = reentrant_lock()
    if saved is None:
        return
    lattice, _, pose = saved
    star._volume = star._empty_volume(lattice, star._beginning)
    star._tracker = star._new_tracker()
    star._fuse_all(lambda share: None)  # counts the frames that the shape is made of from now on
    star._go_on(pose)
