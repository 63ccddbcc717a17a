# SPDX-License-Identifier: MIT
"""The pages do what they say: their code and their commands are run in order, on short recordings.

A page of docs/howto has a test of its own; README.md and the pages of docs/ say in `page_scenes` what they take for
granted. A block that cannot run here has `<!-- not run: REASON -->` in the line before it.
"""

import collections
import itertools
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import cv2
import howto_fakes
import numpy as np
import pytest
from page_scenes import PAGES

import sdftrack as st
from sdftrack.cli.app import run

ROOT = Path(__file__).resolve().parents[2]
HOWTOS = ROOT / "docs" / "howto"
BLOCK = re.compile(
    r"^ *(?:<!-- not run: (?P<reason>\w+) -->\n *)?```(?P<language>\w*)\n(?P<code>.*?)^ *```",
    re.MULTILINE | re.DOTALL,
)
# Why a block is not run: the first tier installs by the README's lines and the C++ page's.
REASONS = {"installation", "camera", "network", "ROS", "laboratory"}
ELSEWHERE = {"stream.md": "test_streams.py"}
SHOWN = {"text", "cpp", "cmake", "html", "mermaid"}  # files, sources, pictures
CAMERA = st.Camera(420.0, 420.0, 319.5, 239.5, 640, 480)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A folder with two recordings of a duck, its mesh in millimetres, and its mask in the first image."""
    folder = tmp_path_factory.mktemp("howtos")
    mesh = st.synth.duck_mesh()
    for name, seed in (("recording", 4), ("recording_2", 5)):
        made = st.synth.sequence(mesh, 8, noise=0.001, clutter="objects", seed=seed, camera=CAMERA)
        st.save_sequence(folder / name, made, layout="bop")
    st.Mesh(1000 * mesh.vertices, mesh.faces, mesh.colors).save(folder / "part.ply")
    with st.open_sequence(folder / "recording") as seq:
        mask = seq.masks(0)[0]
    cv2.imwrite(str(folder / "mask.png"), 255 * mask.astype(np.uint8))
    return folder


def run_shell(code):
    """In a shell whose `.venv` has this package's command."""
    commands = Path(".venv", "bin").absolute()
    commands.mkdir(parents=True)
    (commands / "activate").write_text(f'PATH="{commands}:$PATH"\n')
    (commands / "sdftrack").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m sdftrack "$@"\n')
    (commands / "sdftrack").chmod(0o755)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}  # the package that this process has
    done = subprocess.run(
        ["bash", "-euc", code], env=environment, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def page(recorded, tmp_path, monkeypatch):
    """Runs a page in a folder of its own; the names that its code defined."""
    folder = tmp_path / "here"
    shutil.copytree(recorded, folder)
    monkeypatch.chdir(folder)

    def run_page(path, replaced=(), given=None):
        path = HOWTOS / path
        text = path.read_text(encoding="utf-8")
        for old, new in replaced:
            assert old in text
            text = text.replace(old, new)
        names = {"__name__": "howto", **(given or {})}
        for block in BLOCK.finditer(text):
            language, code = block["language"], block["code"]
            if block["reason"] or language in SHOWN:
                continue
            if language == "python":
                exec(compile(code, path.name, "exec"), names)
            elif all(line.startswith("sdftrack ") for line in code.splitlines()):
                for line in code.splitlines():
                    _, *arguments = shlex.split(line, comments=True)
                    assert run([*arguments, *(["--quiet"] if arguments[0] == "track" else [])]) == 0, line
            else:
                run_shell(code)
        return names

    return run_page


@pytest.fixture
def sequence(recorded):
    with st.open_sequence(recorded / "recording") as seq:
        yield seq


def install(monkeypatch, modules):
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)


def test_every_block_is_run_or_says_why_not(capsys):
    source = Path(__file__).read_text(encoding="utf-8")
    ran, reasons = 0, collections.Counter()
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted(HOWTOS.glob("*.md"))]:
        at_work = (
            path.name in PAGES or re.search(rf'page\(\s*"{path.name}"', source) or path.name in ELSEWHERE
        )
        for block in BLOCK.finditer(path.read_text(encoding="utf-8")):
            where = f"{path.name}: {block['code'].splitlines()[0]}"
            if block["reason"]:
                assert block["reason"] in REASONS, where
                reasons[block["reason"]] += 1
            elif block["language"] not in SHOWN:
                assert block["language"] in ("python", "bash"), f"{where}: not run; mark it, or make it bash"
                assert at_work, (
                    f"{where}: no test runs this page; add it to page_scenes.py, or mark the block"
                )
                ran += 1
    with capsys.disabled():
        left = ", ".join(f"{count} {reason}" for reason, count in sorted(reasons.items()))
        print(f"\nblocks of code in the pages: {ran} run, not run: {left}")


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(PAGES) - {"README.md"}))
def test_a_page_runs_as_printed(name, page, data_dir):
    page(ROOT / "docs" / name, given=PAGES[name](Path.cwd(), data_dir))


@pytest.mark.slow
def test_a_newcomer_who_follows_the_readme_gets_a_video_and_an_evaluation(page, data_dir):
    page(ROOT / "README.md", given=PAGES["README.md"](Path.cwd(), data_dir))
    for result in ("result", "tracked"):
        assert Path(result, "overlay.mp4").stat().st_size > 10_000
    (found,) = json.loads(Path("tracked/evaluation/result.json").read_text())["objects"]
    assert (found["frames"], found["lost"]) == (12, 0)
    assert found["adds_mm"]["mean"] < 10  # the reference itself is good to some millimetres


@pytest.mark.slow
def test_choosing_voxels(page, capsys):
    names = page("voxels.md", [("mesh, 20,", "mesh, 8,")])
    errors = [float(error) for error in re.findall(r"error ([\d.]+) mm", capsys.readouterr().out)]
    assert len(errors) == 3
    assert errors[0] > errors[1] > errors[2]
    assert names["tracker"] is not None


@pytest.mark.slow
def test_tracking_at_90_hz(page):
    names = page("speed.md")
    assert all(result.ok for result in names["results"])


@pytest.mark.slow
def test_symmetric_objects(page):
    names = page("symmetry.md")
    assert names["result"].ok
    assert names["position_m"] < 0.001
    assert names["angle_rad"] < np.radians(1)
    plain = st.Tracker(names["box"], names["sequence"].camera)
    start = plain.start(names["sequence"][0], masks=[names["sequence"].masks(0)[0]])
    assert (start.status[0], "ambiguous" in start.reason[0]) == ("weak", True)


@pytest.mark.slow
def test_good_to_one_millimetre(page):
    names = page("one_millimetre.md")
    assert len(names["good"]) == 7


@pytest.mark.slow
def test_a_recording_of_ones_own(page):
    page("own_recording.md")
    assert {path.name for path in Path("result").iterdir()} >= {
        "start.png", "overlay.mp4", "poses.csv", "trajectory_0.txt", "report.json", "report.html",
    }  # fmt: skip
    assert len(st.open_sequence("from_arrays")) == 3


@pytest.mark.slow
def test_the_browser(page, capsys):
    pytest.importorskip("viser", reason="viser is not installed: pip install 'sdftrack[viewer]'")
    shown = ("sdftrack view result/", "sdftrack view recording/", "sdftrack view part.ply --unit mm")
    names = page("browser.md", [(line + "\n", f"{line} --seconds 0.2 --port 0\n") for line in shown])
    assert capsys.readouterr().out.count("the page: http://localhost:") == 3
    assert all(result.ok for result in names["results"])
    assert names["result"].ok
    names["sequence"].close()


@pytest.mark.slow
def test_many_recordings(page, capfd):
    names = page("many_recordings.md")
    results = [
        Path("results/track") / name / f"voxels={v}"
        for name in ("recording", "recording_2")
        for v in (100, 160)
    ]
    assert all((folder / "poses.csv").is_file() for folder in results)
    assert [row["status"] for row in names["rows"]] == ["done"] * 8
    assert "8 calls" in capfd.readouterr().out


@pytest.fixture
def realsense(sequence, monkeypatch):
    """A RealSense without hardware that shows the recording forwards and backwards, 30 times a second."""
    pytest.importorskip("pyrealsense2", exc_type=ImportError, reason="needs the extra realsense")
    from support.software_realsense import SoftwareRealSense

    camera = SoftwareRealSense(sequence.camera, 0.0001)
    monkeypatch.setattr("sdftrack.live.realsense.connected", lambda rs: [camera.device])
    frames = list(sequence)
    stop = threading.Event()

    def run():
        shown = itertools.cycle([*frames, *frames[-2:0:-1]])
        while not stop.wait(1 / 30):
            camera.feed(next(shown), time.time())

    thread = threading.Thread(target=run)
    thread.start()
    yield camera
    stop.set()
    thread.join()


@pytest.mark.slow
def test_a_realsense_live_and_recorded(page, sequence, realsense):
    from support.software_realsense import SoftwareRealSense, record

    mask = sequence.masks(0)[0]
    v, u = np.argwhere(mask)[np.count_nonzero(mask) // 2]
    record(Path("recorded.db3"), SoftwareRealSense(sequence.camera, 0.0001), sequence, pause_s=0.1)
    names = page(
        "realsense.md",
        [
            ("320, 240", f"{u}, {v}"), ("320,240", f"{u},{v}"), (">= 300", ">= 20"),
            ("--seconds 10 --out tracked/", "--seconds 1 --no-viewer --out tracked/"),
            ("--seconds 10 --out from", "--seconds 1 --out from"),
        ],
    )  # fmt: skip
    assert names["result"].ok
    T = names["result"].pose
    assert np.linalg.norm(T[:3, 3] - sequence.ground_truth[len(sequence) - 1][0][:3, 3]) < 0.003
    assert Path("tracked/poses.csv").is_file()
    assert Path("tracked_again/poses.csv").is_file()


@pytest.mark.slow
def test_frames_from_ros2(page, sequence, monkeypatch):
    pytest.importorskip("rosbags")
    frames, published = list(sequence), []
    install(monkeypatch, howto_fakes.ros(frames, CAMERA, published))
    write_bag(Path("bag"), frames)
    page("ros2.md")
    truth = sequence.ground_truth
    assert len(published) == len(frames)
    for i, message in enumerate(published):
        at = message.pose.pose.position
        assert np.allclose([at.x, at.y, at.z], truth[i][0][:3, 3], atol=0.002)
        turn = message.pose.pose.orientation
        assert np.hypot(np.hypot(turn.x, turn.y), np.hypot(turn.z, turn.w)) == pytest.approx(1)


def write_bag(folder, frames):
    import bag_writers

    messages = [bag_writers.info("/depth/camera_info", 0, "depth", CAMERA)]
    messages += [
        bag_writers.image("/depth/image_rect", i * 10**9, "depth", howto_fakes.millimetres(frame), "16UC1")
        for i, frame in enumerate(frames)
    ]
    bag_writers.write_ros2(folder, messages)


@pytest.mark.slow
def test_live(page, capsys):
    shorter = [
        ("--frames 120", "--frames 30"), ("--seconds 20", "--seconds 4"), ("--seconds 10", "--seconds 2"),
        ("--seconds 5", "--seconds 2"),
    ]  # fmt: skip
    page("live.md", shorter)
    said = capsys.readouterr()
    assert "open http://localhost:" in said.err
    assert "frames written to as_bag, layout mcap" in said.out
    with st.open_sequence("recorded") as recorded, st.open_sequence("as_bag") as bag:
        assert len(recorded) == len(bag) > 10
        np.testing.assert_array_equal(recorded[3].depth, bag[3].depth)


@pytest.mark.slow
def test_an_exercise_step_by_step(page, capsys):
    page("exercise.md", [("--repetitions 5", "--repetitions 2 --fps 15")])
    assert "2 repetitions (2 to 2)" in capsys.readouterr().out
    for folder in ("measured", "corrected", "compared"):
        assert (Path(folder) / "report.html").is_file()
    assert "Changes since" in Path("compared/report.html").read_text(encoding="utf-8")
    assert {p.suffix for p in Path("exported").glob("trajectory*")} == {".csv", ".sto", ".trc"}
