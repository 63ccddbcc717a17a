# SPDX-License-Identifier: MIT
"""Files of saved objects: damaged anywhere, and crafted with other contents."""

import io
import json
import random
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_files import beside, changed_value, file_case, mutated
from fuzz_readers import written
from fuzz_targets import Case, Target
from fuzz_values import nasty_array

import sdftrack as st


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
        "ball.npz": written(folder, "b.npz", ball.save),
        "color.npz": written(folder, "c.npz", st.SDF(ball.values, ball.voxel_size, ball.origin, colors).save),
        "plain.npz": (folder / "p.npz").read_bytes(),
        "deflated.npz": (folder / "q.npz").read_bytes(),
    }
    return file_case(folder, seeds, st.SDF.load, change=crafted)


def _flat(camera: Any) -> st.Frame:
    return st.Frame(np.full(getattr(camera, "depth", camera).shape, 0.6, np.float32))


MASK = np.hypot(*(np.mgrid[:64, :64] - 32)) < 20
USES = {
    "tracker": lambda loaded: loaded.track(_flat(loaded.camera)),
    "reconstructor": lambda loaded: loaded.track(_flat(loaded.camera)),
    "memory": lambda loaded: loaded.learn(MASK),
    "model": lambda loaded: loaded.predict(np.full((3, loaded.n_inputs or 2), 0.4)),
}


def _of(name: str) -> Callable[[Path], Case]:
    """Of an object of the tests of saved files."""

    def make(folder: Path) -> Case:
        beside()
        import test_saved_files

        saved = test_saved_files.SAVED[name]

        def load(path: Path) -> Any:
            loaded = saved.load(path)
            return used(lambda: USES[name](loaded))

        return file_case(
            folder, {f"a.{name}": written(folder, "made", saved.make().save)}, load, change=crafted
        )

    return make


TARGETS = (
    Target("saved_sdf", _sdf, weight=0.6),
    Target("saved_lwpr", _of("model"), weight=0.5),
    Target("saved_memory", _of("memory"), weight=0.4),
    Target("saved_tracker", _of("tracker"), weight=0.3),
    Target("saved_reconstructor", _of("reconstructor"), weight=0.2),
)
