# SPDX-License-Identifier: MIT
"""``sdftrack motion``: options, files, and what it says where a recording cannot be measured."""

import csv
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from motion_cases import noisy, reaches
from motion_recordings import results_of, write_folder
from scipy.spatial.transform import Rotation

import sdftrack as st
from experiments.synth.table_scene import table_scene
from sdftrack import motion
from sdftrack.cli.app import run

FEW = ["--measures", "path_length,peak_speed", "--quiet"]  # what takes time is left out
UP = ["--up", "0,-1,0"]
TIMES = np.arange(300) / 30
STARTS = (1.0, 4.0, 7.0)
FILES = {"measures.json", "measures.csv", "report.html", "repetitions.json", "trajectory_smoothed.csv"}


def cup(starts=STARTS, times=TIMES, seed=0, name="cup", away_m=(0.25, -0.1, 0.0), **fields):
    turned = Rotation.from_rotvec(np.outer(np.linspace(0, 0.4, len(times)), [0, 0, 1.0]))
    return noisy(times, reaches(times, starts, away_m), turned, seed=seed, name=name, **fields)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A folder with trajectories of a cup in two sessions and of two cups together."""
    folder = tmp_path_factory.mktemp("recorded")
    motion.save(folder / "monday.csv", cup())
    motion.save(folder / "friday.csv", cup(seed=1, away_m=(0.35, -0.1, 0.0)))
    right = cup(seed=2, name="right", starts=[s + 0.1 for s in STARTS])
    motion.save(folder / "hands.csv", [cup(name="left"), right])
    return folder


@pytest.fixture(scope="module")
def measured(recorded, tmp_path_factory):
    """The output for one session with all measures."""
    out = tmp_path_factory.mktemp("measured") / "out"
    arguments = [*UP, "--cues", "0.6,3.5,6.6", "--export", "c3d,sto,trc,csv"]
    assert run(["motion", str(recorded / "monday.csv"), *arguments, "--out", str(out), "--quiet"]) == 0
    return out


@pytest.fixture
def command(recorded, tmp_path, capsys):
    """Runs the command on a file of `recorded` or another path; returns exit code, output and JSON."""

    def called(name, *more, code=0):
        out = tmp_path / "out"
        names = [name] if isinstance(name, (str, Path)) else name
        paths = [str(recorded / n) for n in names]  # absolute ones stay what they are
        assert run(["motion", *paths, *FEW, *map(str, more), "--out", str(out), "--overwrite"]) == code
        done = capsys.readouterr()
        if code:
            assert done.err.count("\n") == 1, done.err
            assert not out.exists()
            return done.err
        return json.loads((out / "measures.json").read_text())

    return called


def objects(content, session=0):
    return content["sessions"][session]["objects"]


def read(path):
    return list(csv.DictReader(path.read_text().splitlines()))


# -- Files
def test_the_files_are_those_that_the_help_names(measured):
    exports = {f"trajectory{end}" for end in (".c3d", ".sto", "_position.sto", ".trc", ".csv")}
    assert {p.name for p in measured.iterdir()} == FILES | exports


def test_the_table_has_a_row_per_repetition_with_units_in_the_head(measured):
    rows = read(measured / "measures.csv")
    assert [r["repetition"] for r in rows] == ["1", "2", "3"]
    for row in rows:
        assert float(row["reach_low"]) < float(row["reach_m"]) < float(row["reach_high"])
        # Of a measure that is not determined the interval is told, the value is not.
        assert 0.2 < float(row["reaction_time_low"]) < float(row["reaction_time_high"]) < 0.8
    assert "peak_speed_move_m_per_s" in rows[0]
    assert "sparc_move" in rows[0]


def test_the_smoothed_movement_has_a_row_per_frame_and_its_own_derivative(measured):
    rows = read(measured / "trajectory_smoothed.csv")
    numbers = {k: np.array([float(r[k]) for r in rows]) for k in rows[0] if k not in ("session", "object")}
    np.testing.assert_allclose(numbers["time_s"], TIMES, atol=1e-4)
    true = reaches(TIMES, STARTS, (0.25, -0.1, 0.0))
    np.testing.assert_allclose(np.ptp(numbers["x_m"]), np.ptp(true[:, 0]), atol=5e-3)
    slope = np.gradient(numbers["x_m"], TIMES)
    np.testing.assert_allclose(slope, numbers["vx_m_per_s"], atol=0.05)
    lengths = sum(numbers[q] ** 2 for q in ("qx", "qy", "qz", "qw"))
    np.testing.assert_allclose(lengths, 1, atol=1e-5)


def test_a_gap_has_only_times_in_the_smoothed_movement(command, tmp_path):
    status = np.where((TIMES > 3) & (TIMES < 3.9), "lost", "ok").tolist()
    motion.save(tmp_path / "gap.csv", cup(status=status))
    content = command(tmp_path / "gap.csv")
    rows = read(tmp_path / "out" / "trajectory_smoothed.csv")
    assert {r["x_m"] == "" for r in rows if 3.1 < float(r["time_s"]) < 3.8} == {True}
    ((start, end),) = objects(content)[0]["gaps_s"]
    assert start == pytest.approx(3.0, abs=0.05)
    assert end == pytest.approx(3.9, abs=0.05)


# -- Which poses
def test_a_result_folder_is_measured(command, tmp_path):
    trajectory = cup()
    folder = write_folder(tmp_path / "result", results_of(trajectory), trajectory.times_s)
    assert objects(command(folder))[0]["repetitions"]["count"] == 3


def test_a_path_of_kilometres_asks_for_the_unit(command, tmp_path):
    q = np.tile([0, 0, 0, 1.0], (len(TIMES), 1))
    for factor in (1000, 90):  # millimetres, and something that still lies before a camera
        np.savetxt(tmp_path / "mm.txt", np.column_stack([TIMES, factor * reaches(TIMES, STARTS), q]))
        assert "--unit mm" in command(tmp_path / "mm.txt", code=1)


def test_objects_are_chosen_by_name_or_number(command):
    message = command("hands.csv", "--object", "3", code=1)
    assert "1 left, 2 right" in message
    assert "'3'" in message
    for word, name in (("left", "left"), ("2", "right")):
        assert [o["object"] for o in objects(command("hands.csv", "--object", word))] == [name]


def test_options_reach_the_analysis(command, tmp_path):
    words = {"--by": "rotation", "--axis": "0,-1,0", "--max-gap": "1", "--cues": "0.6,3.5", "--up": "0,-1,0"}
    settings = command("monday.csv", *(word for pair in words.items() for word in pair))["settings"]
    wanted = {
        "by": "rotation", "axis_obj": [0, -1, 0], "max_gap_s": 1, "cues_s": [0.6, 3.5], "up": [[0, -1, 0]],
    }  # fmt: skip
    assert {name: settings[name] for name in wanted} == wanted
    lengths = [
        objects(command("monday.csv", "--point", p, "--measures", "path_length"))[0]["averages"][0]["value"]
        for p in ("origin", "0.5,0,0")
    ]
    assert lengths[1] > lengths[0] + 0.005


# -- Two objects
def test_two_objects_of_different_length_are_compared_in_their_common_time(command, tmp_path):
    short = cup(name="right", seed=3).part(slice(0, 200))
    motion.save(tmp_path / "short.csv", [cup(name="left"), short])
    content = command(tmp_path / "short.csv")
    assert any("differ in length" in note and "6.63 s" in note for note in content["notes"])
    (pair,) = content["sessions"][0]["pairs"]
    assert pair["end_s"] == pytest.approx(199 / 30)
    assert "2 repetitions" in pair["note"]


# -- What is measured
def test_corrected_repetitions_are_measured_instead(command, tmp_path):
    command("monday.csv")
    path = tmp_path / "out" / "repetitions.json"
    value = json.loads(path.read_text())
    assert len(value["objects"][0]["repetitions"]) == 3
    value["objects"][0]["repetitions"] = value["objects"][0]["repetitions"][1:]
    path.write_text(json.dumps(value))
    content = command("monday.csv", "--repetitions", path)
    assert objects(content)[0]["repetitions"] == {"count": 2, "low": 2, "high": 2}
    assert len(json.loads(path.read_text())["objects"][0]["repetitions"]) == 2


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("r.csv", "start_s,end_s\n4, 6.5\n1, 3.5\n"),
        ("r.csv", "object,start_s,end_s\ncup,1,3.5\ncup,4,6.5\n"),
        ("r.json", "[[1, 3.5], [4, 6.5]]"),
        ("r.json", '[{"start_s": 1, "end_s": 3.5}, {"start_s": 4, "end_s": 6.5}]'),
    ],
)
def test_repetitions_may_be_written_in_several_forms(command, tmp_path, name, text):
    (tmp_path / name).write_text(text)
    found = objects(command("monday.csv", "--repetitions", tmp_path / name))[0]["each"]
    assert [(r["start_s"], r["end_s"]) for r in found] == [(1, 3.5), (4, 6.5)]


def test_an_object_without_corrected_repetitions_is_told(command, tmp_path):
    (tmp_path / "r.csv").write_text("object,start_s,end_s\nleft,1,3.5\n")
    content = command("hands.csv", "--repetitions", tmp_path / "r.csv")
    assert [o["repetitions"]["count"] for o in objects(content)] == [1, 3]
    assert any("no repetitions of right" in note for note in content["notes"])


def test_signals_may_come_from_a_file(command, tmp_path):
    forms = {"cues.txt": "0.6\n3.5\n", "cues.json": "[0.6, 3.5]", "exercise.json": '{"cues_s": [0.6, 3.5]}'}
    for name, text in forms.items():
        (tmp_path / name).write_text(text)
        assert command("monday.csv", "--cues", tmp_path / name)["settings"]["cues_s"] == [0.6, 3.5]


def test_a_zone_that_is_never_entered_is_told_with_the_nearest_distance(command, tmp_path):
    (tmp_path / "line.csv").write_text("0,0,0.8\n0.25,-0.1,0.8\n")
    far = ["--target", "sphere:0,1,0.8,0.1"]
    near = ["--target", "box:0.2,-0.2,0.7,0.3,0,0.9", "--target", f"path:{tmp_path / 'line.csv'},0.02"]
    content = command("monday.csv", *far, *near)
    (note,) = content["notes"]
    told = re.search(r"target 1 was never entered by cup; the nearest distance is (\d+) mm", note)
    assert told
    assert int(told[1]) == pytest.approx(900, abs=5)
    names = {m["name"] for m in objects(content)[0]["averages"]}
    assert {"target1_nearest", "target2_time", "target3_mean"} <= names


# -- Sessions
def test_sessions_are_compared_in_their_order_and_by_their_names(command, tmp_path):
    content = command(["monday.csv", "friday.csv"], "--session", "12 May", "--session", "2 June")
    assert [s["name"] for s in content["sessions"]] == ["12 May", "2 June"]
    changes = {c["name"]: c for c in content["changes"]}
    assert changes["path_length"]["session"] == "2 June"
    assert changes["path_length"]["shown"]
    longer_m = 2 * (np.hypot(0.35, 0.1) - np.hypot(0.25, 0.1))
    assert changes["path_length"]["value"] == pytest.approx(longer_m, abs=0.01)
    assert {"repetitions_1.json", "repetitions_2.json"} <= {p.name for p in (tmp_path / "out").iterdir()}


# -- The table
@pytest.fixture
def on_a_table(tmp_path):
    """A result folder whose report names a recording with a table."""
    scene = table_scene()
    frame = st.Frame(scene.frame.depth, timestamp=0.0)
    st.save_sequence(tmp_path / "recording", st.Sequence([frame], scene.camera), layout="tum")
    folder = write_folder(tmp_path / "result", results_of(cup()), TIMES)
    report = json.loads((folder / "report.json").read_text())
    report["settings"]["sequence"] = str(tmp_path / "recording")
    (folder / "report.json").write_text(json.dumps(report))
    _, (normal, offset) = st.remove_plane(frame, scene.camera)
    return folder, normal if offset > 0 else -normal


def test_up_and_positions_may_be_those_of_the_table_in_the_recording(command, on_a_table):
    folder, normal = on_a_table
    np.testing.assert_allclose(command(folder, "--up", "table")["settings"]["up"][0], normal, atol=1e-4)
    content = command(folder, "--frame", "table")
    assert objects(content)[0]["frame"] == "table"
    np.testing.assert_allclose(content["settings"]["up"][0], [0, 0, 1], atol=1e-6)


def test_without_its_recording_the_table_cannot_be_found(command, on_a_table, recorded):
    shutil.rmtree(on_a_table[0].parent / "recording")
    assert "is not there; give --up x,y,z" in command(on_a_table[0], "--up", "table", code=1)
    assert "no recording" in command("monday.csv", "--up", "table", code=1)


# -- Recordings that cannot be measured
def test_an_object_that_is_lost_throughout_exits_with_3(command, tmp_path):
    lost = results_of(cup())
    for r in lost:
        r.status[:] = [st.Status.LOST]
    folder = write_folder(tmp_path / "lost", lost, TIMES)
    assert "cup: lost in all frames" in command(folder, code=3)


def test_a_result_is_not_replaced_by_what_is_measured_of_it(recorded, tmp_path, capsys):
    path = tmp_path / "trajectory.csv"
    shutil.copy(recorded / "monday.csv", path)
    assert run(["motion", str(path), "--export", "csv", "--out", str(tmp_path), "--overwrite"]) == 1
    assert "would be replaced" in capsys.readouterr().err
    assert path.read_bytes() == (recorded / "monday.csv").read_bytes()
