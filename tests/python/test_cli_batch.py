# SPDX-License-Identifier: MIT
"""The command batch: plans, results as the single commands write them, going on after a crash."""

import csv
import json
import pickle
import shutil
import signal
import subprocess
import sys

import pytest
from fault_runs import stopped

import sdftrack as st
from sdftrack.batch.plan import Item, read_plan
from sdftrack.batch.task import RECORD, Call, call, log_of
from sdftrack.cli.app import _commands, run

pytestmark = pytest.mark.filterwarnings("default")  # dask's own, in other versions

PLAN = """
[[job]]
command = "track"
sequences = "recordings/*"
model = "box.ply"
unit = "m"
voxels = [24, 32]
no_video = true

[[job]]
command = "evaluate"
of = "track"
symmetry = "none"
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Three small recordings, one of which cannot be read, a model and a plan."""
    root = tmp_path_factory.mktemp("made")
    mesh = st.synth.exercise_object("box")
    mesh.save(root / "box.ply")
    camera = st.Camera(150.0, 150.0, 79.5, 59.5, 160, 120)
    for seed in range(2):
        seq = st.synth.sequence(mesh, 3, camera=camera, noise=0.001, seed=seed)
        st.save_sequence(root / "recordings" / f"run_{seed}", seq)
    broken = root / "recordings" / "run_2"
    shutil.copytree(root / "recordings" / "run_0", broken)
    (broken / "scene_camera.json").write_text("{")
    (root / "plan.toml").write_text(PLAN)
    return root


def started(made, out, *options):
    command = ["-m", "sdftrack", "batch", str(made / "plan.toml"), "--out", str(out), *options]
    return subprocess.Popen(
        [sys.executable, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def rows_of(out):
    with (out / "summary.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def files_of(folder):
    """Contents without times and without the record of the batch."""
    out = {}
    for path in sorted(folder.rglob("*")):
        if path.suffix == ".json" and path.name != RECORD:
            content = json.loads(path.read_text())
            for frame in content.get("frames", []):
                frame.pop("seconds", None)
            out[path.name] = content
        elif path.suffix in (".csv", ".txt"):
            rows = [
                line.rsplit(",", 1)[0] for line in path.read_text().splitlines()
            ]  # the last column is a time
            out[path.name] = rows
    return out


@pytest.fixture(scope="module")
def batch(made, tmp_path_factory):
    """A whole run: (folder, exit code, standard output, standard error)."""
    out = tmp_path_factory.mktemp("batch") / "out"
    process = started(made, out, "--jobs", "1")
    told, errors = process.communicate(timeout=300)
    return out, process.returncode, told, errors


def test_a_folder_that_no_batch_wrote_is_not_overwritten(made, tmp_path, capsys):
    mine = tmp_path / "track" / "run_1" / "voxels=32" / "mine.txt"
    mine.parent.mkdir(parents=True)
    mine.write_text("keep")
    assert run(["batch", str(made / "plan.toml"), "--out", str(tmp_path), "--overwrite", "--jobs", "1"]) == 1
    assert "expected results of an earlier batch" in capsys.readouterr().err
    assert mine.read_text() == "keep"


@pytest.mark.slow
class TestWholeRun:
    def test_what_failed_is_said_and_the_rest_is_done(self, batch):
        out, code, told, errors = batch
        assert code == 1
        assert errors.splitlines()[-1] == f"sdftrack: error: 4 of 12 calls failed: see {out / 'summary.csv'}"
        assert "track/run_2/voxels=24: refused: " in told
        assert "scene_camera.json" in told

    def test_the_summary_has_a_row_for_each_call_in_the_order_of_the_plan(self, batch):
        rows = rows_of(batch[0])
        assert [r["item"] for r in rows] == [
            f"{job}/run_{k}/voxels={v}" for job in ("track", "evaluate") for k in range(3) for v in (24, 32)
        ]
        assert [r["status"] for r in rows] == ["done"] * 4 + ["refused"] * 2 + ["done"] * 4 + ["skipped"] * 2
        assert {r["voxels"] for r in rows} == {"24", "32"}
        assert all(r["frames"] == "3" and int(r["ok"]) >= 1 for r in rows[:4])
        assert all(0 < float(r["translation_mm.mean"]) < 5 for r in rows[6:10])
        assert "track/run_2/voxels=24 has no results" in rows[-2]["reason"]

    def test_the_parquet_file_has_the_same_rows(self, batch):
        parquet = pytest.importorskip("pyarrow.parquet")
        table = parquet.read_table(batch[0] / "summary.parquet").to_pylist()
        for a, b in zip(rows_of(batch[0]), table, strict=True):
            assert a["item"] == b["item"]
            error = b["translation_mm.mean"]
            assert a["translation_mm.mean"] == ("" if error is None else str(error))

    def test_the_results_are_those_of_the_command_alone(self, batch, made, tmp_path):
        line = ["track", str(made / "recordings" / "run_1"), "--model", str(made / "box.ply"), "--unit", "m"]
        more = f"--voxels 24 --no-video --threads 1 --quiet --out {tmp_path / 'r'}".split()
        assert run([*line, *more]) == 0
        alone, own = files_of(tmp_path / "r"), files_of(batch[0] / "track" / "run_1" / "voxels=24")
        assert alone.keys() == own.keys()
        assert alone == own

    def test_nothing_unfinished_is_left(self, batch):
        assert not [p for p in batch[0].rglob("*") if p.name.endswith(".part") or p.name == ".sdftrack.lock"]
        assert not (batch[0] / "track" / "run_2" / "voxels=24").exists()

    def test_status_shows_the_same(self, batch, capsys):
        assert run(["batch", "status", str(batch[0])]) == 0
        text = capsys.readouterr().out
        assert "track" in text
        assert "refused" in text
        assert "scene_camera.json" in text

    def test_other_options_for_the_same_results_are_refused(self, batch, made, capsys):
        other = made / "other.toml"
        other.write_text(PLAN.replace("no_video = true", 'no_video = true\nmode = "depth"'))
        assert run(["batch", str(other), "--out", str(batch[0])]) == 1
        assert "with other options or of another recording" in capsys.readouterr().err


@pytest.mark.slow
def test_a_killed_run_goes_on(made, batch, tmp_path):
    out = tmp_path / "out"
    words = ["batch", str(made / "plan.toml"), "--out", str(out), "--jobs", "1"]
    stopped(words, lambda: list(out.glob("track/*/*/report.json")), by=signal.SIGKILL)
    second = started(made, out, "--jobs", "1")
    second.communicate(timeout=300)
    assert second.returncode == 1
    assert (out / "summary.csv").read_text() == (batch[0] / "summary.csv").read_text()
    assert not list(out.rglob("*.part"))


class TestCall:
    """A single call, as a worker runs it."""

    WORDS = ("--unit", "m", "--voxels", "24", "--no-video")

    def what(self, made, tmp_path, *, place=None, recording="run_0", cache=None, **fields):
        place = place or str(made)
        options = ["--model", f"{place}/box.ply", *self.WORDS]
        item = Item("a", "a", "track", f"{place}/recordings/{recording}", None, options, **fields)
        return Call(run, item, tmp_path / "out", cache)

    def test_the_second_one_finds_the_results_of_the_first(self, made, tmp_path):
        what = self.what(made, tmp_path)
        first = call(what)
        report = (tmp_path / "out/a/report.json").stat().st_mtime_ns
        second = call(what)
        assert (first.status, second.status) == ("done", "done")
        assert second.seconds == first.seconds
        assert (tmp_path / "out/a/report.json").stat().st_mtime_ns == report

    def test_what_is_refused_leaves_a_log_and_no_folder(self, made, tmp_path):
        result = call(self.what(made, tmp_path, recording="nowhere"))
        assert result.status == "refused"
        assert "nowhere" in result.reason
        assert result.reason in log_of(tmp_path / "out", "a").read_text()
        assert [path.name for path in (tmp_path / "out").iterdir()] == ["logs"]

    def test_recordings_and_models_at_addresses(self, made, tmp_path):
        cache = tmp_path / "cache"
        assert call(self.what(made, tmp_path, place=made.as_uri(), files=(1,), cache=cache)).status == "done"
        assert len(list(cache.iterdir())) == 2

    def test_a_call_that_takes_too_long_ends_its_process(self, made, tmp_path):
        what = self.what(made, tmp_path, timeout_s=0.05)
        (tmp_path / "call.pkl").write_bytes(pickle.dumps(what))
        code = "import pickle, sys; from sdftrack.batch.task import call; "
        code += "call(pickle.load(open(sys.argv[1], 'rb')))"
        line = [sys.executable, "-c", code, str(tmp_path / "call.pkl")]
        done = subprocess.run(line, capture_output=True, text=True, timeout=60)
        assert done.returncode == 1
        assert "timed out after 0.05 s" in log_of(tmp_path / "out", "a").read_text()
        again = call(what)  # which would take as long
        assert (again.status, again.reason) == ("refused", "timed out after 0.05 s")


class TestPlan:
    def read(self, tmp_path, text):
        for name in ("a.ply", "b.ply", "c.ply", "m.ply"):
            (tmp_path / name).touch()
        (tmp_path / "recordings" / "a").mkdir(parents=True, exist_ok=True)
        path = tmp_path / "plan.toml"
        path.write_text(text)
        return read_plan(path, {}, _commands())

    def job(self, **fields):
        given = {"command": "track", "sequences": "recordings/*", "model": "m.ply", **fields}
        return "[[job]]\n" + "".join(f"{k} = {json.dumps(v)}\n" for k, v in given.items() if v is not None)

    def test_lists_make_a_matrix_and_lists_in_lists_repeat_an_option(self, tmp_path):
        items = self.read(tmp_path, self.job(model=[["a.ply", "b.ply"], "c.ply"], mode=["depth", "rgbd"]))
        assert [i.name for i in items] == [
            f"track/a/model={m}_mode={d}" for m in ("a.ply,b.ply", "c.ply") for d in ("depth", "rgbd")
        ]
        models = ["--model", str(tmp_path / "a.ply"), "--model", str(tmp_path / "b.ply")]
        assert items[0].words == [*models, "--mode", "depth", "--threads", "1"]
        assert len({i.digest for i in items}) == 4

    def test_paths_are_those_beside_the_plan_and_no_result_depends_on_threads(self, tmp_path):
        one, two = (self.read(tmp_path, self.job(threads=n, no_video=True, outline=False))[0] for n in (1, 2))
        model = ["--model", str(tmp_path / "m.ply"), "--no-video", "--no-outline"]
        assert (one.source, one.options) == (str(tmp_path / "recordings" / "a"), model)
        assert one.words != two.words
        assert one.digest == two.digest

    @pytest.mark.parametrize(
        ("text", "told"),
        [
            ("x = [", "not a TOML file"),
            ("jobs = 3", "unknown option 'jobs'; did you mean 'job'?"),
            ("job = 3", "expected one or more tables [[job]]"),
        ],
    )
    def test_no_plan(self, tmp_path, text, told):
        with pytest.raises(ValueError, match=r"plan\.toml: ") as caught:
            self.read(tmp_path, text)
        assert told in str(caught.value)
        assert "\n" not in str(caught.value)

    @pytest.mark.parametrize(
        ("fields", "told"),
        [
            ({"command": "demo"}, "command: expected one of track"),
            ({"voxel": 3}, "unknown option 'voxel'; did you mean 'voxels'?"),
            ({"voxels": "many"}, "many"),
            ({"voxels": [[24, 32]]}, "voxels: expected one value for each call"),
            ({"voxels": []}, "voxels: expected a value or a list of values, got none"),
            ({"voxels": [[True]]}, "voxels: expected text or a number"),
            ({"no_video": 1}, "no_video: expected true or false, got 1"),
            ({"out": "x"}, "out: set by the batch"),
            ({"sequences": None}, "expected one of sequences"),
            ({"sequences": []}, "sequences: expected a path, a pattern or a list of them"),
            ({"sequences": "none/*"}, "sequences: nothing matches none/*"),
            ({"of": "x", "sequences": None}, "only evaluate and motion take results"),
            (
                {"command": "motion", "of": "x", "sequences": None, "model": None},
                "of: expected the name of an earlier job",
            ),
            ({"command": "evaluate", "model": None}, "expected of ="),
            ({"name": "../x"}, "name: expected a word that can name a folder"),
            ({"memory_gb": -1}, "memory_gb: expected 0 or more"),
            ({"gpus": True}, "gpus: expected a number, got True"),
            ({"model": None}, "--model"),
            ({"model": "none.ply"}, "model: no such file: "),
        ],
    )
    def test_a_wrong_job(self, tmp_path, fields, told):
        with pytest.raises(ValueError, match=r"plan\.toml: job ") as caught:
            self.read(tmp_path, self.job(**fields))
        assert told in str(caught.value)
        assert "\n" not in str(caught.value)

    def test_two_jobs_of_one_name(self, tmp_path):
        with pytest.raises(ValueError, match=r"expected a name for each of several jobs"):
            self.read(tmp_path, self.job() + self.job())

    def test_recordings_of_one_name(self, tmp_path):
        for name in ("x/run", "y/run"):
            (tmp_path / name).mkdir(parents=True)
        items = self.read(tmp_path, self.job(sequences=["x/run", "y/run", "x/run"]))
        assert [i.name for i in items] == ["track/run", "track/run_1"]


def test_check_shows_the_calls(made, capsys):
    assert run(["batch", str(made / "plan.toml"), "--check"]) == 0
    text = capsys.readouterr().out
    assert "12 calls" in text
    assert "evaluate/run_0/voxels=24" in text
