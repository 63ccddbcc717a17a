# SPDX-License-Identifier: MIT
"""Files of version 0.1, written before modules and classes had the names that they have now."""

from __future__ import annotations

import lzma
import pickle
from pathlib import Path

import numpy as np
import pytest
import reconstruction_scene as scene

import sdftrack as st
from sdftrack._internal.moved import CLASSES, MODULES

# The body of reconstruction_scene before a camera of 120 x 90 pixels, started in frame 0, then frames 1, 1, 2, 2.
RECONSTRUCTOR = Path(__file__).parents[1] / "data" / "reconstructor_of_0_1.pickle.xz"


def test_a_reconstructor_of_0_1_loads_and_goes_on(tmp_path: Path) -> None:
    file = tmp_path / "reconstructor.pickle"
    file.write_bytes(lzma.decompress(RECONSTRUCTOR.read_bytes()))
    star = st.Reconstructor.load(file)
    assert [keyframe.index for keyframe in star._kept] == [0, 1, 3, 4]
    camera = st.Camera(150.0, 150.0, 59.5, 44.5, 120, 90)
    seq = st.synth.sequence(scene.body(), 3, scene.turning(3, 6.0), 0.001, seed=4, camera=camera, threads=1)
    result = star.track(seq[2])
    assert result.index == 5
    assert result.status[0] in ("ok", "weak")
    st.testing.assert_pose_close(result.poses[0], star._kept[3].T_cam_obj, 2e-3, np.radians(1))
    assert len(star.mesh().faces) > 100


@pytest.mark.parametrize("old", sorted(MODULES))
def test_classes_are_found_by_the_modules_that_pickles_name(old: str) -> None:
    names = {
        "sdftrack.energy_state": ("State", st.State),
        "sdftrack.reconstruction.shots": ("Shot", None),
        "sdftrack.reconstruction.keyframes": ("Keyframes", None),
        "sdftrack.reconstruction.beginning": ("Beginning", None),
        "sdftrack.plane": ("remove_plane", st.remove_plane),
        "sdftrack.tracking.saving": ("rebuild", None),
    }
    name, expected = names[old]
    found = pickle.loads(f"c{old}\n{name}\n.".encode())
    assert found.__name__ == CLASSES.get(name, name)
    assert expected is None or found is expected


def test_a_module_that_never_was_is_still_an_error() -> None:
    with pytest.raises(ModuleNotFoundError, match="no_such_module"):
        pickle.loads(b"csdftrack.no_such_module\nX\n.")
