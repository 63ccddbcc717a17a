# SPDX-License-Identifier: MIT
"""Registry, options, runner and targets of the experiments, and that the installed package knows nothing of them."""

import json
import tomllib
from pathlib import Path
from typing import Literal

import pytest

from experiments import targets
from experiments.__main__ import run
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import Experiment, all_experiments
from experiments.table import Table
from experiments.targets import Target, judge, targets_of

ROWS = [["a", "1.5 %"], ["b", "no"]]


def stones(
    *,
    data: Path,
    n: int = 3,
    height: float | None = None,
    only: tuple[str, ...] = ("granite",),
    ground: Literal["sand", "rock"] = "sand",
    wind: bool = False,
    options: Settings = NO_SETTINGS,
) -> Table:
    """How far stones fall.

    Parameters
    ----------
    n
        stones of each kind,
        at least one
    ground
        where they end
    """
    told = f"{n} {height} {','.join(only)} {ground} {wind} {dict(options)} {data.name}"
    return Table(told, ["stone", "fell"], ROWS, ["a note"], {"a": 1.5})


STONES = Experiment("stones", stones, ("quarry",), (), "one heap", "another", {"n": 1})


def test_every_experiment_has_a_summary_and_says_what_it_was_chosen_and_reported_on():
    for name, known in all_experiments().items():
        assert known.summary.endswith((".", "?")), name
        assert known.chosen_on, name
        assert known.reported_on, name


def test_options_come_from_the_signature_and_the_record_has_all_that_a_reader_needs(tmp_path, capsys):
    (tmp_path / "quarry").mkdir()
    places = f"--data {tmp_path} --out {tmp_path / 'made'}"
    run(STONES, f"{places} --n 5 --height 2 --only slate,flint --ground rock --wind --set spin=0.5".split())
    printed = capsys.readouterr().out
    assert f"5 2.0 slate,flint rock True {{'spin': 0.5}} {tmp_path.name}" in printed
    assert "a note" in printed
    record = json.loads((tmp_path / "made" / "stones.json").read_text())
    assert set(record["runs"][0]) == {"machine", "commit", "date", "settings", "seconds", "sources"}
    assert record["runs"][0]["settings"]["only"] == ["slate", "flint"]
    assert record["tables"][0]["rows"] == ROWS
    assert record["tables"][0]["numbers"] == {"a": 1.5}


def test_a_short_run_takes_the_short_options_and_records_nothing_unasked(tmp_path, capsys):
    (tmp_path / "quarry").mkdir()
    run(STONES, ["--data", str(tmp_path)], short=True)
    printed = capsys.readouterr().out
    assert printed.startswith("1 None granite")
    assert "recorded" not in printed


def test_targets_are_met_or_missed_by_rows():
    tables = [Table("falls", ["stone", "fell"], ROWS)]
    assert Target("a", "fell", row="a", max=2).met_by("1.5 %")
    assert not Target("a", "fell", min=2).met_by("no")
    assert Target("b", "fell", equals="no").met_by("no")
    assert (
        str(targets._judge_one(Target("falls", "fell", row="a", max=2), tables))
        == "target met: falls <= 2 (1 rows)"
    )
    missed = targets._judge_one(Target("falls", "fell", max=1), tables)
    assert str(missed) == "target missed: falls <= 1: a (1.5 %), b (no)"
    assert "not measured" in str(targets._judge_one(Target("falls", "rose", max=1), tables))


def test_targets_are_read_from_their_file_and_belong_to_experiments(tmp_path):
    known = all_experiments()
    for name in tomllib.loads(targets.FILE.read_text()):
        found = targets_of(name) if "." in name or name in known else []
        assert name in known, name
        assert found, name
    wrong = tmp_path / "targets.toml"
    wrong.write_text('[[stones]]\nfigure = "a"\ncolumn = "b"\nmost = 1\n')
    with pytest.raises(ValueError, match=r"targets.toml, stones: .*most"):
        targets_of("stones", wrong)
    assert judge("stones", []) == []
