# SPDX-License-Identifier: MIT
"""A record holds every table of an experiment with the run that measured it, and a file is never half written."""

from pathlib import Path

import numpy as np
import pytest

from experiments import record, render, sources
from experiments.again import again, settings_of
from experiments.registry import Experiment, all_experiments


def table(title="Fall, 3.16 mm", cell="1.0", **more):
    return {"title": title, "columns": ["mesh", "mm"], "rows": [["cat", cell]], **more}


def test_a_record_says_what_was_measured_where_and_with_which_settings(tmp_path):
    path = record.save(
        "fall", {"seeds": np.int64(3), "data": tmp_path}, [table(numbers=np.eye(2))], 1.25, folder=tmp_path
    )

    assert path == tmp_path / "fall.json"
    assert record.names(tmp_path) == ["fall"]
    found = record.load("fall", tmp_path)
    (run,) = found["runs"]
    assert run["settings"] == {"seeds": 3, "data": str(tmp_path)}
    assert run["seconds"] == 1.25
    assert run["machine"]["cpu"]
    assert run["machine"]["cores"] >= 1
    assert len(run["date"]) == len("2026-01-31")
    assert found["tables"] == [
        {
            "id": "fall-3-16-mm", "title": "Fall, 3.16 mm", "columns": ["mesh", "mm"],
            "rows": [["cat", "1.0"]], "notes": [], "numbers": [[1.0, 0.0], [0.0, 1.0]], "run": 0,
        }
    ]  # fmt: skip


def measured(folder):
    """(id, first figure, settings) of each table."""
    found = record.load("fall", folder)
    return [(t["id"], t["rows"][0][1], found["runs"][t["run"]]["settings"]["way"]) for t in found["tables"]]


def test_a_run_replaces_that_with_the_same_settings_and_no_other(tmp_path):
    record.save("fall", {"way": "one"}, [table("A"), table("B")], 1.0, folder=tmp_path)
    record.save("fall", {"way": "two"}, [table("B", "2.0")], 1.0, folder=tmp_path)
    assert measured(tmp_path) == [("a", "1.0", "one"), ("b", "1.0", "one"), ("b-2", "2.0", "two")]

    record.save("fall", {"way": "one"}, [table("A", "3.0")], 1.0, folder=tmp_path)
    assert measured(tmp_path) == [("b-2", "2.0", "two"), ("a", "3.0", "one")]
    record.save("fall", {"way": "two"}, [table("B", "4.0")], 1.0, folder=tmp_path)
    assert measured(tmp_path) == [("a", "3.0", "one"), ("b-2", "4.0", "two")]


def test_a_run_measured_again_replaces_the_one_that_had_fewer_options(tmp_path):
    record.save("fall", {"way": "one"}, [table("A")], 1.0, folder=tmp_path)
    record.save("fall", {"way": "two"}, [table("A")], 1.0, folder=tmp_path)
    more = {"way": "one", "seeds": 1}
    record.save("fall", more, [table("A", "2.0")], 1.0, instead_of={"way": "one"}, folder=tmp_path)
    assert measured(tmp_path) == [("a-2", "1.0", "two"), ("a", "2.0", "one")]


def test_recorded_settings_are_values_of_the_options_again():
    def falls(*, frames: int, only: tuple[str, ...] = (), cache: Path | None = None, seeds: int = 3): ...

    known = Experiment("falls", falls, (), (), "one heap", "another", {})
    recorded = {"frames": 30, "only": ["a"], "cache": "x"}
    assert settings_of(known, recorded) == {"frames": 30, "only": ("a",), "cache": Path("x"), "seeds": 3}
    with pytest.raises(ValueError, match="today's options, got command"):
        settings_of(known, {"command": "python -m falls"})


def test_measuring_again_leaves_out_what_is_retired(tmp_path, monkeypatch):
    def falls(*, way: str = "one"): ...

    for way in ("one", "two"):
        record.save("fall", {"way": way}, [table("A")], 1.0, folder=tmp_path)
    made = record.load("fall", tmp_path)
    made["runs"][1]["retired"] = True
    record._write(made, record.path_of("fall", tmp_path))
    monkeypatch.setattr(record, "load", lambda name: made)
    asked = []
    known = Experiment("fall", falls, (), (), "one heap", "another", {})
    again(known, lambda chosen, settings, instead_of: asked.append((settings, instead_of)), print)
    assert asked == [({"way": "one"}, {"way": "one"})]


def test_a_page_is_filled_from_its_records(tmp_path):
    record.save("fall", {}, [table(notes=["one note"])], 1.0, folder=tmp_path)
    record.save("rise", {}, [table(cell="2|0")], 1.0, folder=tmp_path)
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- table: fall#fall-3-16-mm rise#fall-3-16-mm -->\nold\n<!-- end -->\nafter\n")
    options = ["--docs", str(tmp_path), "--results", str(tmp_path)]

    assert render.main([*options, "--check"]) == 1
    assert render.main(options) == 0
    assert render.main([*options, "--check"]) == 0
    lines = page.read_text().splitlines()
    assert lines[:2] + lines[-2:] == [
        "before",
        "<!-- table: fall#fall-3-16-mm rise#fall-3-16-mm -->",
        "<!-- end -->",
        "after",
    ]
    assert "| cat | 1.0 |" in lines
    assert "| cat | 2\\|0 |" in lines
    assert "one note" in lines


def test_a_record_is_stale_when_a_result_or_the_experiment_has_changed():
    """Not when comments, layout or code that keeps the results have."""
    now = {"experiments/fall.py": "1f", "gate: depth": "2e"}
    kept = {"commit": "a1", "sources": dict(now)}
    assert sources.changed_since({"runs": [kept]}, now) == []
    assert sources.changed_since({"runs": [kept]}, {**now, "gate: depth": "3d"}) == ["gate: depth"]
    assert sources.changed_since({"runs": [kept, {"commit": "b2"}]}, now) == [
        "measured at b2, without digests"
    ]


def test_the_digest_of_a_module_is_that_of_its_code():
    code = "def f():\n    return 1\n"
    assert sources.of_code('"""What it is."""\n# why\n' + code) == sources.of_code(code)
    assert sources.of_code(code.replace("1", "2")) != sources.of_code(code)


def test_every_experiment_names_runs_of_the_gate():
    for experiment in all_experiments().values():
        assert experiment.function.__module__.split(".")[1] in sources.GATE
        assert all(len(digest) == 12 for digest in sources.digests(experiment).values())


def test_the_numbers_of_every_frame_are_left_out(tmp_path):
    few, many = ({"spot": {"mm": [0.1] * n}} for n in (record.MOST_NUMBERS, record.MOST_NUMBERS + 1))
    for numbers, kept in ((few, few), (many, None)):
        record.save("fall", {}, [table(numbers=numbers)], 1.0, folder=tmp_path)
        assert record.load("fall", tmp_path)["tables"][0]["numbers"] == kept
