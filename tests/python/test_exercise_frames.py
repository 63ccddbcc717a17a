# SPDX-License-Identifier: MIT
"""Synthetic exercises: objects, rendered frames, files and the command."""

import json

import numpy as np
import pytest

import sdftrack as st
from sdftrack.cli.app import run
from sdftrack.synth.objects import OBJECTS


@pytest.mark.parametrize("name", OBJECTS)
def test_objects_stand_on_their_foot_have_the_size_of_a_hand_and_face_outwards(name):
    mesh = st.synth.exercise_object(name)
    low, high = mesh.bounds
    assert low[2] == pytest.approx(0, abs=1e-9)
    assert 0.05 < (high - low).max() < 0.15
    corners = mesh.vertices[mesh.faces]
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume > 2e-5
    assert mesh.colors.std() > 15  # a print


def test_frames_show_the_objects_on_the_table_of_the_truth():
    made = st.synth.exercise("two_handed", seed=2, repetitions=1, meeting_m=0.071)
    camera = st.Camera(131.25, 131.25, 79.5, 59.5, 160, 120)
    seq = st.synth.exercise_sequence(made, st.synth.exercise_object("box"), noise=None, camera=camera)
    assert len(seq) == len(made.times_s)
    assert seq.objects == [1, 1]
    i = len(seq) // 2
    frame = seq[i]
    assert frame.timestamp == i / 30
    for k in (0, 1):
        np.testing.assert_allclose(
            seq.ground_truth[i][k], made.poses(made.times_s[i : i + 1], k)[0], atol=1e-12
        )
        assert seq.masks(i)[k].sum() > 100
    n, d = made.table
    height = camera.back_project(frame.depth) @ n + d
    assert height[frame.depth > 0].min() > -1e-5  # nothing is under the table
    assert (np.abs(height[frame.depth > 0]) < 1e-5).mean() > 0.5
    assert height[seq.masks(i)[0]].min() > 0.01  # held in the air


def test_surroundings_can_be_left_out_and_a_hand_put_in():
    made, cup = st.synth.exercise("reach", repetitions=1), st.synth.exercise_object("cup")
    bare = st.synth.exercise_sequence(made, cup, noise=None, around=None, frames=1)
    assert ((bare[0].depth > 0) == bare.masks(0)[0]).all()
    held = st.synth.exercise_sequence(made, cup, noise=None, frames=1, occluder="grip")
    assert held.masks(0)[0].sum() < 0.8 * bare.masks(0)[0].sum()


def test_an_exercise_comes_back_from_its_file(tmp_path):
    made = st.synth.exercise("tremor", seed=7, repetitions=2, tremor_hz=5.5, origin_m=0.02)
    made.save(tmp_path / "exercise.json")
    assert st.synth.load_exercise(tmp_path / "exercise.json") == made
    assert st.synth.load_exercise(tmp_path) == made
    stored = json.loads((tmp_path / "exercise.json").read_text())
    assert stored["tremor_hz"] == 5.5
    assert len(stored["cues_s"]) == 2
    stored["repetitions"][0][0] += 0.1
    (tmp_path / "exercise.json").write_text(json.dumps(stored))
    with pytest.raises(ValueError, match="written by a version that makes other exercises"):
        st.synth.load_exercise(tmp_path)
    (tmp_path / "exercise.json").write_text("[]")
    with pytest.raises(ValueError, match="expected the file of an exercise"):
        st.synth.load_exercise(tmp_path)
    with pytest.raises(FileNotFoundError):
        st.synth.load_exercise(tmp_path / "nowhere.json")


@pytest.mark.parametrize(("kind", "name", "objects"), [("reach", "cup", 1), ("two-handed", "box", 2)])
def test_the_command_writes_the_sequence_and_its_truth(tmp_path, kind, name, objects):
    out = tmp_path / "s"
    words = f"synth exercise --kind {kind} --object {name} --repetitions 2 --frames 2 -q".split()
    assert run([*words, "--noise", "none", "--seed", "3", "--out", str(out)]) == 0
    seq, made = st.open_sequence(out), st.synth.load_exercise(out)
    assert made.kind == kind.replace("-", "_")
    assert len(made.repetitions) == 2
    assert (len(seq), sorted(seq.models), len(seq.ground_truth[1])) == (2, [1], objects)
    for k in range(objects):
        np.testing.assert_allclose(seq.ground_truth[1][k], made.poses([1 / 30], k)[0], atol=1e-6)
    assert run([*words, "--seed", "4", "--overwrite", "--out", str(out)]) == 0
    assert st.synth.load_exercise(out) != made


def test_the_command_takes_a_model_of_ones_own(tmp_path):
    st.synth.can_mesh(40, 20).save(tmp_path / "can.ply")
    words = ["synth", "exercise", "--model", str(tmp_path / "can.ply"), "--frames", "1", "-q"]
    assert run([*words, "--out", str(tmp_path / "s")]) == 0
    assert st.synth.load_exercise(tmp_path / "s").arguments["origin_m"] == pytest.approx(0.055)
