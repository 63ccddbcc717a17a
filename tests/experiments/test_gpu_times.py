# SPDX-License-Identifier: MIT
"""Times on a GPU are recorded task by task: a run that is cut off keeps what it has measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from experiments import record
from experiments.gpu import measure, times

ONE = {
    "cpu_ms": {"median": 2.0, "lower": 1.0, "upper": 3.0},
    "gpu_ms": {"median": 0.5, "lower": 0.4, "upper": 0.6},
}


def test_a_run_that_is_cut_off_has_recorded_what_it_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cut_off(device: str, quick: bool, each: Any) -> None:
        each({"superpixels, 640 x 480": ONE})
        each({"superpixels, 640 x 480": ONE, "something": ONE})
        raise KeyboardInterrupt

    monkeypatch.setattr(times, "measure", cut_off)
    monkeypatch.setattr(times, "device_number", lambda device: 0)
    monkeypatch.setattr(times._core, "cuda_device_name", lambda number: "GPU of a test")
    with pytest.raises(KeyboardInterrupt):
        times.main(["--out", str(tmp_path / "out"), "--quick"])
    made = record.load("gpu_times", tmp_path / "out")
    assert made["runs"][0]["settings"] == {"device": "cuda", "quick": True}
    assert [row[:3] for row in made["tables"][0]["rows"]] == [
        ["superpixels, 640 x 480", "2.00", "0.50"],
        ["something", "2.00", "0.50"],
    ]


def test_each_task_is_told_of_when_it_has_been_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    tasks = {name: lambda device: lambda: None for name in ("first", "second")}
    monkeypatch.setattr(measure, "calls", lambda quick: tasks)
    told: list[list[str]] = []
    measure.measure("cuda:0", True, lambda so_far: told.append(list(so_far)))
    assert told == [["first"], ["first", "second"]]
