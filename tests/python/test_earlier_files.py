# SPDX-License-Identifier: MIT
"""Files of version 0.1, written before modules and classes had the names that they have now."""

from __future__ import annotations

import io
import lzma
import os
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import reconstruction_scene as scene

import sdftrack as st
from sdftrack._internal import earlier_pickle
from sdftrack._internal.files import write_text

# The body of reconstruction_scene before a camera of 120 x 90 pixels, started in frame 0, then frames 1, 1, 2, 2.
RECONSTRUCTOR = Path(__file__).parents[1] / "data" / "reconstructor_of_0_1.pickle.xz"


def test_a_reconstructor_of_0_1_loads_and_goes_on(tmp_path: Path) -> None:
    file = tmp_path / "reconstructor.pickle"
    file.write_bytes(lzma.decompress(RECONSTRUCTOR.read_bytes()))
    star = st.Reconstructor.load(file, trust_pickle=True)
    assert [keyframe.index for keyframe in star._kept] == [0, 1, 3, 4]
    camera = st.Camera(150.0, 150.0, 59.5, 44.5, 120, 90)
    seq = st.synth.sequence(scene.body(), 3, scene.turning(3, 6.0), 0.001, seed=4, camera=camera, threads=1)
    result = star.track(seq[2])
    assert result.index == 5
    assert result.status[0] in ("ok", "weak")
    st.testing.assert_pose_close(result.poses[0], star._kept[3].T_cam_obj, 2e-3, np.radians(1))
    assert len(star.mesh().faces) > 100
    star.save(tmp_path / "star")  # which needs no trust
    assert st.Reconstructor.load(tmp_path / "star")._index == 5


@pytest.mark.parametrize("kind", [st.Tracker, st.Reconstructor])
def test_a_pickle_is_not_read_unless_it_is_trusted(kind: Any, tmp_path: Path) -> None:
    file = tmp_path / "trusted.pickle"
    file.write_bytes(lzma.decompress(RECONSTRUCTOR.read_bytes()))
    with pytest.raises(
        ValueError, match=rf"trusted\.pickle: .*{kind.__name__}\.load\(path, trust_pickle=True\)"
    ):
        kind.load(file)


def test_a_pickle_of_another_object_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "reconstructor.pickle"
    file.write_bytes(lzma.decompress(RECONSTRUCTOR.read_bytes()))
    with pytest.raises(ValueError, match="expected a saved Tracker, got Reconstructor"):
        st.Tracker.load(file, trust_pickle=True)


@pytest.mark.parametrize("old", sorted(earlier_pickle.MODULES))
def test_classes_are_found_by_the_modules_that_pickles_name(old: str) -> None:
    names = {
        "sdftrack.reconstruction.shots": "Shot",
        "sdftrack.reconstruction.keyframes": "Keyframes",
        "sdftrack.reconstruction.beginning": "Beginning",
        "sdftrack.tracking.saving": "rebuild",
    }
    name = names[old]
    found = earlier_pickle._Restricted(io.BytesIO()).find_class(old, name)
    assert found.__name__ == earlier_pickle.CLASSES.get(name, name)


class Marked:
    """Pickles of it call something when they are read."""

    def __init__(self, call: Any, *arguments: Any) -> None:
        self.call, self.arguments = call, arguments

    def __reduce__(self) -> Any:
        return self.call, self.arguments


@pytest.mark.parametrize("load", [st.Tracker.load, st.Reconstructor.load])
@pytest.mark.parametrize("call", [os.mkdir, write_text, eval, np.save])
@pytest.mark.parametrize("protocol", [2, 4, 5])
def test_calls_in_a_pickle_are_never_made(load: Any, call: Any, protocol: int, tmp_path: Path) -> None:
    file, made = tmp_path / "evil.pickle", tmp_path / "made"
    text = f"open({str(made)!r}, 'w')"
    arguments = {
        os.mkdir: (str(made),),
        write_text: (str(made), "x"),
        eval: (text,),
        np.save: (str(made), np.eye(3)),
    }
    file.write_bytes(pickle.dumps(Marked(call, *arguments[call]), protocol))
    for trust in (False, True):
        with pytest.raises(ValueError, match=r"evil\.pickle: expected a file of"):
            load(file, trust_pickle=trust)
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("name", ["os.system", "Path", "replacing", "Camera.save"])
def test_names_within_names_are_refused(name: str, tmp_path: Path) -> None:
    file = tmp_path / "evil.pickle"
    module = b"sdftrack._internal.files"
    words = b"".join(b"\x8c" + bytes([len(word)]) + word for word in (module, name.encode()))
    file.write_bytes(b"\x80\x04" + words + b"\x93.")
    with pytest.raises(ValueError, match=r"evil\.pickle: .*which no saved object needs"):
        st.Tracker.load(file, trust_pickle=True)


def test_a_truncated_pickle_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "cut.pickle"
    whole = lzma.decompress(RECONSTRUCTOR.read_bytes())
    for size in range(2, len(whole), 9973):
        file.write_bytes(whole[:size])
        with pytest.raises(
            ValueError, match=r"cut\.pickle: expected a file of Reconstructor\.save, got an unreadable"
        ):
            st.Reconstructor.load(file, trust_pickle=True)
