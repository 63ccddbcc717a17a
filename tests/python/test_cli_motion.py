# SPDX-License-Identifier: MIT
"""``sdftrack motion``: files in, report out, and one line for what it cannot use."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from motion_cases import noisy, reaches
from motion_recordings import results_of, write_folder

import sdftrack as st
from sdftrack.cli.app import run
from sdftrack.io.trajectories import write_tum

SCHEMA = Path(__file__).parents[2] / "docs" / "reference" / "motion.schema.json"
FPS = 30
STARTS_S = (0.8, 3.8)
FILES = {"measures.json", "measures.csv", "report.html", "repetitions.json"}
FEW = ["--measures", "reach,range_x"]  # the others take time


def session(seed=0, far_m=0.25, name="cup", status=None, starts_s=STARTS_S):
    t = np.arange(7 * FPS) / FPS
    return noisy(t, reaches(t, starts_s, (far_m, 0.1, 0.0)), seed=seed, name=name, status=status)


def tum(path, trajectory=None):
    trajectory = trajectory or session()
    write_tum(path, trajectory.times_s, trajectory.poses)
    return path


@pytest.fixture(scope="module")
def monday(tmp_path_factory):
    return tum(tmp_path_factory.mktemp("sessions") / "monday.txt")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A result folder with two objects."""
    a, b = session(1), session(2, far_m=-0.2, name="box")
    root = tmp_path_factory.mktemp("results") / "run"
    return write_folder(root, results_of(a, b), a.times_s, ("cup", "box"), (1, 2))


def measured(out):
    return json.loads((out / "measures.json").read_text(encoding="utf-8"))


def averages(value, session=0, object=0):
    return {m["name"]: m for m in value["sessions"][session]["objects"][object]["averages"]}


def call(*arguments):
    return run(["motion", *(str(a) for a in arguments)])


def told(capsys):
    err = capsys.readouterr().err
    assert err.count("\n") == 1, err
    assert err.startswith("sdftrack: error: ")
    return err


@pytest.mark.slow
class TestWhatItWrites:
    def test_a_text_file_becomes_a_report(self, monday, tmp_path, capsys):
        out = tmp_path / "out"
        assert call(monday, "--out", out, "--up", "0,0,1") == 0
        printed = capsys.readouterr().out
        assert "monday, monday: 2 repetitions (2 to 2) in 7.0 s" in printed
        assert "not determined" in printed  # the angular speed of what does not turn
        assert str(out / "report.html") in printed
        assert {p.name for p in out.iterdir()} == FILES
        value = measured(out)
        jsonschema = pytest.importorskip("jsonschema")
        jsonschema.validate(value, json.loads(SCHEMA.read_text(encoding="utf-8")))
        assert value["settings"]["results"] == [str(monday)]
        (one,) = value["sessions"]
        assert one["name"] == "monday"
        assert one["objects"][0]["repetitions"]["count"] == 2
        assert averages(value)["reach"]["value"] == pytest.approx(np.hypot(0.25, 0.1), rel=0.03)
        assert averages(value)["range_height"]["value"] < 0.005
        with (out / "measures.csv").open(newline="") as f:
            rows = list(csv.DictReader(f))
        assert [(r["session"], r["repetition"]) for r in rows] == [("monday", "1"), ("monday", "2")]
        assert "Exercise with monday" in (out / "report.html").read_text(encoding="utf-8")

    def test_a_result_folder_has_its_objects_names_and_covariances(self, folder, tmp_path, capsys):
        out = tmp_path / "out"
        assert call(folder, "--out", out, *FEW) == 0
        printed = capsys.readouterr().out
        assert "run, cup: 2 repetitions" in printed
        assert "run, box: 2 repetitions" in printed
        objects = measured(out)["sessions"][0]["objects"]
        assert [o["object"] for o in objects] == ["cup", "box"]
        # The noise is that of the covariances, which a text file does not have.
        assert objects[0]["noise_scales"] == pytest.approx([1, 1], abs=0.3)
        assert len(json.loads((out / "repetitions.json").read_text())["objects"]) == 2

    def test_only_the_object_asked_for(self, folder, tmp_path):
        assert call(folder, "--out", tmp_path / "o", "--object", "box", "-q", *FEW) == 0
        (one,) = measured(tmp_path / "o")["sessions"][0]["objects"]
        assert one["object"] == "box"
        assert averages(measured(tmp_path / "o"))["range_x"]["value"] == pytest.approx(0.2, rel=0.03)

    def test_quiet_prints_nothing(self, monday, tmp_path, capsys):
        assert call(monday, "--out", tmp_path / "o", "-q", *FEW) == 0
        printed = capsys.readouterr()
        assert (printed.out, printed.err) == ("", "")

    def test_several_results_are_sessions_that_are_compared(self, monday, tmp_path):
        friday = tum(tmp_path / "friday.txt", session(5, far_m=0.32))
        again = tum(tmp_path / "monday.txt", session(6))
        out = tmp_path / "out"
        assert call(monday, friday, again, "--out", out, "-q", *FEW, "--export", "csv") == 0
        value = measured(out)
        assert [s["name"] for s in value["sessions"]] == ["monday", "friday", "monday (3)"]
        shown = {(c["session"], c["name"]): c for c in value["changes"]}
        change = shown["friday", "range_x"]
        assert change["shown"]
        assert change["low"] <= 0.07 <= change["high"]
        assert "Changes since monday" in (out / "report.html").read_text()
        assert {p.name for p in out.glob("trajectory*")} == {f"trajectory_{k}.csv" for k in (1, 2, 3)}

    def test_an_object_that_does_not_move_is_reported_too(self, tmp_path, capsys):
        still = tum(tmp_path / "still.txt", session(starts_s=()))
        assert call(still, "--out", tmp_path / "o") == 0
        assert "0 repetitions" in capsys.readouterr().out
        assert "No repetition" in (tmp_path / "o" / "report.html").read_text()
        assert measured(tmp_path / "o")["sessions"][0]["objects"][0]["each"] == []

    def test_an_existing_folder_is_replaced_only_if_asked(self, monday, tmp_path, capsys):
        out = tmp_path / "out"
        out.mkdir()
        (out / "notes.txt").write_text("mine")
        assert call(monday, "--out", out, "-q", *FEW) == 1
        assert "--overwrite" in told(capsys)
        assert {p.name for p in out.iterdir()} == {"notes.txt"}
        assert call(monday, "--out", out, "-q", "--overwrite", *FEW) == 0
        assert {p.name for p in out.iterdir()} == {"notes.txt", *FILES}


@pytest.mark.slow
class TestOptions:
    def test_repetitions_come_back_and_may_be_changed(self, monday, tmp_path):
        assert call(monday, "--out", tmp_path / "a", "-q", *FEW) == 0
        found = tmp_path / "a" / "repetitions.json"
        assert call(monday, "--out", tmp_path / "b", "-q", "--repetitions", found, *FEW) == 0
        assert averages(measured(tmp_path / "b")) == averages(measured(tmp_path / "a"))
        assert json.loads((tmp_path / "b" / "repetitions.json").read_text()) == json.loads(found.read_text())
        value = json.loads(found.read_text())
        value["objects"][0]["repetitions"] = [[0.5, 3.3]]
        found.write_text(json.dumps(value))
        assert call(monday, "--out", tmp_path / "c", "-q", "--repetitions", found, *FEW) == 0
        (one,) = measured(tmp_path / "c")["sessions"][0]["objects"][0]["each"]
        assert (one["start_s"], one["end_s"]) == (0.5, 3.3)

    @pytest.mark.parametrize(
        ("name", "content"),
        [("cues.txt", "0.5\n3.6\n"), ("cues.csv", "0.5,3.6"), ("exercise.json", '{"cues_s": [0.5, 3.6]}')],
    )
    def test_cues_come_from_a_file(self, monday, tmp_path, name, content):
        (tmp_path / name).write_text(content)
        options = ["--cues", tmp_path / name, "--measures", "reaction_time"]
        assert call(monday, "--out", tmp_path / "o", "-q", *options) == 0
        self.check_cues(tmp_path / "o")

    def test_cues_come_from_the_command_line(self, monday, tmp_path):
        options = ["--cues", "3.6, 0.5", "--measures", "reaction_time"]
        assert call(monday, "--out", tmp_path / "o", "-q", *options) == 0
        self.check_cues(tmp_path / "o")

    def check_cues(self, out):
        each = measured(out)["sessions"][0]["objects"][0]["each"]
        assert [r["cue_s"] for r in each] == [0.5, 3.6]
        # A minimum-jerk movement of 0.8 s passes 5 % of its speed after 0.05 s.
        times = [r["measures"][0]["value"] for r in each]
        assert times == pytest.approx([0.35, 0.25], abs=0.06)

    def test_up_is_the_direction_of_heights(self, monday, tmp_path):
        options = ["--up", "0,-2,0", "--measures", "range_height,max_tilt", "--axis", "0,-1,0"]
        assert call(monday, "--out", tmp_path / "o", "-q", *options) == 0
        found = averages(measured(tmp_path / "o"))
        assert found["range_height"]["value"] == pytest.approx(0.1, rel=0.05)
        assert found["max_tilt"]["high"] < 0.05

    def test_without_up_heights_are_left_out(self, monday, tmp_path):
        assert call(monday, "--out", tmp_path / "o", "-q", "--measures", "range_height,reach") == 0
        assert set(averages(measured(tmp_path / "o"))) == {"reach"}

    def test_targets_are_measured(self, monday, tmp_path):
        (tmp_path / "line.csv").write_text("0,0,0.8\n0.25,0.1,0.8\n")
        options = ["--target", "sphere:0.25,0.1,0.8,0.05", "--target", f"path:{tmp_path / 'line.csv'},0.02"]
        assert call(monday, "--out", tmp_path / "o", "-q", *options, *FEW) == 0
        found = averages(measured(tmp_path / "o"))
        assert found["target1_nearest"]["value"] == pytest.approx(0, abs=1e-3)
        assert found["target1_time"]["value"] > 0.7
        assert found["target2_mean"]["value"] == pytest.approx(0, abs=1e-3)

    def test_another_point_of_the_object_is_measured(self, monday, tmp_path):
        options = ["--point", "0,0,0.5", "--export", "csv", *FEW]
        assert call(monday, "--out", tmp_path / "o", "-q", *options) == 0
        (moved,) = st.motion.load(tmp_path / "o" / "trajectory.csv")
        assert np.median(moved.poses[:, 2, 3]) == pytest.approx(1.3, abs=0.01)

    def test_frames_per_second_replace_the_times(self, monday, tmp_path):
        assert call(monday, "--out", tmp_path / "o", "-q", "--fps", "60", *FEW) == 0
        assert measured(tmp_path / "o")["sessions"][0]["objects"][0]["rate_hz"] == pytest.approx(60)

    @pytest.mark.parametrize("suffix", ["c3d", "csv"])
    def test_exported_poses_are_read_back(self, monday, tmp_path, suffix):
        if suffix == "c3d":
            pytest.importorskip("ezc3d")
        assert call(monday, "--out", tmp_path / "o", "-q", "--export", suffix, *FEW) == 0
        (found,) = st.motion.load(tmp_path / "o" / f"trajectory.{suffix}")
        true = reaches(found.times_s, STARTS_S)
        assert len(found) == 7 * FPS
        # The smoothed noise of 1 mm.
        assert np.sqrt(((found.poses[:, :3, 3] - true) ** 2).mean()) < 0.8e-3
        assert found.name == "monday"

    def test_exports_for_opensim_have_a_row_per_frame(self, monday, tmp_path):
        assert call(monday, "--out", tmp_path / "o", "-q", "--export", "sto, trc", *FEW) == 0
        out = tmp_path / "o"
        assert {p.name for p in out.iterdir()} == {
            *FILES, "trajectory.sto", "trajectory_position.sto", "trajectory.trc",
        }  # fmt: skip
        positions = (out / "trajectory_position.sto").read_text().split("endheader\n")[1].splitlines()
        assert positions[0].split("\t") == ["time", "monday"]
        assert len(positions) == 1 + 7 * FPS
        first = [float(v) for v in positions[1].split("\t")[1].split(",")]
        assert first == pytest.approx([0, 0, 0.8], abs=3e-3)
        markers = (out / "trajectory.trc").read_text().splitlines()
        assert [float(v) for v in markers[6].split("\t")[2:5]] == pytest.approx([0, 0, 800], abs=3)


def rows(times, position="0 0 0.8"):
    return "".join(f"{t} {position} 0 0 0 1\n" for t in times)


EVEN = [k / FPS for k in range(90)]


class TestWhatIsRefused:
    @pytest.mark.parametrize(
        ("content", "options", "words"),
        [
            (rows([*EVEN[:40], *EVEN[50:60], *EVEN[40:50]]), [], ("times_s", "not sorted", "--fps")),
            (rows([*EVEN, EVEN[-1]]), [], ("times_s", "repeated", "--fps")),
            (rows(EVEN, "nan nan nan"), [], ("lost in all frames",)),
            (rows(EVEN[:1]), [], ("expected at least 8 poses", "got 1")),
            (rows(EVEN, "0 0 800"), [], ("in mm", "--unit mm")),
            ("", [], ("the file is empty",)),
            ("a b c\n", [], ("line 1",)),
            (rows(EVEN), ["--object", "mug"], ("--object", "'mug'", "exercise")),
            (rows(EVEN), ["--measures", "elegance"], ("measures: expected names of", "'elegance'")),
            (rows(EVEN), ["--up", "table"], ("--up", "no recording", "--up x,y,z")),
            (rows(EVEN), ["--frame", "table"], ("--frame", "no recording")),
            (rows(EVEN), ["--up", "0,0,0"], ("up: expected a direction",)),
            (rows(EVEN), ["--up", "nan,0,1"], ("up: expected a direction",)),
            (rows(EVEN), ["--repetitions", "/nowhere.json"], ("--repetitions", "no such file")),
            (rows(EVEN), ["--repetitions", "{tmp}/beyond.json"], ("spans_s", "within the recording")),
            (
                rows(EVEN),
                ["--repetitions", "{tmp}/wrong.json"],
                ("--repetitions", "expected a repetitions.json"),
            ),
            (rows(EVEN), ["--cues", "{tmp}/wrong.json"], ("--cues", "'cues_s'")),
        ],
    )
    def test_bad_input_is_one_line_and_leaves_nothing(self, content, options, words, tmp_path, capsys):
        path = tmp_path / "exercise.txt"
        path.write_text(content)
        (tmp_path / "beyond.json").write_text("[[0.5, 99]]")
        (tmp_path / "wrong.json").write_text('{"objects": []}')
        out = tmp_path / "out"
        code = call(path, "--out", out, *(o.format(tmp=tmp_path) for o in options))
        line = told(capsys)
        assert code == 1, line
        for word in words:
            assert word in line
        assert not out.exists()

    def test_times_are_asked_for_where_a_file_has_none(self, folder, tmp_path, capsys):
        assert call(folder / "poses.csv", "--out", tmp_path / "o") == 1
        assert "--fps" in told(capsys)
        assert call(folder / "poses.csv", "--out", tmp_path / "o", "--fps", "30", "-q", *FEW) == 0
        assert len(measured(tmp_path / "o")["sessions"][0]["objects"]) == 2

    @pytest.mark.parametrize(
        ("options", "option"),
        [
            (["--target", "cone:1"], "--target"),
            (["--target", "sphere:0,0,1"], "--target"),
            (["--target", "path:/nowhere.csv,0.1"], "--target"),
            (["--target", "sphere:0,0,800,50"], "--target"),
            (["--export", "xlsx"], "--export"),
            (["--export", "csv,"], "--export"),
            (["--by", "smell"], "--by"),
            (["--frame", "room"], "--frame"),
            (["--up", "0,1"], "--up"),
            (["--up", "high"], "--up"),
            (["--axis", "z"], "--axis"),
            (["--point", "top"], "--point"),
            (["--cues", "soon"], "--cues"),
            (["--fps", "0"], "--fps"),
            (["--max-gap", "-1"], "--max-gap"),
            (["other.txt", "--repetitions", "r.json"], "--repetitions"),
        ],
    )
    def test_a_wrong_option_is_named(self, options, option, monday, tmp_path, capsys):
        assert call(monday, *options, "--out", tmp_path / "o") == 2
        assert option in told(capsys)
        assert not (tmp_path / "o").exists()

    def test_a_folder_to_write_is_needed(self, monday, capsys):
        assert call(monday) == 2
        assert "--out" in told(capsys)

    @pytest.mark.parametrize("path", ["/nowhere.txt", "/nowhere", "{tmp}", "{tmp}/a.xyz"])
    def test_what_is_no_result_is_told(self, path, tmp_path, capsys):
        (tmp_path / "a.xyz").write_text("1")
        assert call(path.format(tmp=tmp_path), "--out", tmp_path / "o") == 1
        assert path.format(tmp=tmp_path) in told(capsys)
