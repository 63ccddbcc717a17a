# SPDX-License-Identifier: MIT
"""Files of saved objects: damaged anywhere, and crafted with other contents."""

from __future__ import annotations

import io
import json
import random
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_files import changed_value, file_case, mutated
from fuzz_targets import Case, Target, finite
from fuzz_values import nasty_array

import sdftrack as st

CAMERA = st.Camera(60.0, 61.0, 31.0, 23.5, 64, 48)
POSE = st.geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.4])


def crafted(rng: random.Random, name: str, data: bytes) -> bytes:
    """A change of the header or of an array, in a file that is whole."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {each: archive.read(each) for each in archive.namelist()}
    if "header.json" not in members:
        return mutated(rng, data)
    tree = json.loads(members["header.json"])
    arrays = [each for each in members if each.endswith(".npy")]
    if arrays and rng.random() < 0.5:
        which = rng.choice(arrays)
        changed = io.BytesIO()
        np.save(changed, _numeric(rng, np.load(io.BytesIO(members[which]))), allow_pickle=False)
        members[which] = changed.getvalue()
    elif rng.random() < 0.9:
        tree["content"] = changed_value(rng, tree["content"])
    else:
        tree = changed_value(rng, tree)
    members["header.json"] = json.dumps(tree).encode()
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", rng.choice([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])) as archive:
        for each, content in members.items():
            archive.writestr(each, content)
    return made.getvalue()


def _numeric(rng: random.Random, array: np.ndarray) -> np.ndarray:
    if array.dtype == np.uint8 and array.ndim == 1 and rng.random() < 0.7:  # bytes of the core
        return np.frombuffer(mutated(rng, array.tobytes()), np.uint8)
    out = np.asarray(nasty_array(rng, array))
    return out if out.dtype.kind in "biuf" else array


def _case(folder: Path, seeds: dict[str, bytes], load: Callable[[Path], Any], check: Any = None) -> Case:
    return file_case(folder, seeds, load, change=crafted, check=check)


def _saved(folder: Path, name: str, what: Any) -> bytes:
    path = folder / name
    what.save(path)
    return path.read_bytes()


def used(use: Callable[[], Any]) -> Any:
    """What a loaded object does; it may refuse, without the name of its file, as one that has learned nothing."""
    try:
        return use()
    except (ValueError, TypeError, RuntimeError):
        return None


def _sdf(folder: Path) -> Case:
    ball = st.SDF.sphere(0.03, voxels=12)
    colors = np.full((*ball.values.shape, 4), 200, np.uint8)
    np.savez(folder / "p.npz", values=ball.values, voxel_size=ball.voxel_size, origin=ball.origin)
    np.savez_compressed(folder / "q.npz", values=ball.values, voxel_size=ball.voxel_size, origin=ball.origin)
    seeds = {
        "ball.npz": _saved(folder, "b.npz", ball),
        "color.npz": _saved(folder, "c.npz", st.SDF(ball.values, ball.voxel_size, ball.origin, colors)),
        "plain.npz": (folder / "p.npz").read_bytes(),
        "deflated.npz": (folder / "q.npz").read_bytes(),
    }
    return _case(folder, seeds, st.SDF.load, finite)


def _lwpr(folder: Path) -> Case:
    rng = np.random.default_rng(0)
    x = rng.random((60, 2))
    model = st.LWPR(init_D=50.0, threads=1).fit(x, np.sin(3 * x[:, :1]) + x[:, 1:])

    def load(path: Path) -> Any:
        loaded = st.LWPR.load(path)
        used(lambda: loaded.predict(np.full((3, loaded.n_inputs or 2), 0.4)))

    return _case(folder, {"a.lwpr": _saved(folder, "s.lwpr", model)}, load)


def _memories(folder: Path) -> Case:
    memory = st.contour.ShapeMemory(n_harmonics=4, size=24, capacity=8)
    y, x = np.mgrid[:40, :40]
    for a in range(6):
        memory.learn(np.hypot((x - 20) * (1 + 0.1 * a), y - 20) < 12)
    mask = np.hypot(x - 20, y - 20) < 11

    def load(path: Path) -> Any:
        loaded = st.contour.ShapeMemory.load(path)
        used(lambda: loaded.assess(mask))
        used(lambda: loaded.learn(mask))

    return _case(folder, {"a.memory": _saved(folder, "s.memory", memory)}, load)


def _frame() -> st.Frame:
    depth = st.SDF.box([0.12, 0.09, 0.06], voxels=24).render(CAMERA, POSE, 1)[0]
    return st.Frame(np.where(depth > 0, depth, 1.2).astype(np.float32))


def _trackers(folder: Path) -> Case:
    frame = _frame()
    tracker = st.Tracker(
        [st.SDF.box([0.12, 0.09, 0.06], voxels=16), st.SDF.sphere(0.03, voxels=12)], CAMERA, threads=1
    )
    tracker.start(frame, poses=[POSE, st.geometry.pose([0, 0, 0], [0.1, 0, 0.5])])
    tracker.track(frame)

    def load(path: Path) -> Any:
        loaded = st.Tracker.load(path)
        return used(lambda: loaded.track(frame))

    return _case(folder, {"a.tracker": _saved(folder, "s.tracker", tracker)}, load, finite)


def _reconstructors(folder: Path) -> Case:
    frame = _frame()
    star = st.Reconstructor(CAMERA, voxels=24, threads=1)
    star.start(frame, mask=np.asarray(frame.depth) < 1)
    star.track(frame)

    def load(path: Path) -> Any:
        loaded = st.Reconstructor.load(path)
        return used(lambda: loaded.track(frame))

    return _case(folder, {"a.star": _saved(folder, "s.star", star)}, load, finite)


TARGETS = (
    Target("saved_sdf", _sdf, weight=0.6),
    Target("saved_lwpr", _lwpr, weight=0.5),
    Target("saved_memory", _memories, weight=0.4),
    Target("saved_tracker", _trackers, weight=0.3),
    Target("saved_reconstructor", _reconstructors, weight=0.2),
)
