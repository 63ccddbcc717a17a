# SPDX-License-Identifier: MIT
"""The command line: exit codes, one-line errors, files."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import duck_scene
import numpy as np
import pytest
from duck_scene import FRAMES
from refusals import error_line

import sdftrack as st
from sdftrack._internal.option_files import options_as_toml
from sdftrack.cli import demo
from sdftrack.cli.app import parser, run
from sdftrack.cli.sources import folder_each

COMMON = ("--device", "--threads", "--config", "--quiet", "--out", "--overwrite")


def commands(command=None, name=()):
    """Every command with its parser, those of groups too: ("calibrate", "color"), ..."""
    command = parser() if command is None else command
    if not hasattr(command, "commands"):
        yield name, command
    for word, part in getattr(command, "commands", {}).items():
        yield from commands(part, (*name, word))


COMMANDS = {" ".join(name): command for name, command in commands()}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself_and_takes_the_common_options(command, capsys):
    assert run([*command.split(), "--help"]) == 0
    text = capsys.readouterr().out
    taken = {option for parameter in COMMANDS[command].params for option in parameter.opts}
    for option in COMMON:
        assert option in taken, option
        assert option in text, option


# Enough to reach the check of the common options; none of the paths exists.
REACH = {
    "track": ["seq", "--model", "m.ply"], "reconstruct": ["seq"], "fit": ["seq"],
    "superpixels": ["image.png"], "contour": ["seq", "--box", "1,1,2,2"], "evaluate": ["dir", "seq"],
    "convert": ["seq"], "record": ["replay:seq"], "live": ["--reconstruct", "--camera", "replay:seq"],
    "motion": ["result"], "batch": ["plan.toml"], "calibrate intrinsics": ["seq", "--model", "m.ply"],
    "view": ["seq"], "calibrate depth": ["seq"], "calibrate color": ["seq", "--ball-radius", "0.03"],
}  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_reads_its_config_before_it_works(command, tmp_path, capsys):
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("max_pixel = 3\n")
    arguments = [*command.split(), *REACH.get(command, []), "--out", str(tmp_path / "out")]
    assert run([*arguments, "--config", str(wrong)]) == 1
    assert "max_pixel" in error_line(capsys)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_refuses_an_unknown_device_and_a_negative_number_of_threads(command, tmp_path, capsys):
    arguments = [*command.split(), *REACH.get(command, []), "--out", str(tmp_path / "out")]
    assert run([*arguments, "--device", "tpu"]) == 2
    assert "--device" in error_line(capsys)
    assert run([*arguments, "--threads", "-1"]) == 2
    assert "--threads" in error_line(capsys)


ON_A_GPU = {"batch", "reconstruct", "track", "superpixels", "demo", "reproduce", "info"}


@pytest.mark.parametrize("command", [c for c in COMMANDS if c not in ON_A_GPU])
def test_a_command_that_would_ignore_a_gpu_refuses_it(command, tmp_path, capsys):
    arguments = [*command.split(), *REACH.get(command, []), "--out", str(tmp_path / "out")]
    assert run([*arguments, "--device", "cuda"]) == 2
    assert "runs on the CPU" in error_line(capsys)
    assert not (tmp_path / "out").exists()


def test_the_command_runs_as_a_program_with_its_exit_code():
    done = subprocess.run([sys.executable, "-m", "sdftrack", "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, st.__version__)
    bad = subprocess.run([sys.executable, "-m", "sdftrack", "nonsense"], capture_output=True, text=True)
    assert bad.returncode == 2
    assert bad.stderr.count("\n") == 1
    assert "nonsense" in bad.stderr


def test_an_interrupt_is_no_traceback(monkeypatch, capsys):
    def interrupted():
        raise KeyboardInterrupt

    monkeypatch.setattr("sdftrack.device.info", interrupted)
    assert run(["info"]) == 130
    assert "interrupted" in error_line(capsys)


def test_info_prints_what_the_function_returns(capsys, tmp_path):
    assert run(["info", "--out", str(tmp_path / "i"), "--threads", "1"]) == 0
    text = capsys.readouterr().out
    facts = json.loads((tmp_path / "i" / "info.json").read_text())
    assert facts["threads"] == 1
    assert {k: v for k, v in st.info().items() if k != "threads"}.items() <= facts.items()
    for name in facts:
        assert name in text


@pytest.mark.filterwarnings("default")
def test_a_warning_is_one_line_without_the_place_in_the_code(monkeypatch, capsys):
    import warnings

    monkeypatch.setattr(
        "sdftrack.device.info", lambda: warnings.warn("mesh: thin\nwalls", stacklevel=1) or {"a": 1}
    )
    assert run(["info"]) == 0
    assert capsys.readouterr().err == "sdftrack: warning: mesh: thin walls\n"


def test_config_prints_a_file_that_sets_every_option_to_its_default(capsys, tmp_path):
    assert run(["config", "--out", str(tmp_path / "c")]) == 0
    text = capsys.readouterr().out
    assert text.strip() == options_as_toml().strip()
    assert (tmp_path / "c" / "config.toml").read_text() == text
    assert st.TrackerOptions.from_file(tmp_path / "c" / "config.toml") == st.TrackerOptions()
    assert st.ReconstructorOptions.from_file(tmp_path / "c" / "config.toml") == st.ReconstructorOptions()


def test_config_carries_changed_options(capsys, tmp_path):
    (tmp_path / "a.toml").write_text("[tracker]\nmax_pixels = 777\n")
    assert run(["config", "--config", str(tmp_path / "a.toml")]) == 0
    assert "max_pixels = 777" in capsys.readouterr().out
    (tmp_path / "r.toml").write_text("max_pixels = 778\n[reconstruct]\nkept_frames = 77\nnoise_m = 0.003\n")
    assert run(["config", "--config", str(tmp_path / "r.toml")]) == 0
    text = capsys.readouterr().out
    assert all(line in text for line in ("max_pixels = 778", "kept_frames = 77", "noise_m = 0.003"))


MAX_ERROR_M, MAX_ERROR_RAD = 0.003, np.deg2rad(3.0)  # 1 mm noise, about 800 px: bound 0.1 mm, 0.1 deg


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A BOP scene with one duck, its model in millimetres."""
    root = tmp_path_factory.mktemp("data") / "ducks" / "test" / "000003"
    root.parent.mkdir(parents=True)
    poses = duck_scene.poses(1.0)
    st.save_sequence(root, duck_scene.scene(st.synth.duck_mesh(), poses), layout="bop")
    (model,) = root.glob("models/*.ply")
    return root, model, poses


VOXELS = ["--voxels", "80"]
MAX_DEMO_SURFACE_M = 0.0015  # mean of what was seen, of 2 mm voxels and a few frames; all of them give 0.5 mm


def rows_of(folder):
    with (folder / "poses.csv").open() as f:
        return list(csv.DictReader(f))


@pytest.mark.slow
def test_track_follows_the_truth_and_leaves_the_documented_files(recording, tmp_path, capsys):
    root, model, poses = recording
    out = tmp_path / "out"
    assert run(["track", str(root), "--model", str(model), "--out", str(out), *VOXELS]) == 0
    printed = capsys.readouterr()
    assert "8/8" in printed.err  # plain lines in a pipe
    assert "mean mm" in printed.out
    assert {p.name for p in out.iterdir()} == {
        "poses.csv", "sdftrack_ducks-test.csv", "trajectory_0.txt", "ground_truth_0.txt", "overlay.mp4",
        "report.json", "report.html",
    }  # fmt: skip
    rows = rows_of(out)
    assert [(r["scene_id"], r["im_id"], r["obj_id"]) for r in rows] == [
        ("3", str(i), "1") for i in range(FRAMES)
    ]
    report = json.loads((out / "report.json").read_text())
    for entry, T in zip(report["frames"], poses, strict=True):
        metres, radians = st.metrics.pose_error(np.array(entry["objects"][0]["pose"]), T)
        assert metres < MAX_ERROR_M
        assert radians < MAX_ERROR_RAD
    assert report["settings"]["tracker"]["max_pixels"] > 0
    assert run(["evaluate", str(out), str(root), "--quiet"]) == 0


def test_track_takes_poses_from_a_file_and_a_part_of_the_frames(recording, tmp_path):
    root, model, poses = recording
    (tmp_path / "poses.json").write_text(json.dumps({"T_cam_obj": [poses[2].tolist()]}))
    arguments = f"--init {tmp_path / 'poses.json'} --start 2 --stop 7 --step 2 --no-video".split()
    out = tmp_path / "out"
    assert run(["track", str(root), "--model", str(model), "--out", str(out), "-q", *arguments, *VOXELS]) == 0
    assert [r["im_id"] for r in rows_of(out)] == ["2", "4", "6"]
    assert not (out / "overlay.mp4").exists()


def test_the_colours_of_a_model_are_used_or_missed_by_name(recording, tmp_path, capsys):
    root, model, _ = recording
    mesh = st.Mesh.load(model, unit="mm")
    vertices = mesh.vertices * [1, 1, 1.001]  # not the recording's own
    colors = np.full((len(vertices), 3), 90, np.uint8)
    st.Mesh(vertices, mesh.faces, colors).save(tmp_path / "painted.ply")
    st.Mesh(vertices, mesh.faces).save(tmp_path / "grey.ply")
    common = ["track", str(root), "--unit", "m", "--colored", "--stop", "2", "--no-video", "-q", *VOXELS]
    for name, code in (("painted", 0), ("grey", 1)):
        files = ["--model", str(tmp_path / f"{name}.ply"), "--out", str(tmp_path / name)]
        assert run([*common, *files]) == code
    assert "expected colours at its vertices" in error_line(capsys)
    assert json.loads((tmp_path / "painted" / "report.json").read_text())["settings"]["colored"]
    blind = ["--mode", "depth", "--model", str(tmp_path / "painted.ply"), "--out", str(tmp_path / "none")]
    assert run([*common, *blind]) == 2


def test_a_foreign_model_in_millimetres_is_numbered_from_1(recording, tmp_path):
    root, model, _ = recording
    mesh = st.Mesh.load(model, unit="mm")
    foreign = st.Mesh(1e3 * mesh.vertices * [1, 1, 1.001], mesh.faces[:-1])
    foreign.save(tmp_path / "other.ply")
    out = tmp_path / "out"
    common = f"track {root} --model {tmp_path / 'other.ply'} --out {out} -q --no-video".split()
    assert run([*common, "--unit", "mm", "--holes", "close", "--stop", "3", *VOXELS]) == 0
    assert {r["obj_id"] for r in rows_of(out)} == {"1"}


def test_several_sequences_get_a_folder_each_and_failures_come_last(recording, tmp_path, capsys):
    root, model, _ = recording
    common = ["--model", str(model), "--out", str(tmp_path), "-q", "--no-video", "--stop", "2", *VOXELS]
    assert run(["track", "/nowhere", str(root), *common]) == 1
    assert "1 of 2 sequences failed: /nowhere" in error_line(capsys)
    assert (tmp_path / "000003" / "poses.csv").is_file()


def test_sequences_of_like_names_get_folders_of_different_names():
    names = [p.name for p in folder_each([Path(p) for p in ("a_1", "x/a", "y/a", "z/b")], Path("out"))]
    assert names == ["a_1", "a", "a_2", "b"]


@pytest.mark.slow
def test_the_demo_needs_nothing_and_writes_pictures(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["demo", "--frames", "12"]) == 0
    made = {p.name for p in (tmp_path / "sdftrack-demo").iterdir()}
    assert made >= {
        "overlay.mp4", "frames.png", "errors.png", "sdf_slices.png", "poses.csv", "report.json", "table.txt",
        "trajectory_0.txt", "ground_truth_0.txt", "mesh.ply", "mesh.png",
    }  # fmt: skip
    printed = capsys.readouterr().out
    assert "translation error (mm)" in printed
    assert "reconstructed surface (mm)" in printed
    report = json.loads((tmp_path / "sdftrack-demo" / "report.json").read_text())
    assert report["reconstruction"]["mean_distance_m"] < MAX_DEMO_SURFACE_M
    for name in ("VOXELS", "TURN_VOXELS"):  # the second one is made in the place of the first, faster
        monkeypatch.setattr(demo, name, 48)
    assert run(["demo", "--frames", "12", "-q"]) == 0
    with st.open_sequence(tmp_path / "sdftrack-demo" / "sequence") as seq:
        assert len(seq) == len(seq.ground_truth) == 12
        assert seq.masks(0)[0].any()
    (line,) = (line for line in printed.splitlines() if line.startswith("try it: sdftrack "))
    assert run(line.removeprefix("try it: sdftrack ").split()) == 0
    capsys.readouterr()
    mine = tmp_path / "sdftrack-demo" / "sequence" / "rgb" / "mine.png"
    mine.write_text("keep")
    assert run(["demo", "--frames", "12", "-q"]) == 1
    assert "no files of others" in error_line(capsys)
    assert mine.read_text() == "keep"
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "a.txt").write_text("keep")
    assert run(["demo", "--out", "mine", "-q"]) == 1
    assert "new or empty" in error_line(capsys)
