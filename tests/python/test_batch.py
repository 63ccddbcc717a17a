# SPDX-License-Identifier: MIT
"""A function over many items in other processes: outcomes, deaths, retries, order."""

import os

import batch_functions as functions
import pytest

import sdftrack as st
from sdftrack import batch
from sdftrack.batch.cluster import Died, Task, cluster, outcomes, workers_for

pytestmark = pytest.mark.filterwarnings("default")  # dask's own, in other versions


def rendered(frames):
    camera = st.Camera(60.0, 60.0, 31.5, 23.5, 64, 48)
    return st.synth.sequence(st.SDF.sphere(0.06, voxels=32), frames, camera=camera, noise=0.001, seed=1)


@pytest.fixture(scope="module")
def connect():
    with cluster(None, 1) as connect:
        yield connect


@pytest.mark.slow
class TestMap:
    def test_outcomes_are_in_the_order_of_the_items_and_an_error_is_one(self):
        seen = []
        found = batch.map(
            functions.refuses_three, [5, 3, 4], jobs=2,
            progress=lambda done, total: seen.append((done, total)),
        )  # fmt: skip
        assert [o.value for o in found] == [5, None, 4]
        assert found[1].error.args == ("expected another number than 3",)
        assert seen == [(1, 3), (2, 3), (3, 3)]

    def test_a_sequence_is_read_by_another_process(self, tmp_path):
        st.save_sequence(tmp_path / "seq", rendered(2))
        (found,) = batch.map(functions.frames_of, [st.open_sequence(tmp_path / "seq")], jobs=1)
        assert found.error is None
        assert found.value == (2, (48, 64))


@pytest.mark.slow
class TestDeaths:
    def test_what_died_is_repeated_and_what_always_dies_is_said(self, connect, tmp_path):
        items = [(str(tmp_path), "a"), (str(tmp_path), "b")]
        tasks = [Task(f"t{i}", item) for i, item in enumerate(items)]
        found = {
            task.name: outcome for task, outcome in outcomes(connect, functions.dies_once, tasks, retries=2)
        }
        assert found == {"t0": "a", "t1": "b"}

    def test_retries_end(self, connect):
        tasks = [Task(f"t{i}", i) for i in range(2)]
        found = {task.name: outcome for task, outcome in outcomes(connect, functions.dies, tasks, retries=1)}
        assert found["t0"] == 0
        assert isinstance(found["t1"], Died)
        assert "died (2 times)" in str(found["t1"])


@pytest.mark.slow
class TestMany:
    def test_more_tasks_than_the_window_holds(self, connect, monkeypatch):
        monkeypatch.setattr("sdftrack.batch.cluster.WINDOW", 7)
        tasks = [Task(f"t{i}", i) for i in range(50)]
        found = {task.argument: outcome for task, outcome in outcomes(connect, functions.square, tasks)}
        assert found == {i: i * i for i in range(50)}

    def test_resources_that_no_worker_has_are_said(self, connect):
        with pytest.raises(ValueError, match=r"expected a worker with --resources GPU=1, got none"):
            list(outcomes(connect, functions.square, [Task("t", 1, resources={"GPU": 1})]))


class TestBadInput:
    def test_no_items(self):
        assert batch.map(functions.square, []) == []

    @pytest.mark.parametrize("scheduler", ["nonsense", "tcp://:8786", "http:/x"])
    def test_no_address(self, scheduler):
        with pytest.raises(ValueError, match=r"scheduler: expected an address such as tcp://node1:8786"):
            batch.map(functions.square, [1], scheduler=scheduler)

    @pytest.mark.slow
    def test_nobody_there(self):
        with pytest.raises(
            ConnectionError, match=r"cannot reach tcp://127.0.0.1:1; is `dask scheduler` running"
        ):
            batch.map(functions.square, [1], scheduler="tcp://127.0.0.1:1")

    def test_more_memory_than_there_is(self):
        with pytest.raises(ValueError, match=r"memory_gb: expected at most .* on this machine, got 1e\+06"):
            workers_for(0, int(1e15), 1)

    def test_the_number_of_workers_is_bounded_by_cores_threads_and_memory(self):
        assert workers_for(3, None, 1) == 3
        assert workers_for(0, None, 10**4) == 1
        assert workers_for(0, None, 1) == len(os.sched_getaffinity(0)) or workers_for(0, None, 1) >= 1
